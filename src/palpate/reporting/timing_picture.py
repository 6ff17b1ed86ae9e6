"""How long the control periods took to compute."""

import numpy as np

from palpate.reporting.marks import Bars, Dash, Rule
from palpate.reporting.picture import Axis, Panel, Picture
from palpate.runtime import RunTiming
from palpate.runtime.palette import BOUND, INK_COLOUR

BINS_PER_DECADE = 25

MICRO = 1e6


def timing_picture(timing: RunTiming) -> Picture | None:
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
    return Picture(
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
