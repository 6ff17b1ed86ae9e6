"""The one fingertip of a robot file, as experiments take it, and where it starts."""

from scipy.spatial.transform import Rotation

from palpate.errors import InvalidValueError
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.surface_entries import EllipsoidEntry, SphereEntry, SurfaceKind
from palpate.spatial import Vector


def only_finger(robot: Robot) -> FingerEntry:
    """Return the finger that an experiment with one fingertip moves: the first, if others only hold.

    Raises:
        InvalidValueError: It has several.
    """
    if len(robot.file.fingers) != 1 + robot.file.backend.holding:
        raise InvalidValueError(
            f"robot: it has {len(robot.file.fingers)} fingers, this takes one; for a hand there is palpate grasp"
        )
    return robot.file.fingers[0]


def tip_sizes(robot: Robot) -> tuple[float, ...]:
    """Return the half lengths of a robot's fingertip [m]; see `SurfaceKind.half_extents`.

    Raises:
        InvalidValueError: As in `only_finger`.
    """
    return only_finger(robot).surface.half_extents


def fingertip(robot: Robot, lengths: tuple[float, ...] = ()) -> SurfaceKind:
    """Return a robot's fingertip, or the sphere or ellipsoid of other half lengths [m] in its place.

    Raises:
        InvalidValueError: As in `only_finger`.
    """
    own = only_finger(robot).surface
    if not lengths or lengths == own.half_extents:
        return own
    x, y, z = Rotation.from_matrix(own.rotation).as_rotvec().tolist()
    rotvec = (x, y, z)
    if len(lengths) == 1:
        return SphereEntry(radius=lengths[0], center=own.center, rotvec=rotvec)
    a, b, c = lengths
    return EllipsoidEntry(semi_axes=(a, b, c), center=own.center, rotvec=rotvec)


def start_above(
    tip: SurfaceKind, top: float, clearance: float, beside: tuple[float, float] = (0.0, 0.0)
) -> Vector:
    """Return where the tip frame starts, base frame, for the tip to be above an object [m].

    Args:
        tip: The fingertip; its axes are those of the base.
        top: Of the object.
        clearance: From the tip to it.
        beside: Where the tip's middle is, x and y.
    """
    x, y, z = tip.center
    return (beside[0] - x, beside[1] - y, top + max(tip.half_extents) + clearance - z)
