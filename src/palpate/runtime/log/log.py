"""A log as read: arrays for people, samples and commands for a replay."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.runtime.data import Command, Sample
from palpate.runtime.live import Change
from palpate.runtime.log.entries import Event
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.layout import Layout
from palpate.runtime.log.message_layout import Messages
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.record import Record, record_of
from palpate.runtime.log.row_reader import commands_of, samples_of
from palpate.runtime.log.truth_columns import truth_of
from palpate.runtime.truth import TruthTable


@dataclass(frozen=True, slots=True)
class Gap:
    """Periods that a log has not got.

    Attributes:
        after: Number of the last period before them, -1 if they are the first.
        count: How many.
    """

    after: int
    count: int


@dataclass(frozen=True, slots=True, eq=False)
class Log:
    """What was read from a log.

    Attributes:
        path: The file.
        codec: Of the run: heading, columns of the rows.
        attachments: Texts that were kept with the run, by name.
        sequence: Number of each period, rising, shape (n,).
        rows: One per period, shape (n, width), columns as in `codec.columns`.
        events: What happened, in order.
        changes: Requests for live parameters, in order.
        damage: Where something is damaged, and what, one line; None if nothing is.
        complete: Whether the writer came to its end, and every check sum is right.
    """

    path: Path
    codec: PeriodCodec
    attachments: Mapping[str, str]
    sequence: npt.NDArray[np.int64]
    rows: FloatArray
    events: tuple[Event, ...]
    changes: tuple[Change, ...]
    damage: str | None
    complete: bool

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.sequence)

    @property
    def heading(self) -> Heading:
        """Layout, clocks, codes."""
        return self.codec.heading

    @property
    def layout(self) -> Layout:
        """How much of everything there is."""
        return self.codec.heading.layout

    @property
    def gaps(self) -> tuple[Gap, ...]:
        """Periods that are missing before the last one: dropped by the writer, or damaged."""
        before = np.concatenate(([-1], self.sequence[:-1])) if len(self) else self.sequence
        missing = self.sequence - before - 1
        return tuple(Gap(int(before[i]), int(missing[i])) for i in np.flatnonzero(missing))

    @property
    def channels(self) -> Mapping[str, Messages]:
        """A structured array per topic, with nested fields as in the topic's schema."""
        return {
            "/period": self.codec.table(self.rows, self.sequence),
            "/event": _events(self.events),
            "/parameter": _changes(self.changes),
        }

    def record(self, finger: int = 0) -> Record:
        """Return the run in base coordinates, for one finger.

        Raises:
            InvalidValueError: There is no such finger.
        """
        return record_of(self.codec, self.rows, finger)

    @property
    def truth(self) -> TruthTable:
        """What really happened in every period; a table without columns on a robot."""
        return truth_of(self.codec, self.rows)

    def samples(self) -> Iterator[Sample]:
        """Yield what the devices reported, bit for bit; see `gaps` for what is missing."""
        return samples_of(self.codec, self.rows)

    def commands(self) -> Iterator[Command]:
        """Yield what was commanded, bit for bit."""
        return commands_of(self.codec, self.rows)


def _events(events: tuple[Event, ...]) -> Messages:
    rows = [(event.time, event.level, event.source, event.text) for event in events]
    return np.array(rows, [("time", "<f8"), ("level", "u1"), ("name", object), ("msg", object)])


def _changes(changes: tuple[Change, ...]) -> Messages:
    rows = [(change.time, change.value, change.name) for change in changes]
    return np.array(rows, [("time", "<f8"), ("value", "<f8"), ("name", object)])
