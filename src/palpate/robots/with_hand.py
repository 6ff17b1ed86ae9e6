"""Which of the robots that come with palpate have a hand."""

from palpate.runtime.robot import Robot, load_robot, shipped_robots
from palpate.runtime.robot_backend import EmulatedHandEntry
from palpate.runtime.robot_rig import RigEntry


def has_hand(robot: Robot) -> bool:
    """Return whether it has fingers that close on an object."""
    backend = robot.file.backend
    if isinstance(backend, RigEntry):
        return backend.hand is not None and len(robot.file.fingers) > 1
    return isinstance(backend, EmulatedHandEntry)


def robots_with_hand() -> str:
    """Return the names of those that come with palpate, as a list in a sentence."""
    return ", ".join(name for name in shipped_robots() if has_hand(load_robot(name)))
