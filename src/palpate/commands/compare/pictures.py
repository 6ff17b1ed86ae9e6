"""Pictures of a comparison: where the errors are, how large, and what was not felt."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Colormap, Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

from palpate.errors import FloatArray
from palpate.mapping.compare import Comparison
from palpate.reporting.style import (
    ERROR_COLOURS,
    INK,
    MEASURED,
    MICRO,
    MILLI,
    TIME_COLOURS,
    Picture,
    Width,
    colour_bar,
    new_figure,
    style_axes,
    style_space,
)

SHOWN = 6000
"""Points drawn: more cover each other."""

SHOWN_PERCENT = 99.0
"""Colours span this share of the errors, so that a few outliers do not hide the rest."""

ELEVATION, AZIMUTH = 32.0, -58.0


def error_on_map(found: Comparison, signed: bool) -> Picture:
    """Return the map's points in space, coloured by their distance from the reference."""
    limit = max(float(np.percentile(np.abs(found.distance), SHOWN_PERCENT)) * MICRO, 1e-3)
    norm = Normalize(-limit, limit) if signed else Normalize(0.0, limit)
    colours = ERROR_COLOURS if signed else TIME_COLOURS
    label = "distance [µm]" + (", + is outside the reference" if signed else "")
    largest = MICRO * found.map_to_reference.largest
    return Picture(
        title="Where the errors are",
        caption=(
            f"The map's points, coloured by their distance from the reference; the colours span "
            f"{SHOWN_PERCENT:.0f} % of them, the largest is {largest:.3g} µm. "
            "An even colour of no distance is good."
        ),
        full=_in_space(found.points, MICRO * found.distance, norm, colours, label),
        dense=True,
    )


def gaps_on_reference(found: Comparison) -> Picture:
    """Return samples of the reference in space, coloured by their distance from the map."""
    norm = Normalize(0.0, 2.0 * MILLI * found.within)
    return Picture(
        title="What was felt of the reference",
        caption=(
            f"The reference, coloured by its distance from the map: {100.0 * found.coverage:.1f} % is within "
            f"{MILLI * found.within:g} mm, half the colour scale. "
            "Blue all over is good."
        ),
        full=_in_space(
            found.reference_points,
            MILLI * found.reference_distance,
            norm,
            TIME_COLOURS,
            "distance from the map [mm]",
        ),
        dense=True,
    )


def error_histogram(found: Comparison) -> Picture:
    """Return the histogram of distances."""
    figure = new_figure(Width.HALF, 4.0)
    axes = figure.subplots()
    error = MICRO * found.distance
    axes.hist(error, bins=60, color=MEASURED, alpha=0.75)
    axes.axvline(0.0, color=INK, linewidth=1.0)
    style_axes(axes, x="distance from the reference [µm]", y="number of points")
    spread = found.map_to_reference
    return Picture(
        title="How large the errors are",
        caption=(
            f"Distances of {len(error)} points: root mean square {MICRO * spread.rms:.3g} µm, mean of their size "
            f"{MICRO * spread.mean:.3g} µm, 95 % are below {MICRO * spread.p95:.3g} µm. Narrow and "
            "about zero is good."
        ),
        full=figure,
    )


def _in_space(points: FloatArray, values: FloatArray, norm: Normalize, colours: Colormap, label: str) -> Figure:
    figure = new_figure(Width.HALF, 4.0)
    axes: Axes3D = figure.add_subplot(projection="3d")
    shown = points[:: max(1, -(-len(points) // SHOWN))]
    value = values[:: max(1, -(-len(points) // SHOWN))]
    axes.scatter(*(MILLI * shown.T), c=value, cmap=colours, norm=norm, s=4.0, linewidths=0.0, depthshade=False)
    low, high = MILLI * points.min(axis=0), MILLI * points.max(axis=0)
    size = np.maximum(high - low, 0.05 * max(float((high - low).max()), 1e-6))
    middle = 0.5 * (low + high)
    low, high = middle - 0.54 * size, middle + 0.54 * size
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axes.set_box_aspect(tuple(size), zoom=0.95)
    axes.view_init(elev=ELEVATION, azim=AZIMUTH)
    shares = (size / size.max()).tolist()
    style_space(axes, shares)
    axes.zaxis.labelpad = -2.0  # else it is cut off at the rim
    colour_bar(figure, ScalarMappable(norm, colours), axes, label, shrink=0.75, pad=0.04)
    return figure
