"""Phases of a run as a pale ground behind a plot over time."""

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.data import TimeSeries
from palpate.reporting.marks import Span
from palpate.runtime import palette
from palpate.runtime.data import Phase

GROUNDS: Mapping[str, palette.Colour] = {
    Phase.APPROACH: palette.APPROACH,
    Phase.SETTLE: palette.SETTLE,
    Phase.SCAN: palette.SCAN,
    Phase.SEEK: palette.SEEK,
    Phase.LIFT: palette.LIFT,
    Phase.TRAVEL: palette.TRAVEL,
    Phase.HOLD: palette.HOLD,
    Phase.STOP: palette.STOP,
    Phase.DONE: palette.DONE,
    Phase.LOST: palette.LOST,
}
"""Of the phases; others take `palette.OTHER`."""


class Phased(Protocol):
    """What has a phase at every time: a series, or the record of a run."""

    @property
    def time(self) -> FloatArray:
        """Increasing, shape (k,) [s]."""
        ...

    @property
    def phase(self) -> Any:
        """Name of the controller's phase at each, a sequence of length k."""
        ...


def stretches(series: Phased) -> list[tuple[str, float, float]]:
    """Return each phase in turn with the times [s] at which it begins and ends."""
    if not len(series.phase):
        return []
    names = np.array([str(name) for name in series.phase], dtype=np.str_)
    begins = np.concatenate([[0], np.flatnonzero(names[1:] != names[:-1]) + 1, [len(names)]])
    last = len(names) - 1
    return [(str(names[i]), float(series.time[i]), float(series.time[min(j, last)])) for i, j in pairwise(begins)]


def phase_spans(
    series: Phased,
    after: float = -math.inf,
    before: float = math.inf,
    grounds: Mapping[str, palette.Colour] = GROUNDS,
) -> tuple[Span, ...]:
    """Return the phases as grounds, as far as they last between two times [s]; each is named once.

    Args:
        series: What has phases.
        after: From when on [s].
        before: Until when [s].
        grounds: Colour of each phase.
    """
    spans: list[Span] = []
    named = set()
    for name, began, ended in stretches(series):
        begin, end = max(began, after), min(ended, before)
        if begin < end:
            spans.append(Span(begin, end, "" if name in named else name, grounds.get(name, palette.OTHER)))
            named.add(name)
    return tuple(spans)


def scan_window(series: TimeSeries) -> tuple[float, float] | None:
    """Return when the first scan begins and the last one ends [s], or None if nothing was scanned."""
    scans = [(begin, end) for name, begin, end in stretches(series) if name == Phase.SCAN]
    return (scans[0][0], scans[-1][1]) if scans and scans[-1][1] > scans[0][0] else None


def within(series: TimeSeries, values: FloatArray) -> FloatArray:
    """Return the finite `values` (k,) of scanning periods."""
    scanning = np.array([name == Phase.SCAN for name in series.phase], dtype=np.bool_)
    chosen = values[scanning]
    return np.asarray(chosen[np.isfinite(chosen)], dtype=np.float64)
