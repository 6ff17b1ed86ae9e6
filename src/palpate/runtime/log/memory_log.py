"""A run kept in memory."""

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


class MemoryLog:
    """A sink that keeps everything, about 500 bytes per period and finger.

    Attributes:
        events: What happened.
        changes: Of live parameters.
    """

    def __init__(self) -> None:
        """Begin empty."""
        self.events: list[Event] = []
        self.changes: list[Change] = []
        self._codec = PeriodCodec(_NOTHING, PERIOD_CHANNEL)
        self._blocks: list[PackedRows] = []

    def start(self, heading: Heading) -> None:
        """See `Sink`."""
        self._codec = PeriodCodec(heading, PERIOD_CHANNEL)

    def rows(self, rows: PackedRows) -> None:
        """See `Sink`."""
        self._blocks.append(rows)

    def entry(self, entry: Entry) -> None:
        """See `Sink`."""
        if isinstance(entry.what, Event):
            self.events.append(entry.what)
        else:
            self.changes.append(entry.what)

    def close(self) -> RecordingSummary:
        """See `Sink`."""
        return RecordingSummary(
            rows_written=sum(len(block.data) for block in self._blocks) // self._codec.row_bytes
        )

    def record(self, finger: int = 0) -> Record:
        """Return what came so far; while a run goes on, call `Recorder.flush` before.

        Raises:
            InvalidValueError: There is no such finger.
        """
        return record_of(self._codec, self._all_rows(), finger)

    def truth(self) -> TruthTable:
        """Return what really happened in every period; a table without columns on a robot."""
        return truth_of(self._codec, self._all_rows())

    def _all_rows(self) -> FloatArray:
        blocks = [self._codec.rows(block.data) for block in self._blocks]
        return np.concatenate(blocks) if blocks else np.empty((0, self._codec.width))
