"""How long the control periods took to compute."""

import numpy as np
from matplotlib.ticker import EngFormatter, NullFormatter

from palpate.reporting.style import (
    DASH_DOT,
    INK,
    LIMIT,
    MEASURED,
    SMALL_SIZE,
    Picture,
    Width,
    legend_above,
    new_figure,
    style_axes,
)
from palpate.runtime import RunTiming

BINS_PER_DECADE = 25


def timing_picture(timing: RunTiming) -> Picture | None:
    """Return the histogram of compute times, or None if no time was taken."""
    taken, counts = timing.compute.values, timing.compute.counts
    taken, counts = taken[taken > 0.0], counts[taken > 0.0]
    if not len(taken):
        return None
    spread = timing.compute_spread
    figure = new_figure(Width.HALF, 3.4)
    axes = figure.subplots()
    low, high = float(taken.min()) / 1.2, max(float(taken.max()), timing.period) * 1.3
    bins = np.geomspace(low, high, 2 + round(BINS_PER_DECADE * np.log10(high / low)))
    axes.hist(taken, weights=counts, bins=bins.tolist(), color=MEASURED, alpha=0.75, log=True)
    axes.set_xscale("log")
    axes.set_ylim(bottom=0.7)
    seconds = EngFormatter(unit="s", places=None, sep="\N{NO-BREAK SPACE}")
    marks = (
        ("50 %", spread.p50, INK, ":"),
        ("99 %", spread.p99, INK, "--"),
        ("max", spread.largest, INK, "-"),
        ("period", timing.period, LIMIT, DASH_DOT),
    )
    for name, at, colour, line in marks:
        label = f"{name}: {seconds.format_data(float(f'{at:.3g}'))}"
        axes.axvline(at, color=colour, linestyle=line, linewidth=1.3, label=label)
    axes.xaxis.set_major_formatter(seconds)
    axes.xaxis.set_minor_formatter(NullFormatter())
    style_axes(axes, x="compute time of a period [s]", y="number of periods")
    axes.tick_params(which="minor", labelsize=SMALL_SIZE, length=2)
    legend_above(figure, [axes], columns=2)
    return Picture(
        title="Time to compute a period",
        caption=(
            f"Compute times of {len(timing.compute)} periods, {timing.slow_periods} of them longer than the "
            "period; both axes are logarithmic. On a real robot all have to be left of the period, with room."
        ),
        full=figure,
    )
