"""The back end of a robot file, narrowed to the type that its builder needs."""

from typing import TypeVar

from palpate.robots.robot import Robot

Entry = TypeVar("Entry")


def entry_of(robot: Robot, kind: type[Entry]) -> Entry:
    """Return a robot's back end, of the kind that its builder is for.

    Raises:
        TypeError: It is of another kind: whoever chose the builder is wrong.
    """
    entry: object = robot.file.backend
    if not isinstance(entry, kind):
        raise TypeError(f"a {type(entry).__name__} is no {kind.__name__}")
    return entry
