"""The seam of exporters: logged runs go in one after the other, files come out."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.open_kinds import OpenKind
from palpate.runtime.log import LogReader
from palpate.runtime.log.chunk import LogRows

Fact = float | int | bool | str | None
"""Of a run: None where there is none, or nobody knows it."""

ROWS_AT_ONCE = 10_000
"""Periods in a piece: a few megabytes, whatever the length of the log."""


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """A logged run, open: its periods can be taken once.

    Attributes:
        log: It. Its events, changes and damage are complete once all periods are taken.
        task: What was done, as typed, but for the seed: the same for runs that differ in nothing else.
        settings: Every option, by name.
        results: What came out, by name; empty where only the log is known.
        pieces: Its periods, as the log gives them.
    """

    log: LogReader
    task: str
    settings: Mapping[str, Fact]
    results: Mapping[str, Fact]
    pieces: Iterator[LogRows]

    def rows(self) -> Iterator[LogRows]:
        """Yield its periods, at least `ROWS_AT_ONCE` of them at a time but for the last."""
        held: list[LogRows] = []
        for piece in self.pieces:
            held.append(piece)
            if sum(len(each.sequence) for each in held) >= ROWS_AT_ONCE:
                yield _joined(held)
                held = []
        if held:
            yield _joined(held)


class Exporter(OpenKind):
    """A format: a class that inherits from this and from `palpate.open_kinds.Settings`, made without arguments.

    An entry point of the group `palpate.exporters` gives it a word for `palpate log export --to`; without one it
    is named as module:Class.
    """

    __slots__ = ()
    GROUP = "palpate.exporters"
    METHODS = ("write",)

    def write(self, episodes: Iterator[Episode], folder: Path) -> None:
        """Write one data set of all episodes.

        Args:
            episodes: One or more. Take all periods of each before the next: its log is closed then.
            folder: An empty one. If this raises, nothing of it is kept.

        Raises:
            InvalidValueError: The format cannot hold them.
            MissingLibraryError: A library that it takes is not installed.
            OSError: A file cannot be written.
        """
        raise NotImplementedError


def _joined(pieces: list[LogRows]) -> LogRows:
    return LogRows(
        np.concatenate([piece.sequence for piece in pieces]), np.concatenate([piece.values for piece in pieces])
    )
