"""How far the touched points are from the true surface."""

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.marks import Bars, Rule
from palpate.reporting.picture import Axis, Panel, Picture

MICRO = 1e6


def error_histogram(point_error: FloatArray, note: str = "") -> Picture:
    """Return the histogram of signed errors; `point_error` (n,) [m], n at least 1.

    `note` goes to the end of the caption.
    """
    error = MICRO * point_error
    mean, rms = float(error.mean()), float(np.sqrt((error**2).mean()))
    return Picture(
        title="How large the errors are",
        caption=(
            f"Signed distances of {len(error)} points from the true surface: root mean square {rms:.3g} µm, "
            f"mean {mean:.3g} µm, largest {np.abs(error).max():.3g} µm. Narrow and about zero is good. {note}"
        ).rstrip(),
        panels=(
            Panel((Bars.histogram(error), Rule(0.0)), Axis("error of the points", "µm"), Axis("number of points")),
        ),
    )
