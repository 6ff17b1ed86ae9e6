"""Replay: recorded samples through sensing, controller and supervisor again.

All three are pure but for their memory, so that the same parameters give the same commands bit for bit (on the same
machine and versions: other compilers and mathematics libraries round differently). With other parameters the
commands differ, the samples do not: a replay shows what would have been commanded *here*, not what would have
happened then.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Protocol, Self

from palpate.errors import InvalidValueError, PalpateError, positive
from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.live import Change
from palpate.runtime.loop import Live, run
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


class LiveRequests(Protocol):
    """Live parameters as a replay sets them."""

    def request(self, name: str, value: float) -> None:
        """Ask for a value."""
        ...

    def step(self, time: float) -> Sequence[Change]:
        """Move on to a period [s]."""
        ...


class RecordedChanges:
    """Live parameters that are asked again for what they were asked, at the same periods."""

    def __init__(self, live: LiveRequests, changes: Sequence[Change]) -> None:
        """Take the parameters and the recorded changes, in order."""
        self._live = live
        self._left = deque(changes)

    def step(self, time: float) -> Sequence[Change]:
        """See `palpate.runtime.loop.Live`."""
        while self._left and self._left[0].time <= time:
            change = self._left.popleft()
            self._live.request(change.name, change.value)
        return self._live.step(time)


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
    live: Live | None = None,
) -> Replay:
    """Feed recorded samples through touch, controller and supervisor, by the very loop that runs robots.

    Args:
        samples: As recorded, until the controller was done.
        period: Control period with which they were recorded [s].
        touch: The fingers.
        controller: What commands.
        supervisor: Its limits; safe defaults if not given.
        live: Its live parameters, with what was asked of them.
    """
    observations: list[Observation] = []
    commands: list[Command] = []

    def collect(sample: Sample, now: Observation, command: Command) -> None:
        observations.append(now)
        commands.append(command)

    backend = ReplayBackend(samples, period)
    result = run(
        backend,
        touch,
        controller,
        supervisor,
        duration=(len(samples) + 1) * period,
        live=live,
        observers=(collect,),
    )
    trip = None if isinstance(result.error, EndOfLogError) else result.trip
    return Replay(tuple(observations), tuple(commands), trip)
