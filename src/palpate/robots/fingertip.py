"""The one fingertip of a robot file, as experiments and simulations take it."""

import numpy as np

from palpate.errors import InvalidValueError
from palpate.open_kinds import name_of_kind
from palpate.robots.robot import Robot
from palpate.robots.robot_file import FingerEntry
from palpate.robots.surface_entries import EllipsoidEntry, SphereEntry
from palpate.surfaces import Ellipsoid, Sphere


def only_finger(robot: Robot) -> FingerEntry:
    """Return the finger of a robot with one, whose tip can be simulated.

    Raises:
        InvalidValueError: It has several, or a tip of another shape.
    """
    if len(robot.file.fingers) != 1:
        raise InvalidValueError(
            f"robot: it has {len(robot.file.fingers)} fingers, this takes one; for a hand there is palpate grasp"
        )
    finger = robot.file.fingers[0]
    if not isinstance(finger.surface, SphereEntry | EllipsoidEntry):
        kind = name_of_kind(finger.surface)
        raise InvalidValueError(
            f"fingers[0].surface.kind = {kind}: a simulated fingertip is a sphere or an ellipsoid"
        )
    return finger


def tip_sizes(robot: Robot) -> tuple[float, ...]:
    """Return the half lengths of a simulated robot's fingertip [m]: one of a sphere, three of an ellipsoid.

    Raises:
        InvalidValueError: As in `only_finger`.
    """
    surface = only_finger(robot).surface
    if isinstance(surface, SphereEntry):
        return (surface.radius,)
    assert isinstance(surface, EllipsoidEntry)  # only_finger has made sure of it
    return surface.semi_axes


def surface_of_tip(finger: FingerEntry, lengths: tuple[float, ...]) -> Sphere | Ellipsoid:
    """Return the fingertip of these half lengths [m], where the robot file puts it."""
    center, rotation = np.array(finger.surface.center), finger.surface.rotation
    if len(lengths) == 1:
        return Sphere(lengths[0], center=center, rotation=rotation)
    return Ellipsoid((lengths[0], lengths[1], lengths[2]), center=center, rotation=rotation)
