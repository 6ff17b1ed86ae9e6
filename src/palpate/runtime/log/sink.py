"""Where a recording goes: memory, a file."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from palpate.runtime.log.chunk import PackedRows
from palpate.runtime.log.entry_codec import Entry
from palpate.runtime.log.heading import Heading


@dataclass(frozen=True, slots=True)
class RecordingSummary:
    """What became of a recording.

    Attributes:
        path: The file; None for one in memory.
        rows_written: Periods that were kept.
        rows_lost: Periods that were not.
        problem: What went wrong, one line for people; None if all is well.
        note: What else there is to say; empty if nothing.
    """

    path: Path | None = None
    rows_written: int = 0
    rows_lost: int = 0
    problem: str | None = None
    note: str = ""

    def __str__(self) -> str:
        """One line for a person: what was kept and where, and what went wrong."""
        place = "" if self.path is None else f"{self.path}, "
        lost = f", {self.rows_lost} lost" if self.rows_lost else ""
        parts = (f"{place}{self.rows_written} periods{lost}", self.problem, self.note)
        return "; ".join(text for text in parts if text)

    @staticmethod
    def joined(summaries: Sequence["RecordingSummary"]) -> "RecordingSummary":
        """Return the summary of a recording with several sinks: their first path, their worst metrics."""
        problems = [summary.problem for summary in summaries if summary.problem is not None]
        return RecordingSummary(
            path=next((summary.path for summary in summaries if summary.path is not None), None),
            rows_written=min((summary.rows_written for summary in summaries), default=0),
            rows_lost=max((summary.rows_lost for summary in summaries), default=0),
            problem="; ".join(problems) or None,
            note="; ".join(summary.note for summary in summaries if summary.note),
        )


class Sink(Protocol):
    """Takes a recording. Called from the loop's thread; only `start` and `close` may take time."""

    def start(self, heading: Heading) -> None:
        """Prepare, before the first period.

        Raises:
            InvalidValueError: It cannot.
            OSError: It cannot.
        """
        ...

    def rows(self, rows: PackedRows) -> None:
        """Take periods, which nobody changes any more; never waits, never raises."""
        ...

    def entry(self, entry: Entry) -> None:
        """Take an event or a change, after the rows before it; never waits, never raises."""
        ...

    def close(self) -> RecordingSummary:
        """Finish; never raises, may be called twice."""
        ...
