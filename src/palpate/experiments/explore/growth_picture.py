"""Growth of the map: observed area and standard deviations over path length, time and contacts."""

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator

from palpate.errors import FloatArray
from palpate.experiments.explore.map_growth import GrowthCurve, MapGrowth
from palpate.reporting.style import (
    INK,
    MEASURED,
    MICRO,
    MILLI,
    PATH,
    QUIET,
    SMALL_SIZE,
    Picture,
    Width,
    legend_above,
    new_figure,
    style_axes,
)

AREA = 1e4
"""cm^2 per m^2."""

ROOM = 1.08
"""Height of the axes over the largest value."""


@dataclass(frozen=True, slots=True, eq=False)
class _Scale:
    """A horizontal axis of the picture."""

    label: str
    value: FloatArray


def growth_picture(growth: MapGrowth) -> Picture:
    """Return area and standard deviations over path length, time and contacts; on phones over path length only."""
    curve = growth.curve
    scales = _scales(curve)
    full, narrow = new_figure(Width.FULL, 4.2), new_figure(Width.HALF, 4.4)
    for figure, drawn in ((full, scales), (narrow, scales[:1])):
        axes = figure.subplots(2, len(drawn), sharex="col", sharey="row", squeeze=False)
        for i, scale in enumerate(drawn):
            _draw(growth, scale, axes[0, i], axes[1, i], is_first=i == 0)
        legend_above(figure, axes.ravel().tolist(), 4)
        _name_snapshots(growth, scales[0], axes[0, 0])
    last = len(curve) - 1
    return Picture(
        title="Growth of the map",
        caption=(
            f"In the end {AREA * curve.area[last]:.3g} cm² are observed, half of them to ±"
            f"{MICRO * curve.middle[last]:.3g} µm, 95 % to ±{MICRO * curve.tail[last]:.3g} µm or better (one "
            "standard deviation). All moments use the noise and surface model learned from the whole run. "
            "Dotted lines: the moments of the maps below. A growing area and falling "
            "deviations are good."
        ),
        full=full,
        narrow=narrow,
    )


def share_text(growth: MapGrowth, moment: int) -> str:
    """Return the share of the path that was done at a moment, as text."""
    whole = growth.curve.path_length[-1]
    return f"{100.0 * growth.curve.path_length[moment] / whole:.0f} %" if whole > 0.0 else "100 %"


def _scales(curve: GrowthCurve) -> tuple[_Scale, ...]:
    return (
        _Scale("path length [mm]", MILLI * curve.path_length),
        _Scale("time [s]", curve.time),
        _Scale("contacts", curve.contacts),
    )


def _draw(growth: MapGrowth, scale: _Scale, above: Axes, below: Axes, *, is_first: bool) -> None:
    curve = growth.curve
    above.plot(scale.value, AREA * curve.area, color=MEASURED, linewidth=1.6, label="observed area")
    below.plot(
        scale.value, MICRO * curve.tail, color=PATH, linewidth=1.2, linestyle=":", label="sd, 95 % of the area"
    )
    below.plot(scale.value, MICRO * curve.middle, color=PATH, linewidth=1.6, label="sd, median")
    for axes, value in ((above, AREA * curve.area), (below, MICRO * curve.tail)):
        most = float(np.nanmax(value, initial=0.0))
        axes.set_ylim(0.0, ROOM * most if most > 0.0 else 1.0)
        axes.margins(x=0.02)
        for each in growth.snapshots:
            axes.axvline(scale.value[each.moment], color=QUIET, linewidth=0.7, linestyle=":", zorder=0.5)
    style_axes(above, x="", y="observed [cm²]" if is_first else "")
    style_axes(below, x=scale.label, y="sd [µm]" if is_first else "")
    below.xaxis.set_major_locator(MaxNLocator(5))


def _name_snapshots(growth: MapGrowth, scale: _Scale, axes: Axes) -> None:
    """Write the share of the path over each dotted line of the first panel."""
    for each in growth.snapshots[:-1]:
        axes.annotate(
            share_text(growth, each.moment),
            (scale.value[each.moment], 1.0),
            xycoords=("data", "axes fraction"),
            xytext=(0.0, 1.0),
            textcoords="offset points",
            fontsize=SMALL_SIZE,
            color=INK,
            ha="center",
            va="bottom",
        )
