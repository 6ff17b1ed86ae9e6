"""Log evidence of a patch and how it changes with each of the model's six numbers.

With K the covariance of what was felt and a = K^-1 y, the derivative of the log evidence by any number t is
1/2 tr((a a' - K^-1) dK/dt) (Rasmussen & Williams 2006, eq. 5.9). All numbers share the one inverse, so a gradient
costs some two evaluations, where differences cost six.
"""

import math

import numpy as np
from scipy.linalg.lapack import dpotri, dpotrs
from scipy.spatial.distance import cdist

from palpate.errors import FloatArray
from palpate.mapping.surface_map.covariance import own_growth
from palpate.mapping.surface_map.kernel import evidence_slopes
from palpate.mapping.surface_map.model import PatchCurvature, SurfaceModel
from palpate.mapping.surface_map.patch import JITTER, Factored, PatchData


def evidence_gradient(data: PatchData, model: SurfaceModel, bend: PatchCurvature) -> tuple[float, FloatArray]:
    """Return the log evidence and its derivatives by the logarithms of the model's numbers, shape (6,).

    Minus infinity and zeros where the covariance is singular to rounding.
    """
    correlations = data.correlations(model)
    bent = model.bent(bend)
    factored = Factored.of(data, bent, data.noise(model, correlations))
    if not math.isfinite(factored.log_evidence):
        return -math.inf, np.zeros(6)
    weights, _ = dpotrs(factored.lower, data.values, lower=1)
    inverse, _ = dpotri(factored.lower, lower=1)
    a, half = math.sqrt(5.0) / bent.length, 0.5 * data.extent
    ar = a * cdist(data.xy, data.xy)
    slopes = evidence_slopes(
        inverse,
        weights,
        JITTER,
        data.xy,
        ar,
        np.exp(-ar),
        (a * a, bent.height**2, 0.0, 0.0),
        model.noise * data.noise_root,
        model.tilt * data.tilt_root,
        data.path,
        (correlations[0], *own_growth(data.extent, model.noise_length), half, model.noise_length),
        (correlations[1], *own_growth(data.extent, model.tilt_length), half, model.tilt_length),
    )
    return factored.log_evidence, 0.5 * slopes
