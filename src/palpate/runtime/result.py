"""How a run went."""

from dataclasses import dataclass
from enum import StrEnum

from palpate.errors import PalpateError
from palpate.runtime.log import RecordingSummary
from palpate.runtime.rest import RestState, RobotRest
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
        rest: Whether the tip was at rest at the end, measured or not known.
        duration: On the back end's clock [s].
        wall_time: On the wall clock [s].
        timing: Of every period.
        recording: What became of the log; None if nothing was recorded.
    """

    ending: Ending
    trip: Trip | None
    error: Exception | None
    rest: RobotRest
    duration: float
    wall_time: float
    timing: RunTiming
    recording: RecordingSummary | None

    def __str__(self) -> str:
        """One line for a person."""
        why = f" ({self.why})" if self.trip is not None else ""
        lost = f"; {self.lost_records}" if self.lost_records else ""
        return f"{self.ending.value}{why} after {self.duration:.1f} s; {self.rest}{lost}"

    @property
    def lost_records(self) -> str:
        """What the recording has lost and why, as a clause of a sentence; empty if nothing."""
        if self.recording is None or self.recording.problem is None:
            return ""
        return f"THE LOG IS NOT WHOLE ({self.recording.rows_lost} periods lost): {self.recording.problem}"

    @property
    def at_rest(self) -> bool:
        """Whether it was measured to be at rest."""
        return self.rest.state is RestState.AT_REST

    @property
    def done(self) -> bool:
        """Whether the controller finished, the robot was measured to be at rest after it, and the log is whole."""
        return self.ending is Ending.DONE and self.at_rest and not self.lost_records

    @property
    def why(self) -> str:
        """What the supervisor objected to, and what came of its reaction, for a person; empty if nothing was.

        An exception that says itself what is wrong and what to do stands for itself.
        """
        if self.trip is None:
            return ""
        if self.error is not None and speaks_for_itself(self.error):
            return f"at t = {self.trip.time:.3f} s, {' '.join(str(self.error).split())}"
        return f"{self.trip}; {self.trip.aftermath}" if self.trip.aftermath else str(self.trip)

    @property
    def real_time_factor(self) -> float:
        """Time on the back end's clock per wall time."""
        return self.duration / self.wall_time


def speaks_for_itself(error: Exception) -> bool:
    """Return whether an exception was raised on purpose, with words for people: palpate's own, or a device's.

    (A device's is an OSError that somebody wrote; one of the system has a number.)
    """
    return isinstance(error, PalpateError) or (isinstance(error, OSError) and bool(str(error)) and not error.errno)


def result_until(interruption: KeyboardInterrupt) -> RunResult | None:
    """Return how a run went until it was interrupted: the robot was stopped and the log closed.

    None if it was not the loop that was interrupted, or only at the second request. (`run` raises
    KeyboardInterrupt itself and no class of its own: only then does Python end the process as a shell expects it
    of Ctrl-C.)
    """
    found = interruption.args[0] if interruption.args else None
    return found if isinstance(found, RunResult) else None
