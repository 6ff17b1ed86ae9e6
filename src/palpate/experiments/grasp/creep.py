"""How fast an object creeps over the fingertips: a line of which each metre is small, and which does not end."""

import math

import numpy as np

from palpate.errors import FloatArray

CREEPS, TURNS = 5e-6, math.radians(0.05)
"""[m/s], [rad/s] Above: in four seconds what counts as slip, or as spin. What is elastic gives way by less as a
pull of 0.5 N grows within a second."""

LEAST_TIME = 1.0
"""[s] Over which a rate is told: shaking at 2 Hz has come back twice."""


def creep_rate(time: FloatArray, way: FloatArray) -> float:
    """Return the slope of the line through a way, the largest of all fingers; 0 of less than `LEAST_TIME`.

    Args:
        time: Shape (n,) [s].
        way: Of each finger, shape (n, k) [m] or [rad].
    """
    if len(time) < 2 or time[-1] - time[0] < LEAST_TIME:
        return 0.0
    from_middle = time - time.mean()
    slopes = from_middle @ way / (from_middle @ from_middle)
    return float(np.abs(slopes).max())
