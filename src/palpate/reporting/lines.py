"""What was felt and what was true in one plot, neither hidden by the other."""

import numpy as np
from matplotlib.axes import Axes

from palpate.errors import FloatArray
from palpate.reporting.envelope import envelope
from palpate.reporting.style import MEASURED, TRUE

ROUGH = 2.0
"""A felt line this many times as long up and down as the true one is noise that would cover it."""


def draw_true_and_felt(axes: Axes, time: FloatArray, true: FloatArray | None, felt: FloatArray) -> None:
    """Draw `felt` (n,) as a thin line, and `true` (n,), if known, as a wide pale one.

    The wide line is below where both agree, and on top of noise.
    """
    if true is not None:
        above = _variation(felt) > ROUGH * _variation(true)
        axes.plot(
            *envelope(time, true), color=TRUE, linewidth=3.2, alpha=0.5, zorder=2.1 if above else 1.9, label="true"
        )
    axes.plot(*envelope(time, felt), color=MEASURED, linewidth=1.0, zorder=2.0, label="felt")


def _variation(values: FloatArray) -> float:
    return float(np.nansum(np.abs(np.diff(values))))
