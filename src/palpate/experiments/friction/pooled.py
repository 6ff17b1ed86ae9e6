"""From estimates at several loads to one: their mean, and how e grows with the load."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.friction.rubbing.estimate import Estimate


def pooled(estimates: Sequence[Estimate]) -> Estimate:
    """Return the mean of estimates of one quantity.

    Noise is weighed by its variance, and counted as large as the estimates scatter, if they do more; what makes
    them wrong alike stays.
    """
    values = np.array([each.value for each in estimates])
    noise = np.array([max(each.noise, 1e-9 * abs(each.value), 1e-15) for each in estimates])
    model = np.array([each.model for each in estimates])
    # noise alone would take the quietest load for the truth where models differ
    weights = 1.0 / (noise**2 + model**2)
    weights = weights / weights.sum()
    mean = float(weights @ values)
    sd = math.sqrt(float(weights**2 @ noise**2))
    if len(values) > 1:
        sd = max(sd, math.sqrt(float(weights @ (values - mean) ** 2) / (len(values) - 1)))
    return Estimate(mean, sd, float(weights @ model))


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """e over the load as a power law, e = c f_n^gamma.

    Attributes:
        spin_length: c [m].
        load_exponent: gamma.
        spin_length_sd: Standard deviation of c [m].
        load_exponent_sd: Of gamma.
    """

    spin_length: float
    load_exponent: float
    spin_length_sd: float
    load_exponent_sd: float


def growth_of(loads: Sequence[float], lengths: Sequence[Estimate], calibration: float = 0.0) -> Growth:
    """Return the power law through e at two loads or more, whose ln is a straight line.

    Args:
        loads: Normal forces [N].
        lengths: e at each of them [m].
        calibration: Relative error that all of them share: that of c, and none of gamma.
    """
    x = np.log(np.array(loads))
    y = np.log([each.value for each in lengths])
    own = [(each.standard_deviation / each.value) ** 2 - calibration**2 for each in lengths]
    sd = np.sqrt(np.maximum(own, 1e-12))
    design: FloatArray = np.column_stack([np.ones_like(x), x])
    information = design.T @ (design / sd[:, None] ** 2)
    covariance = np.linalg.inv(information)
    line = covariance @ (design.T @ (y / sd**2))
    if len(x) > 2:
        misfit = float((((y - design @ line) / sd) ** 2).sum()) / (len(x) - 2)
        covariance = covariance * max(1.0, misfit)
    c = math.exp(float(line[0]))
    c_sd = c * math.hypot(math.sqrt(covariance[0, 0]), calibration)
    return Growth(c, float(line[1]), c_sd, math.sqrt(covariance[1, 1]))
