"""Whether this computer can drive a robot at all: said before a run makes its folder."""

from palpate.hw.ur.support import is_supported, refuse_unsupported
from palpate.robots.values import load_named_robot
from palpate.runtime.robot import Robot
from palpate.runtime.robot_backend import EmulatedHandEntry, EmulatedUr5eEntry
from palpate.runtime.robot_rig import RigEntry


def check_drivers(name: str | None) -> None:
    """Refuse a robot whose client library does not exist for this computer.

    Args:
        name: Of a shipped robot, or the path of a robot file; None: a simulation.

    Raises:
        InvalidValueError: There is no such robot.
        MissingLibraryError: It has a UR arm, and this computer has no ur_rtde.
    """
    if name is not None and _has_ur(load_named_robot(name)):
        refuse_unsupported()


def can_drive(robot: Robot) -> bool:
    """Return whether this computer has the client libraries of a robot."""
    return is_supported() or not _has_ur(robot)


def _has_ur(robot: Robot) -> bool:
    backend = robot.file.backend
    if isinstance(backend, RigEntry):
        return backend.arm is not None
    return isinstance(backend, EmulatedUr5eEntry | EmulatedHandEntry)
