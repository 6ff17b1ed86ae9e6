"""Pictures of a comparison: where the errors are, how large, and what was not felt."""

from dataclasses import replace

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.compare import Comparison
from palpate.reporting.marks import Bars, Colouring, ColourScale, Rule
from palpate.reporting.picture import Axis, Panel, Picture, Space
from palpate.reporting.solids import Spots

MILLI, MICRO = 1e3, 1e6

SHOWN = 12_000
"""Points drawn: more cover each other."""

SHOWN_PERCENT = 99.0
"""Colours span this share of the errors, so that a few outliers do not hide the rest."""


def error_on_map(found: Comparison, signed: bool) -> Picture:
    """Return the map's points in space, coloured by their distance from the reference."""
    limit = max(float(np.percentile(np.abs(found.distance), SHOWN_PERCENT)) * MICRO, 1e-3)
    quantity = "distance" + (", + is outside the reference" if signed else "")
    low, scale = (-limit, ColourScale.ERROR) if signed else (0.0, ColourScale.HEIGHT)
    largest = MICRO * found.map_to_reference.largest
    return Picture(
        title="Where the errors are",
        caption=(
            f"The map's points, coloured by their distance from the reference; the colours span "
            f"{SHOWN_PERCENT:.0f} % of them, the largest is {largest:.3g} µm. "
            "An even colour of no distance is good."
        ),
        panels=(_in_space(found.points, Colouring(quantity, MICRO * found.distance, "µm", low, limit, scale)),),
    )


def gaps_on_reference(found: Comparison) -> Picture:
    """Return samples of the reference in space, coloured by their distance from the map."""
    distance, most = MILLI * found.reference_distance, 2.0 * MILLI * found.within
    return Picture(
        title="What was felt of the reference",
        caption=(
            f"The reference, coloured by its distance from the map: {100.0 * found.coverage:.1f} % is within "
            f"{MILLI * found.within:g} mm, half the colour scale. "
            "Dark all over is good."
        ),
        panels=(_in_space(found.reference_points, Colouring("distance from the map", distance, "mm", 0.0, most)),),
    )


def error_histogram(found: Comparison) -> Picture:
    """Return the histogram of distances."""
    error = MICRO * found.distance
    spread = found.map_to_reference
    return Picture(
        title="How large the errors are",
        caption=(
            f"Distances of {len(error)} points: root mean square {MICRO * spread.rms:.3g} µm, mean of their size "
            f"{MICRO * spread.mean:.3g} µm, 95 % are below {MICRO * spread.p95:.3g} µm. Narrow and "
            "about zero is good."
        ),
        panels=(
            Panel(
                (Bars.histogram(error), Rule(0.0)),
                Axis("distance from the reference", "µm"),
                Axis("number of points"),
            ),
        ),
    )


def _in_space(points: FloatArray, colouring: Colouring) -> Space:
    every = max(1, -(-len(points) // SHOWN))
    shown = replace(colouring, values=colouring.values[::every])
    return Space((Spots(points[::every], size=3.0, colourings=(shown,)),))
