"""Periods of a finished run: records, simulated truth and time series, of all periods or of a bounded share."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.data import TimeSeries
from palpate.runtime import Record, RunResult
from palpate.runtime.log import Log, LogReader, MemoryLog
from palpate.runtime.log.chunk import PackedRows
from palpate.runtime.log.memory_log import MOST_PERIODS
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.record import record_of
from palpate.runtime.log.truth_columns import truth_of
from palpate.runtime.truth import TruthTable
from palpate.sim.contact_truth import FORCE, HELD_POSITION, OBJECT_POSITION, POSITION, TORQUE, TOUCHING

BESIDE_A_LOG = 2**16
"""Number of periods kept in memory beside a log, a minute at 1 kHz; the others are read from the log."""

_AT_ONCE = 2**16
"""Largest number of periods in a piece."""


@dataclass(frozen=True, slots=True, eq=False)
class Periods:
    """Some periods of a run.

    Attributes:
        codec: Layout of a row.
        rows: Rows, one per period, shape (n, width).
    """

    codec: PeriodCodec
    rows: FloatArray

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.rows)

    @property
    def time(self) -> FloatArray:
        """Time of each period, shape (n,) [s]."""
        return self.rows[:, self.codec.columns["time"].start]

    def record(self, finger: int = 0) -> Record:
        """Return the record of one finger in base coordinates.

        Raises:
            InvalidValueError: If there is no such finger.
        """
        return record_of(self.codec, self.rows, finger)

    @property
    def truth(self) -> TruthTable:
        """Simulated truth of each period; a table without columns on a robot."""
        return truth_of(self.codec, self.rows)


@dataclass(slots=True, eq=False)
class RecordedPeriods:
    """Periods of a run: those in memory, and all of them in a log without gaps.

    Attributes:
        memory: Periods kept in memory.
        log: Log file; None if there is none, or if the log has gaps.
    """

    memory: MemoryLog
    log: Path | None
    _shown: Periods | None = field(default=None, init=False)
    _records: dict[int, Record] = field(default_factory=dict, init=False)

    @staticmethod
    def of(memory: MemoryLog, result: RunResult) -> "RecordedPeriods":
        """Return the periods of a run that has just ended."""
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
        """Whether `shown` is only a share of the periods."""
        return len(self.shown()) < self.memory.taken

    @property
    def all_known(self) -> bool:
        """Whether `pieces` yields all periods, not every second, fourth, ... one."""
        return self.memory.stride == 1 or self.log is not None

    def shown(self) -> Periods:
        """Return the periods for figures: all of up to `MOST_PERIODS`, else a share, evenly over time."""
        if self._shown is None:
            self._shown = self._from_memory() if self.memory.stride == 1 or self.log is None else self._from_log()
        return self._shown

    def record(self, finger: int) -> Record:
        """Return the record of `shown` for one finger in base coordinates; computed once.

        Raises:
            InvalidValueError: If there is no such finger.
        """
        if finger not in self._records:
            self._records[finger] = self.shown().record(finger)
        return self._records[finger]

    def pieces(self) -> Iterator[Periods]:
        """Yield all periods in pieces of bounded size; the single piece `shown` if that has all."""
        if self.log is None or not self.thinned:
            yield self.shown()
            return
        with LogReader(self.log) as reader:
            held: list[FloatArray] = []
            for piece in reader.pieces():
                if held and sum(map(len, held)) + len(piece.values) > _AT_ONCE:
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


@dataclass(frozen=True, slots=True, eq=False)
class ContactTruth:
    """True contact of a single fingertip in a simulation, one row per period, base frame; forces act on the tip.

    On a robot it is unknown: not touching, and NaN.

    Attributes:
        touching: Whether the tip touches, shape (n,).
        position: Contact point, shape (n, 3) [m].
        force: Contact force, shape (n, 3) [N].
        torque: Contact torque about `position`, shape (n, 3) [N m].
        object_position: Position of the object's frame, shape (n, 3) [m].
        held_position: Position of the held tool's end, or of the held object, relative to the fingers,
            shape (n, 3) [m].
        known: Whether the truth is known.
    """

    touching: np.ndarray[tuple[int], np.dtype[np.bool_]]
    position: FloatArray
    force: FloatArray
    torque: FloatArray
    object_position: FloatArray
    held_position: FloatArray
    known: bool = True

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.touching)

    @classmethod
    def of(cls, truth: TruthTable, count: int) -> Self:
        """Return the contact of a truth; on a robot, `count` periods of an unknown one."""
        if not truth.known:
            unknown = np.full((count, 3), np.nan)
            return cls(np.zeros(count, np.bool_), unknown, unknown, unknown, unknown, unknown, known=False)
        touching = truth.column(TOUCHING)[:, 0] > 0.0
        position, force, torque, moved = (
            truth.column(*each) for each in (POSITION, FORCE, TORQUE, OBJECT_POSITION)
        )
        held = truth.column(*HELD_POSITION) if set(HELD_POSITION) <= set(truth.columns) else moved
        return cls(touching, position, force, torque, moved, held)


def recorded_series(
    record: Record,
    set_force: FloatArray,
    measured_force: FloatArray | None = None,
    true_force: FloatArray | None = None,
    true_spin_torque: FloatArray | None = None,
) -> TimeSeries:
    """Return forces and speed of a record over time; `measured_force` defaults to the normal force."""
    felt = record.normal_force if measured_force is None else measured_force
    return TimeSeries(
        time=record.time,
        phase=[str(phase) for phase in record.phase],
        measured_force=np.where(record.touching, felt, np.nan),
        set_force=set_force,
        spin_torque=np.where(record.touching, record.spin_torque, np.nan),
        speed=np.linalg.norm(record.velocity, axis=1),
        true_force=true_force,
        true_spin_torque=true_spin_torque,
    )
