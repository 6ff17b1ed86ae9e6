"""What is noted besides the periods: rare, and never dropped lightly."""

from dataclasses import dataclass
from enum import IntEnum


class Level(IntEnum):
    """How grave an event is; the numbers are those of rcl_interfaces/msg/Log (ROS 2)."""

    DEBUG = 10
    INFO = 20
    WARN = 30
    ERROR = 40
    FATAL = 50


@dataclass(frozen=True, slots=True)
class Event:
    """Something that a person who reads the log wants to know: a trip, how the run ended, a note.

    Attributes:
        time: On the back end's clock [s].
        level: How grave it is.
        source: Who says so ("supervisor").
        text: What happened, for people.
    """

    time: float
    level: Level
    source: str
    text: str
