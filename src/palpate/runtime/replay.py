"""Replay: recorded samples through sensing, controller and supervisor again.

All three are pure but for their memory, so that the same parameters give the same commands bit for bit (on the
same machine and versions: other compilers and mathematics libraries round differently). With other parameters the
commands differ, the samples do not: a replay shows what would have been commanded *here*, not what would have
happened then.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Self

from palpate.errors import InvalidValueError, PalpateError, positive
from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.live import Change, ScheduledChanges, live_parameters_of
from palpate.runtime.loop import run
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.runtime.protocols import Controller
from palpate.runtime.supervision import Supervisor, Trip
from palpate.runtime.touch import Touch


class EndOfLogError(PalpateError, EOFError):
    """All recorded samples have been replayed."""


class ReplayBackend:
    """A back end that says again what was recorded, whatever it is told."""

    def __init__(self, samples: Sequence[Sample], period: float) -> None:
        """Take the samples and the control period [s] with which they were recorded.

        Raises:
            InvalidValueError: No samples.
        """
        if not samples:
            raise InvalidValueError("there are no samples to replay")
        self._samples = samples
        self._next = 0
        self.period = positive("period", period, "s")
        self.pacer: Pacer = SimulatedTime()

    def start(self) -> Sample:
        """Return the first sample."""
        self._next = 1
        return self._samples[0]

    def step(self, command: Command) -> Sample:
        """Return the next sample.

        Raises:
            EndOfLogError: There is none.
        """
        if self._next >= len(self._samples):
            raise EndOfLogError(f"all {len(self._samples)} samples were replayed")
        sample = self._samples[self._next]
        self._next += 1
        return sample

    def close(self) -> None:
        """Nothing moves."""

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Nothing moves."""


@dataclass(frozen=True, slots=True)
class Replay:
    """What a replay gave.

    Attributes:
        observations: Of every sample until the controller was done or stopped.
        commands: Likewise.
        trip: What the supervisor objected to, if it did.
    """

    observations: tuple[Observation, ...]
    commands: tuple[Command, ...]
    trip: Trip | None


def replay(
    samples: Sequence[Sample],
    period: float,
    touch: Touch,
    controller: Controller,
    supervisor: Supervisor | None = None,
    changes: Sequence[Change] = (),
) -> Replay:
    """Feed recorded samples through touch, controller and supervisor, by the very loop that runs robots.

    Args:
        samples: As recorded, until the controller was done.
        period: Control period with which they were recorded [s].
        touch: The fingers.
        controller: What commands.
        supervisor: Its limits; safe defaults if not given.
        changes: What its live parameters were asked for, as recorded.

    Raises:
        InvalidValueError: No samples, or a change that the controller's parameters cannot take.
    """
    observations: list[Observation] = []
    commands: list[Command] = []

    def collect(sample: Sample, now: Observation, command: Command) -> None:
        observations.append(now)
        commands.append(command)

    backend = ReplayBackend(samples, period)
    begin = samples[0].time
    asked = [Change(change.time - begin, change.name, change.value) for change in changes]
    result = run(
        backend,
        touch,
        controller,
        supervisor,
        duration=(len(samples) + 1) * period,
        live=ScheduledChanges(live_parameters_of(controller), asked),
        observers=(collect,),
    )
    trip = None if isinstance(result.error, EndOfLogError) else result.trip
    return Replay(tuple(observations), tuple(commands), trip)
