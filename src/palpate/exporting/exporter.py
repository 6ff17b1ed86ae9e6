"""Interface of exporters: logged runs go in one after the other, files come out."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from palpate.open_kinds import OpenKind
from palpate.runtime.log import LogReader
from palpate.runtime.log.chunk import LogRows

Fact = float | int | bool | str | None
"""A setting or result of a run; None if it is unknown."""

ROWS_AT_ONCE = 10_000
"""Least number of periods in a piece: a few megabytes, whatever the length of the log."""


@dataclass(frozen=True, slots=True, eq=False)
class Episode:
    """An open log of a run, whose periods can be taken once.

    Attributes:
        log: The log. Events, changes and damage are complete once all periods are taken.
        task: Command of the run without its seed: runs that differ in nothing else have the same task.
        settings: Value of every option, by name.
        results: Metrics by name; empty if only the log is known.
        pieces: Periods, as the log gives them.
    """

    log: LogReader
    task: str
    settings: Mapping[str, Fact]
    results: Mapping[str, Fact]
    pieces: Iterator[LogRows]

    def rows(self) -> Iterator[LogRows]:
        """Yield the periods, at least `ROWS_AT_ONCE` of them at a time but for the last."""
        held: list[LogRows] = []
        for piece in self.pieces:
            held.append(piece)
            if sum(len(each.sequence) for each in held) >= ROWS_AT_ONCE:
                yield _joined(held)
                held = []
        if held:
            yield _joined(held)


class Exporter(OpenKind):
    """Base of formats, which inherit from `palpate.open_kinds.Settings`, too, and are made without arguments.

    An entry point of the group `palpate.exporters` gives the format a word for `palpate log export --to`; without
    one the format is named as module:Class.
    """

    __slots__ = ()
    GROUP = "palpate.exporters"
    METHODS = ("write",)

    def write(self, episodes: Iterator[Episode], folder: Path) -> None:
        """Write one data set of all episodes.

        Args:
            episodes: One or more episodes. Take all periods of each before the next, which closes the log.
            folder: Empty folder. If this raises, nothing in the folder is kept.

        Raises:
            InvalidValueError: If the format cannot hold the episodes.
            MissingLibraryError: If a library of the format is not installed.
            OSError: If a file cannot be written.
        """
        raise NotImplementedError


def _joined(pieces: list[LogRows]) -> LogRows:
    return LogRows(
        np.concatenate([piece.sequence for piece in pieces]), np.concatenate([piece.values for piece in pieces])
    )
