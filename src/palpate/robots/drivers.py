"""Whether this computer can drive a robot at all; checked before a run makes its folder."""

from palpate.hw.ur.support import is_supported, refuse_unsupported
from palpate.robots.backend_entries import EmulatedHandEntry, EmulatedUr5eEntry
from palpate.robots.rig_entries import RigEntry
from palpate.robots.robot import Robot


def check_drivers(robot: Robot) -> None:
    """Refuse a robot whose client library does not exist for this computer.

    Raises:
        MissingLibraryError: It has a UR arm, and this computer has no ur_rtde.
    """
    if _has_ur(robot):
        refuse_unsupported()


def can_drive(robot: Robot) -> bool:
    """Return whether this computer has the client libraries of a robot."""
    return is_supported() or not _has_ur(robot)


def _has_ur(robot: Robot) -> bool:
    backend = robot.file.backend
    if isinstance(backend, RigEntry):
        return backend.arm is not None
    return isinstance(backend, EmulatedUr5eEntry | EmulatedHandEntry)
