"""Replay: recorded samples through sensing, controller and supervisor again.

All three are pure but for their memory, so that the same parameters give the same commands bit for bit (on the
same machine and versions: other compilers and mathematics libraries round differently). With other parameters the
commands differ, the samples do not: a replay shows what would have been commanded *here*, not what would have
happened then.
"""

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Self

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, PalpateError, positive
from palpate.runtime.data import Command, Sample
from palpate.runtime.following import AnyMotion
from palpate.runtime.live import Change, LiveParameters, live_parameters_of
from palpate.runtime.log import Heading, Record, Recorder, RecordingSummary
from palpate.runtime.log.chunk import PERIOD_CHANNEL, PackedRows
from palpate.runtime.log.entry_codec import Entry
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.record import record_of
from palpate.runtime.log.row_reader import commands_of
from palpate.runtime.loop import Observer, run
from palpate.runtime.pacing import Pacer, SimulatedTime
from palpate.runtime.protocols import Controller
from palpate.runtime.result import RunResult
from palpate.runtime.supervision import Supervisor, Trip
from palpate.runtime.touch import Touch
from palpate.runtime.truth import TruthTable

_ENDLESS = 2**40
"""Periods, 35 years at 1 kHz: the samples end first."""


class EndOfLogError(PalpateError, EOFError):
    """All recorded samples have been replayed."""


class ReplayBackend:
    """A back end that repeats a recording, whatever is commanded."""

    def __init__(self, samples: Iterable[Sample], period: float) -> None:
        """Take the samples and the control period [s] with which they were recorded.

        Raises:
            InvalidValueError: No samples.
        """
        self._samples = iter(samples)
        first = next(self._samples, None)
        if first is None:
            raise InvalidValueError("there are no samples to replay")
        self._first = first
        self.period = positive("period", period, "s")
        self.pacer: Pacer = SimulatedTime()

    def start(self) -> Sample:
        """Return the first sample."""
        return self._first

    def step(self, command: Command) -> Sample:
        """Return the next sample.

        Raises:
            EndOfLogError: There is none.
        """
        sample = next(self._samples, None)
        if sample is None:
            raise EndOfLogError("all samples were replayed")
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


class ReplayWithTruth(ReplayBackend):
    """A replay that says again what really happened, too. A `TruthSource`."""

    def __init__(self, samples: Iterable[Sample], period: float, truth: TruthTable) -> None:
        """Take samples, control period [s], and the truth that belongs to each sample."""
        super().__init__(samples, period)
        self.truth_columns = truth.columns
        self._rows, self._index = truth.rows.tolist(), 0

    def step(self, command: Command) -> Sample:
        """See `ReplayBackend.step`."""
        sample = super().step(command)
        self._index += 1
        return sample

    def truth_row(self) -> Sequence[float]:
        """See `TruthSource`."""
        row: list[float] = self._rows[self._index]
        return row


class RecordedChanges:
    """Live parameters that are asked again for what they were asked, in the same periods."""

    def __init__(self, live: LiveParameters, changes: Iterable[Change]) -> None:
        """Take the parameters and the recorded changes, in order.

        Raises:
            InvalidValueError: A change that the parameters cannot take.
        """
        self._live = live
        self._left = deque(changes)
        for change in self._left:
            try:
                live.check(change.name, change.value)
            except InvalidValueError as error:
                raise InvalidValueError(f"change recorded at t = {change.time:.3f} s: {error}") from None

    def step(self, time: float) -> Sequence[Change]:
        """See `palpate.runtime.loop.Live`."""
        while self._left and self._left[0].time <= time:
            change = self._left.popleft()
            self._live.request(change.name, change.value)
        return self._live.step(time)


def replayed_backend(samples: Iterable[Sample], period: float, truth: TruthTable | None) -> ReplayBackend:
    """Return what says again what was sampled [s], and what really happened if that is known."""
    if truth is None or not truth.known:
        return ReplayBackend(samples, period)
    return ReplayWithTruth(samples, period, truth)


@dataclass(frozen=True, slots=True, eq=False)
class Replay:
    """What a replay gave.

    Attributes:
        codec: Says what is in a row.
        rows: One per period as a log keeps them, coming to rest included, shape (n, width).
        result: How it ended. A replay of all samples ends with an `EndOfLogError`.
    """

    codec: PeriodCodec
    rows: FloatArray
    result: RunResult

    @property
    def commands(self) -> tuple[Command, ...]:
        """Of every period."""
        return tuple(commands_of(self.codec, self.rows))

    @property
    def trip(self) -> Trip | None:
        """What the supervisor objected to, if it did."""
        return None if self.reached_end else self.result.trip

    @property
    def reached_end(self) -> bool:
        """Whether there were no more samples, before there was another reason to end."""
        return isinstance(self.result.error, EndOfLogError)

    def record(self, finger: int = 0) -> Record:
        """Return it in base coordinates, for one finger.

        Raises:
            InvalidValueError: There is no such finger.
        """
        return record_of(self.codec, self.rows, finger)


def replay(
    samples: Iterable[Sample],
    period: float,
    touch: Touch,
    controller: Controller,
    supervisor: Supervisor | None = None,
    changes: Iterable[Change] = (),
    observers: Sequence[Observer] = (),
    truth: TruthTable | None = None,
) -> Replay:
    """Feed recorded samples through touch, controller and supervisor, by the very loop that runs robots.

    Args:
        samples: As recorded.
        period: Control period with which they were recorded [s].
        touch: The fingers.
        controller: What commands.
        supervisor: Its limits; safe defaults if not given.
        changes: What its live parameters were asked for, as recorded.
        observers: Called every period, for example to show progress.
        truth: What really happened at each sample, if it is known.

    Raises:
        InvalidValueError: No samples, or a change that the controller's parameters cannot take.
        LatchedError: The supervisor has tripped earlier and was not reset.
        KeyboardInterrupt: By Ctrl-C.
        Exception: What touch or controller raise at the first sample.
    """
    kept = _KeptRows()
    try:
        result = run(
            replayed_backend(samples, period, truth),
            touch,
            controller,
            supervisor,
            duration=_ENDLESS * period,
            recorder=Recorder(kept),
            live=RecordedChanges(live_parameters_of(controller), changes),
            observers=observers,
            following=AnyMotion,
        )
    except KeyboardInterrupt:
        raise KeyboardInterrupt from None  # which speaks of no robot: none moved
    assert kept.codec is not None  # the run began
    return Replay(kept.codec, kept.all(), result)


class _KeptRows:
    """A sink that keeps the rows up to the first one that was dropped."""

    def __init__(self) -> None:
        self.codec: PeriodCodec | None = None
        self._blocks: list[PackedRows] = []
        self._count = 0

    def start(self, heading: Heading) -> None:
        """See `palpate.runtime.log.Sink`."""
        self.codec = PeriodCodec(heading, PERIOD_CHANNEL)

    def rows(self, rows: PackedRows) -> None:
        """See `palpate.runtime.log.Sink`."""
        if self.codec is not None and rows.first == self._count:
            self._blocks.append(rows)
            self._count += len(rows.data) // self.codec.row_bytes

    def entry(self, entry: Entry) -> None:
        """Not kept."""

    def close(self) -> RecordingSummary:
        """See `palpate.runtime.log.Sink`."""
        return RecordingSummary(rows_written=self._count)

    def all(self) -> FloatArray:
        """All rows, shape (n, width)."""
        assert self.codec is not None
        blocks = [self.codec.rows(block.data) for block in self._blocks]
        return np.concatenate(blocks) if blocks else np.empty((0, self.codec.width))
