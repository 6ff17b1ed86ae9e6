"""How a run went."""

from dataclasses import dataclass
from enum import StrEnum

from palpate.runtime.log import RecordingSummary
from palpate.runtime.supervision import Trip
from palpate.runtime.timing import RunTiming


class Ending(StrEnum):
    """How a run ended."""

    DONE = "done"
    """The controller finished."""
    LOST = "contact lost"
    """The controller lost contact and could not find it again."""
    TRIPPED = "stopped by the supervisor"
    """A limit was broken, a device lost, or an exception raised: see `RunResult.trip` and `error`."""
    INTERRUPTED = "interrupted"
    """Ctrl-C, or another signal that ends a process."""
    TIME_UP = "time is up"


@dataclass(frozen=True, slots=True, eq=False)
class RunResult:
    """How a run went.

    Attributes:
        ending: How it ended.
        trip: What the supervisor objected to, if it did.
        error: The exception behind the trip, if it was one.
        stopped: Whether the tip came to rest at the end.
        duration: On the back end's clock [s].
        wall_time: On the wall clock [s].
        timing: Of every period.
        recording: What became of the log; None if nothing was recorded.
    """

    ending: Ending
    trip: Trip | None
    error: Exception | None
    stopped: bool
    duration: float
    wall_time: float
    timing: RunTiming
    recording: RecordingSummary | None

    @property
    def real_time_factor(self) -> float:
        """Time on the back end's clock per wall time."""
        return self.duration / self.wall_time


class RunInterrupted(KeyboardInterrupt):
    """A run was ended by a signal; the robot was stopped and the log closed.

    Attributes:
        result: How it went until then.
    """

    def __init__(self, result: RunResult) -> None:
        """Take what there is."""
        super().__init__("interrupted; the robot was stopped")
        self.result = result
