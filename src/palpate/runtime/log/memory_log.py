"""A run kept in memory, which is bounded."""

from collections import deque
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

_BLOCK_ROWS = 200
"""Smaller blocks are joined: a recorder's at 1 kHz."""

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
        self._old: deque[_Block] = deque()  # not yet thinned; before the others
        self._thinned: list[_Block] = []
        self._new: list[_Block] = []
        self.taken = self._kept = 0

    def start(self, heading: Heading) -> None:
        """See `Sink`."""
        self.codec = PeriodCodec(heading, PERIOD_CHANNEL)

    def rows(self, rows: PackedRows) -> None:
        """See `Sink`."""
        block = _Block(rows.first, 1, self.codec.rows(rows.data))
        self.taken += len(block.rows)
        block = block.thinned(self.stride)
        self._kept += len(block.rows)
        _append(self._new, block)
        self._thin(_THINNED_AT_ONCE)
        if self._kept > self._most and not self._old:
            self.stride *= 2
            self._old = deque(self._thinned + self._new)
            self._thinned, self._new = [], []

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
        self._thin(len(self._old))
        blocks = self._thinned + self._new
        if len(blocks) > 1:  # they go as their rows are copied: there is no room for both
            whole, place = np.empty((self._kept, self.codec.width)), 0
            first = blocks[0].first
            self._thinned, self._new = [], []
            blocks.reverse()
            while blocks:
                rows = blocks.pop().rows
                whole[place : place + len(rows)] = rows
                place += len(rows)
            self._thinned = [_Block(first, self.stride, whole)]
        kept = self._thinned + self._new
        return kept[0].rows if kept else np.empty((0, self.codec.width))

    def _thin(self, count: int) -> None:
        for _ in range(min(count, len(self._old))):
            before = self._old.popleft()
            after = before.thinned(self.stride)
            self._kept -= len(before.rows) - len(after.rows)
            _append(self._thinned, after)


def _append(blocks: list[_Block], block: _Block) -> None:
    """Append a block, or join it to the last one where both are small."""
    if blocks and len(blocks[-1].rows) + len(block.rows) <= _BLOCK_ROWS:
        last = blocks[-1]
        blocks[-1] = _Block(last.first, last.stride, np.concatenate([last.rows, block.rows]))
    elif len(block.rows):
        blocks.append(block)
