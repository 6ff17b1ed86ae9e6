"""The periods of a finished run: a share of a long one at once, or all of them piece by piece."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime import Record, RunResult
from palpate.runtime.log import Log, LogReader, MemoryLog
from palpate.runtime.log.chunk import PackedRows
from palpate.runtime.log.memory_log import MOST_PERIODS
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.record import record_of
from palpate.runtime.log.truth_columns import truth_of
from palpate.runtime.truth import TruthTable

BESIDE_A_LOG = 2**16
"""Periods that a run keeps in memory if it writes a log, a minute at 1 kHz: the others are read from there."""

AT_ONCE = 2**16
"""Periods of a piece: as many."""


@dataclass(frozen=True, slots=True, eq=False)
class Periods:
    """Some periods of a run.

    Attributes:
        codec: Says what is in a row.
        rows: One per period, shape (n, width).
    """

    codec: PeriodCodec
    rows: FloatArray

    def __len__(self) -> int:
        """How many there are."""
        return len(self.rows)

    @property
    def time(self) -> FloatArray:
        """Of each, shape (n,) [s]."""
        return self.rows[:, self.codec.columns["time"].start]

    def record(self, finger: int = 0) -> Record:
        """Return them in base coordinates, for one finger.

        Raises:
            InvalidValueError: There is no such finger.
        """
        return record_of(self.codec, self.rows, finger)

    @property
    def truth(self) -> TruthTable:
        """What really happened in each; a table without columns on a robot."""
        return truth_of(self.codec, self.rows)


@dataclass(slots=True, eq=False)
class RecordedPeriods:
    """Where the periods of a run are: in memory, and in its log, if it has one that is whole.

    Attributes:
        memory: What was kept of them.
        log: The file; None if there is none, or if it has lost any.
    """

    memory: MemoryLog
    log: Path | None
    _shown: Periods | None = field(default=None, init=False)
    _records: dict[int, Record] = field(default_factory=dict, init=False)

    @staticmethod
    def of(memory: MemoryLog, result: RunResult) -> "RecordedPeriods":
        """Return where they are after a run that went so."""
        kept = result.recording
        return RecordedPeriods(memory, None if kept is None or kept.problem is not None else kept.path)

    @staticmethod
    def of_log(log: Log) -> "RecordedPeriods":
        """Return the periods of a run that was read from its log, up to the first gap: stopping included."""
        whole = log.gaps[0].after + 1 if log.gaps else len(log)
        memory = MemoryLog()
        memory.start(log.heading)
        memory.rows(PackedRows(0, memoryview(log.rows[:whole].tobytes())))
        memory.changes.extend(log.changes)
        return RecordedPeriods(memory, None if log.gaps else log.path)

    @property
    def thinned(self) -> bool:
        """Whether `shown` is only a share of them."""
        return len(self.shown()) < self.memory.taken

    @property
    def all_known(self) -> bool:
        """Whether `pieces` are all periods, and not every second, fourth, ... one."""
        return self.memory.stride == 1 or self.log is not None

    def shown(self) -> Periods:
        """Return all of up to `MOST_PERIODS`, else a share of them, evenly over time: for figures."""
        if self._shown is None:
            self._shown = self._from_memory() if self.memory.stride == 1 or self.log is None else self._from_log()
        return self._shown

    def record(self, finger: int) -> Record:
        """Return `shown` in base coordinates, for one finger; worked out once.

        Raises:
            InvalidValueError: There is no such finger.
        """
        if finger not in self._records:
            self._records[finger] = self.shown().record(finger)
        return self._records[finger]

    def pieces(self) -> Iterator[Periods]:
        """Yield all periods, in pieces whose memory is bounded; one piece, `shown`, if that has all."""
        if self.log is None or not self.thinned:
            yield self.shown()
            return
        with LogReader(self.log) as reader:
            held: list[FloatArray] = []
            for piece in reader.pieces():
                if held and sum(map(len, held)) + len(piece.values) > AT_ONCE:
                    yield Periods(reader.codec, np.concatenate(held))
                    held = []
                held.append(piece.values)
            if held:
                yield Periods(reader.codec, np.concatenate(held))

    def _from_memory(self) -> Periods:
        return Periods(self.memory.codec, self.memory.kept_rows())

    def _from_log(self) -> Periods:
        assert self.log is not None
        stride = 1
        while self.memory.taken > MOST_PERIODS * stride:
            stride *= 2
        with LogReader(self.log) as reader:
            rows = [piece.values[-piece.sequence[0] % stride :: stride].copy() for piece in reader.pieces()]
            return Periods(reader.codec, np.concatenate(rows))
