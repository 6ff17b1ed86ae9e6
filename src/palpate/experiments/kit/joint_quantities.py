"""How near an arm's joints come to their limits along a planned path, for a dry run."""

from palpate.kinematics import FollowedPath
from palpate.kinematics.followed_path import LEAST_ROOM
from palpate.kinematics.velocity import THRESHOLD
from palpate.reporting.data import Quantity


def joint_quantities(followed: FollowedPath | None) -> tuple[Quantity, ...]:
    """Return what a path asks of an arm's joints; nothing if palpate does not move them."""
    if followed is None:
        return ()
    room, speed, singular = followed.room, followed.speed, followed.singular_value
    return (
        Quantity("room of joints", room.value, "", f"rad or m, {room}; {LEAST_ROOM:g} is the least", digits=3),
        Quantity("fastest joint", 100.0 * speed.value, "%", f"of its limit, {speed}", digits=3),
        Quantity(
            "least singular value", singular.value, "", f"{singular}; below {THRESHOLD:g} it is damped", digits=3
        ),
    )


def joint_notes(followed: FollowedPath | None) -> tuple[str, ...]:
    """Return a note where a joint is too slow for a path."""
    if followed is None or followed.speed.value <= 1.0:
        return ()
    share, where = followed.speed.value, followed.speed
    return (f"The path would ask for {share:.3g} times the largest speed {where}; it takes longer there.",)
