"""What was felt and what was true in one plot, neither hidden by the other."""

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.marks import Line
from palpate.runtime.palette import FELT, TRUTH

ROUGH = 2.0
"""A felt line this many times as long up and down as the true one is noise that would cover it."""


def true_and_felt(time: FloatArray, true: FloatArray | None, felt: FloatArray) -> tuple[Line, ...]:
    """Return `felt` (n,) as a thin line, and `true` (n,), if known, as a wide pale one.

    The wide line is below where both agree, and on top of noise.
    """
    lines = (Line(time, felt, "felt", FELT, width=1.2),)
    if true is None:
        return lines
    wide = Line(time, true, "true", TRUTH, width=4.0, opacity=0.55)
    return (*lines, wide) if _variation(felt) > ROUGH * _variation(true) else (wide, *lines)


def _variation(values: FloatArray) -> float:
    return float(np.nansum(np.abs(np.diff(values))))
