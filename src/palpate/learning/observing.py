"""Observations of an agent: an `Observation` as arrays of fixed shape with bounds, in base coordinates."""

import numpy as np
import numpy.typing as npt
from gymnasium import spaces

from palpate.runtime import Limits, Observation
from palpate.spatial import ZERO, Vector, rotate, subtract

Seen = dict[str, npt.NDArray[np.float32]]

REACH = 0.1
"""Largest distance of a contact centroid from the sensor that is shown [m]; fingertips are smaller."""

BEYOND = 2.0
"""Forces, torques and velocities are shown up to so many times their limits, passed for an instant at most."""


def seen_space(limits: Limits) -> spaces.Dict:
    """Return the bounds of what is seen; anything beyond them is shown at the bound.

    - `touching`: 1 if something is touched, else 0; then all that belongs to the contact is 0.
    - `normal_force` [N], positive when pushing.
    - `tangential_force` [N], what the object exerts on the finger.
    - `spin_torque` [N m] about the normal.
    - `centroid` of the contact from the tip frame's origin [m].
    - `normal` of the fingertip there, into the object.
    - `position` of the tip frame's origin from where the episode began [m].
    - `velocity` of the tip frame's origin [m/s].

    Args:
        limits: Of the supervisor.
    """
    force, torque, speed = BEYOND * limits.force, BEYOND * limits.spin_torque, BEYOND * limits.speed
    room = float(np.linalg.norm(subtract(limits.workspace_upper, limits.workspace_lower)))
    return spaces.Dict(
        {
            "touching": _box(1, 1.0, least=0.0),
            "normal_force": _box(1, force, least=0.0),
            "tangential_force": _box(3, force),
            "spin_torque": _box(1, torque),
            "centroid": _box(3, REACH),
            "normal": _box(3, 1.0),
            "position": _box(3, room),
            "velocity": _box(3, speed),
        }
    )


def seen(now: Observation, begin: Vector, space: spaces.Dict) -> Seen:
    """Return what an agent sees of an observation.

    Args:
        now: All that is known.
        begin: Where the tip frame's origin was when the episode began, base frame [m].
        space: From `seen_space`.
    """
    arm, finger = now.arm, now.fingers[0]
    touching, centroid, normal, tangential, pressing, spin = 0.0, ZERO, ZERO, ZERO, 0.0, 0.0
    if finger.touching:
        contact, rotation = finger.contact, arm.rotation_base_tip
        touching, pressing, spin = 1.0, contact.normal_force, contact.spin_torque
        centroid = rotate(rotation, contact.centroid.tolist())
        normal = rotate(rotation, contact.normal.tolist())
        tangential = rotate(rotation, contact.tangential_force.tolist())
    values: dict[str, tuple[float, ...]] = {
        "touching": (touching,),
        "normal_force": (pressing,),
        "tangential_force": tangential,
        "spin_torque": (spin,),
        "centroid": centroid,
        "normal": normal,
        "position": subtract(arm.position_base_tip, begin),
        "velocity": arm.velocity_base_tip,
    }
    return {name: _within(value, space[name]) for name, value in values.items()}


def _box(size: int, most: float, least: float | None = None) -> spaces.Box:
    return spaces.Box(-most if least is None else least, most, (size,), np.float32)


def _within(value: tuple[float, ...], box: spaces.Space[object]) -> npt.NDArray[np.float32]:
    assert isinstance(box, spaces.Box)
    shown = np.array(value, np.float32)
    if not np.isfinite(shown).all():  # a lost device may report anything
        shown = np.nan_to_num(shown)
    return np.minimum(np.maximum(shown, box.low), box.high)
