"""A run kept in memory, which is bounded."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.live import Change
from palpate.runtime.log.chunk import PERIOD_CHANNEL, PackedRows
from palpate.runtime.log.entries import Event
from palpate.runtime.log.entry_codec import Entry
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.layout import Layout
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.record import Record, record_of
from palpate.runtime.log.sink import RecordingSummary
from palpate.runtime.log.truth_columns import truth_of
from palpate.runtime.truth import TruthTable

_NOTHING = Heading(Layout(0, None, (6,), 2), 1.0, 0.0, 0, "")
"""What a log that was never started looks like."""


MOST_PERIODS = 2**18
"""Periods that are kept, four minutes at 1 kHz; of longer runs every second, fourth, ... one."""

_THINNED_AT_ONCE = 4
"""Blocks that are thinned whenever one comes: 50 us each for 200 periods, not all of them in one."""


@dataclass(frozen=True, slots=True, eq=False)
class _Block:
    """Some periods, from number `first` on, each `stride` after the one before; rows of shape (n, width)."""

    first: int
    stride: int
    rows: FloatArray

    def thinned(self, stride: int) -> "_Block":
        """Return the periods whose number is a multiple of `stride`."""
        if stride == self.stride:
            return self
        skipped = -self.first % stride // self.stride
        return _Block(
            self.first + skipped * self.stride, stride, self.rows[skipped :: stride // self.stride].copy()
        )


class MemoryLog:
    """A sink that keeps a run, whole up to a number of periods; of a longer one a share, evenly over time.

    It takes about 500 bytes per period and finger.

    Attributes:
        events: What happened.
        changes: Of live parameters.
        codec: Says what is in a row.
        taken: How many periods came.
        stride: 1 if every period is there; else only those whose number is a multiple of it.
    """

    def __init__(self, most: int = MOST_PERIODS) -> None:
        """Begin empty; keep not many more than so many periods."""
        self._most = most
        self.events: list[Event] = []
        self.changes: list[Change] = []
        self.stride = 1
        self.codec = PeriodCodec(_NOTHING, PERIOD_CHANNEL)
        self._blocks: list[_Block] = []
        self._thin = 0  # so many of them have the stride
        self.taken = self._kept = 0

    def start(self, heading: Heading) -> None:
        """See `Sink`."""
        self.codec = PeriodCodec(heading, PERIOD_CHANNEL)

    def rows(self, rows: PackedRows) -> None:
        """See `Sink`."""
        block = _Block(rows.first, 1, self.codec.rows(rows.data))
        self.taken += len(block.rows)
        self._blocks.append(block)
        self._kept += len(block.rows)
        self._thin_next(_THINNED_AT_ONCE)
        if self._kept > self._most and self._thin == len(self._blocks):
            self.stride, self._thin = 2 * self.stride, 0

    def entry(self, entry: Entry) -> None:
        """See `Sink`."""
        if isinstance(entry.what, Event):
            self.events.append(entry.what)
        else:
            self.changes.append(entry.what)

    def close(self) -> RecordingSummary:
        """See `Sink`."""
        return RecordingSummary(rows_written=self.taken)

    def record(self, finger: int = 0) -> Record:
        """Return what came so far; while a run goes on, call `Recorder.flush` before.

        Raises:
            InvalidValueError: There is no such finger.
        """
        return record_of(self.codec, self.kept_rows(), finger)

    def truth(self) -> TruthTable:
        """Return what really happened in every period kept; a table without columns on a robot."""
        return truth_of(self.codec, self.kept_rows())

    def kept_rows(self) -> FloatArray:
        """Return the rows of the periods kept, shape (n, width), columns as in `codec`."""
        self._thin_next(len(self._blocks))
        if not self._blocks:
            return np.empty((0, self.codec.width))
        if len(self._blocks) > 1:  # they go as their rows are copied: there is no room for both
            whole, place = _Block(self._blocks[0].first, self.stride, np.empty((self._kept, self.codec.width))), 0
            self._blocks.reverse()
            while self._blocks:
                rows = self._blocks.pop().rows
                whole.rows[place : place + len(rows)] = rows
                place += len(rows)
            self._blocks, self._thin = [whole], 1
        return self._blocks[0].rows

    def _thin_next(self, count: int) -> None:
        for index in range(self._thin, min(self._thin + count, len(self._blocks))):
            before = self._blocks[index]
            self._blocks[index] = after = before.thinned(self.stride)
            self._kept -= len(before.rows) - len(after.rows)
            self._thin += 1
