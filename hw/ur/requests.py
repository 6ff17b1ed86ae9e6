"""What the arm asks of the client process besides commands, and its reply."""

from dataclasses import dataclass
from enum import StrEnum

from palpate.hw.ur.version import Version


class UrTask(StrEnum):
    """Something that takes its time."""

    BRING_UP = "bring up"
    RECOVER = "recover"
    REST = "rest"
    TARE = "tare"
    PAYLOAD = "set payload"
    TOOL = "set tool"
    SLIDER = "set speed slider"
    FREE = "free"
    END_FREE = "end freedrive"
    LEAVE = "leave"


@dataclass(frozen=True, slots=True)
class Opening:
    """First message to the client process; plain numbers, so that it is up in a tenth of the time.

    Attributes:
        address: Of the controller.
        version: Of the controller.
        library: Name of the module that makes connections.
        memory: Descriptor of the shared memory.
        tool: Tip frame on the flange: position [m] and rotation vector [rad].
        payload: Mass [kg] and centre of gravity [m]; empty: as it is.
        speed_slider: Where to set it; None: as it is.
        acceleration: See `UrSettings`, here and below.
        deceleration: [m/s^2].
        watchdog: [s].
        stale_after: [s].
        lookahead: [s].
        gain: Of joint and pose servo.
    """

    address: str
    version: Version
    library: str
    memory: int
    tool: tuple[float, ...]
    payload: tuple[float, ...]
    speed_slider: float | None
    acceleration: float
    deceleration: float
    watchdog: float
    stale_after: float
    lookahead: float
    gain: float


@dataclass(frozen=True, slots=True)
class UrRequest:
    """A task, and its numbers.

    Attributes:
        task: What is to be done.
        number: Counts requests: a reply that nobody waited for, after Ctrl-C, is not taken for the next one's.
        values: What the task needs.
    """

    task: UrTask
    number: int = 0
    values: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class UrReply:
    """What became of it: nothing more if all is well.

    Attributes:
        number: Of the request.
        problem: What is wrong; empty if nothing is.
        remedy: What to do about it.
    """

    number: int
    problem: str = ""
    remedy: str = ""
