"""Figures of every run: forces over time with the phases behind them, and computing times."""

import math
from collections.abc import Iterator, Mapping
from itertools import pairwise
from typing import Any, Protocol

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.data import TimeSeries
from palpate.reporting.figure import TIME, Axis, Figure, Panel
from palpate.reporting.marks import Bars, Dash, Line, Rule, Span, unnamed
from palpate.reporting.report import Figures, Section, TextTable
from palpate.runtime import Distribution, RunTiming, palette
from palpate.runtime.data import Phase

_MARGIN = 0.08
"""Space above and below the forces, relative to their range."""

_BINS_PER_DECADE = 25

_MILLI, _MICRO = 1e3, 1e6

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
"""Colour behind each phase; `palette.OTHER` behind others."""


class Phased(Protocol):
    """A series or a record with the controller's phase at every time."""

    @property
    def time(self) -> FloatArray:
        """Increasing, shape (k,) [s]."""
        ...

    @property
    def phase(self) -> Any:
        """Name of the phase at each time, a sequence of length k."""
        ...


def stretches(series: Phased) -> list[tuple[str, float, float]]:
    """Return the phases in order, each with the times [s] of its beginning and end."""
    names = np.array([str(name) for name in series.phase], dtype=np.str_)
    if not len(names):
        return []
    begins = np.concatenate([[0], np.flatnonzero(names[1:] != names[:-1]) + 1, [len(names)]])
    last = len(names) - 1
    return [(str(names[i]), float(series.time[i]), float(series.time[min(j, last)])) for i, j in pairwise(begins)]


def phase_spans(
    series: Phased,
    after: float = -math.inf,
    before: float = math.inf,
    grounds: Mapping[str, palette.Colour] = GROUNDS,
) -> tuple[Span, ...]:
    """Return the phases between two times [s] as strips behind a plot; the legend names each phase once.

    Args:
        series: Series with phases.
        after: Beginning of the plot [s].
        before: End of the plot [s].
        grounds: Colour of each phase.
    """
    spans: list[Span] = []
    for name, began, ended in stretches(series):
        begin, end = max(began, after), min(ended, before)
        if begin < end:
            again = any(each.name == name for each in spans)
            spans.append(Span(begin, end, "" if again else name, grounds.get(name, palette.OTHER)))
    return tuple(spans)


def true_and_felt(time: FloatArray, true: FloatArray | None, felt: FloatArray) -> tuple[Line, ...]:
    """Return `felt` (n,) as a line and `true` (n,), if known, as dots on it, so that both are visible."""
    line = Line(time, felt, "felt", palette.FELT, width=1.6)
    return (
        (line,) if true is None else (line, Line(time, true, "true", palette.TRUTH, width=2.6, dash=Dash.DOTTED))
    )


def force_overview(series: TimeSeries) -> Figure | None:
    """Return the figure of normal force and speed over the run; None without any contact."""
    felt = (series.measured_force, series.true_force)
    if not any(np.isfinite(force).any() for force in felt if force is not None):
        return None
    spans = phase_spans(series)
    speed = Line(series.time, _MILLI * series.speed, colour=palette.QUIET_COLOUR)
    return Figure(
        title="Normal force over the run",
        caption=(
            "Normal force found by touch, in the simulation (where known) and asked for, above the speed "
            "of the fingertip; the ground shows what the controller was doing. The nearer the true force "
            "to the set one the better."
        ),
        panels=(
            Panel((*spans, *_forces(series)), TIME, Axis("normal force", "N")),
            Panel((*unnamed(spans), speed), TIME, Axis("speed", "mm/s", low=0.0), height=150),
        ),
        wide=True,
    )


def force_zoom(series: TimeSeries) -> Figure | None:
    """Return the figure of normal force during scanning; None without a scan."""
    scans = [(begin, end) for name, begin, end in stretches(series) if name == Phase.SCAN]
    scanning = np.array([name == Phase.SCAN for name in series.phase], dtype=np.bool_)
    forces = (series.measured_force, series.set_force, series.true_force)
    shown = [force[scanning & np.isfinite(force)] for force in forces if force is not None]
    if not scans or scans[-1][1] <= scans[0][0] or not len(shown[0]):
        return None
    window, values = (scans[0][0], scans[-1][1]), np.concatenate(shown)
    margin = _MARGIN * max(float(np.ptp(values)), 1e-3 * float(np.abs(values).max()), 1e-6)
    ends = float(values.min()) - margin, float(values.max()) + margin
    return Figure(
        title="Normal force while scanning",
        caption="The same forces while scanning, on a scale that shows every deviation from the set value: "
        "the smaller the better.",
        panels=(
            Panel(
                (*phase_spans(series, *window), *_forces(series)),
                Axis("time", "s", *window, run_time=True),
                Axis("normal force", "N", *ends),
            ),
        ),
        wide=True,
    )


def _forces(series: TimeSeries) -> tuple[Line, ...]:
    target = Line(series.time, series.set_force, "set", palette.SET, dash=Dash.DASHED)
    return (*true_and_felt(series.time, series.true_force, series.measured_force), target)


def computing(timing: RunTiming) -> Section:
    """Return the section on computing times, ages of samples and missed deadlines, which every run has."""

    def draw() -> Iterator[Figure | None]:
        yield _timing_figure(timing)

    return Section("Computing", (TextTable(_timing_rows(timing)), Figures(draw)))


def _timing_figure(timing: RunTiming) -> Figure | None:
    """The histogram of computing times; None without any."""
    taken, counts = timing.compute.values, timing.compute.counts
    taken, counts = _MICRO * taken[taken > 0.0], counts[taken > 0.0]
    if not len(taken):
        return None
    spread, period = timing.compute_spread, _MICRO * timing.period
    low, high = float(taken.min()) / 1.2, max(float(taken.max()), period) * 1.3
    edges = np.geomspace(low, high, 2 + round(_BINS_PER_DECADE * np.log10(high / low)))
    number, _ = np.histogram(taken, edges, weights=counts)
    marks = (
        ("50 %", _MICRO * spread.p50, palette.INK_COLOUR, Dash.DOTTED),
        ("99 %", _MICRO * spread.p99, palette.INK_COLOUR, Dash.DASHED),
        ("max", _MICRO * spread.largest, palette.INK_COLOUR, Dash.SOLID),
        ("period", period, palette.BOUND, Dash.DASH_DOT),
    )
    rules = (Rule(at, f"{name}: {at:.3g} µs", colour, dash=dash) for name, at, colour, dash in marks)
    bars = Bars(np.sqrt(edges[1:] * edges[:-1]), number.astype(np.float64), np.diff(edges))
    return Figure(
        title="Time to compute a period",
        caption=(
            f"Compute times of {len(timing.compute)} periods, {timing.slow_periods} of them longer than the "
            "period; both axes are logarithmic. On a real robot all have to be left of the period, with room."
        ),
        panels=(
            Panel(
                (bars, *rules),
                Axis("compute time of a period", "µs", low, high, logarithmic=True),
                Axis("number of periods", low=0.7, logarithmic=True),
            ),
        ),
    )


def _timing_rows(timing: RunTiming) -> tuple[tuple[str, str, str, str], ...]:
    """Rows (name, value, unit, note) on computing times and, in real time, on deadlines."""
    rows = [
        _row("computing a period, 99 %", timing.compute_spread),
        _row("age of the oldest sample, 99 %", timing.age_spread),
    ]
    if len(timing.lateness):
        rows += [
            _row("start to start of a period, 99 %", timing.period_spread),
            _row("waking up late, 99 %", timing.lateness_spread),
            ("overruns", str(timing.overruns), "", "deadlines that passed before the work was done"),
        ]
    else:
        rows.append(("slower than real time", str(timing.slow_periods), "periods", "simulated: none was late"))
    if timing.note:
        rows.append(("system", "", "", timing.note))
    return tuple(row for row in rows if row[1] or row[3])


def _row(name: str, spread: Distribution) -> tuple[str, str, str, str]:
    if spread.count == 0:
        return (name, "", "", "")
    note = f"median {_MICRO * spread.p50:.0f}, max {_MICRO * spread.largest:.0f} µs of {spread.count}"
    return (name, f"{_MICRO * spread.p99:.0f}", "µs", note)
