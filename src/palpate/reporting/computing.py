"""How a run kept time: a section that every report of a run ends with."""

from collections.abc import Iterator

import numpy as np

from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Bars, Dash, Rule
from palpate.reporting.report import Figures, Section, TextTable
from palpate.runtime import Distribution, RunTiming
from palpate.runtime.palette import BOUND, INK_COLOUR

BINS_PER_DECADE = 25

MICRO = 1e6


def timing_figure(timing: RunTiming) -> Figure | None:
    """Return the histogram of compute times, or None if no time was taken."""
    taken, counts = timing.compute.values, timing.compute.counts
    taken, counts = MICRO * taken[taken > 0.0], counts[taken > 0.0]
    if not len(taken):
        return None
    spread, period = timing.compute_spread, MICRO * timing.period
    low, high = float(taken.min()) / 1.2, max(float(taken.max()), period) * 1.3
    edges = np.geomspace(low, high, 2 + round(BINS_PER_DECADE * np.log10(high / low)))
    number, _ = np.histogram(taken, edges, weights=counts)
    marks = (
        ("50 %", MICRO * spread.p50, INK_COLOUR, Dash.DOTTED),
        ("99 %", MICRO * spread.p99, INK_COLOUR, Dash.DASHED),
        ("max", MICRO * spread.largest, INK_COLOUR, Dash.SOLID),
        ("period", period, BOUND, Dash.DASH_DOT),
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


_MICRO = 1e6


def computing(timing: RunTiming) -> Section:
    """Return the section on how long periods took to compute, how old samples were, how deadlines were kept."""

    def draw() -> Iterator[Figure | None]:
        yield timing_figure(timing)

    return Section("Computing", (TextTable(_timing_rows(timing)), Figures(draw)))


def _timing_rows(timing: RunTiming) -> tuple[tuple[str, str, str, str], ...]:
    """Return rows (name, value, unit, note): what was computed, and, in real time, how deadlines were kept."""
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
