"""How far the touched points are from the true surface."""

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping import TouchCloud
from palpate.reporting.style import (
    ERROR_COLOURS,
    INK,
    MAP_GROUND,
    MEASURED,
    MICRO,
    MILLI,
    Picture,
    Width,
    colour_bar,
    new_figure,
    style_axes,
)

SHOWN_PERCENT = 99.0
"""Colours span this share of the errors, so that a few outliers do not hide the rest."""


def error_map(cloud: TouchCloud, point_error: FloatArray, note: str = "") -> Picture:
    """Return the map of signed errors seen from above; `point_error` (n,) [m], n at least 1.

    `note` goes to the end of the caption.
    """
    figure = new_figure(Width.HALF, 4.4)
    axes = figure.subplots()
    # Large errors last, so that none is hidden.
    order = np.argsort(np.abs(point_error))
    error = MICRO * point_error[order]
    limit = max(float(np.percentile(np.abs(error), SHOWN_PERCENT)), 1e-3)
    x, y = MILLI * cloud.position[order, 0], MILLI * cloud.position[order, 1]
    dots = axes.scatter(
        x, y, c=error, cmap=ERROR_COLOURS, vmin=-limit, vmax=limit, s=3.0, linewidths=0.0, rasterized=True
    )
    colour_bar(
        figure, dots, axes, "error of the points [µm], + is outside the surface", extend="both", shrink=0.85
    )
    axes.set_facecolor(MAP_GROUND)
    axes.set_aspect("equal", adjustable="datalim")
    style_axes(axes, x="x [mm]", y="y [mm]", grid=False)
    return Picture(
        title="Where the errors are",
        caption=(
            f"Signed distance of the touched points from the true surface, seen from above; the colours span "
            f"{SHOWN_PERCENT:.0f} % of the points, the largest error is {np.abs(error).max():.3g} µm. "
            f"White is good; a pattern indicates a systematic error. {note}"
        ).rstrip(),
        full=figure,
        dense=True,
    )


def error_histogram(point_error: FloatArray) -> Picture:
    """Return the histogram of signed errors; `point_error` (n,) [m], n at least 1."""
    figure = new_figure(Width.HALF, 4.4)
    axes = figure.subplots()
    error = MICRO * point_error
    mean, rms = float(error.mean()), float(np.sqrt((error**2).mean()))
    axes.hist(error, bins=60, color=MEASURED, alpha=0.75)
    axes.axvline(0.0, color=INK, linewidth=1.0)
    style_axes(axes, x="error of the points [µm]", y="number of points")
    return Picture(
        title="How large the errors are",
        caption=(
            f"Signed distances of {len(error)} points from the true surface: root mean square {rms:.3g} µm, "
            f"mean {mean:.3g} µm, largest {np.abs(error).max():.3g} µm. Narrow and about zero is good."
        ),
        full=figure,
    )
