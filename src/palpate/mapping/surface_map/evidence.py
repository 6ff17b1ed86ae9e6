"""Log evidence of a patch and how it changes with each of the model's six numbers.

With K the covariance of what was felt and a = K^-1 y, the derivative of the log evidence by any number t is
1/2 tr((a a' - K^-1) dK/dt) (Rasmussen & Williams 2006, eq. 5.9). All numbers share the one inverse, so a gradient
costs some two evaluations, where differences cost six.
"""

import math

import numpy as np
from scipy.linalg.lapack import dpotri

from palpate.errors import FloatArray
from palpate.mapping.surface_map.covariance import process_scales
from palpate.mapping.surface_map.kernel import evidence_slopes
from palpate.mapping.surface_map.model import PatchCurvature, SurfaceModel
from palpate.mapping.surface_map.patch import JITTER, Factored, PatchData


def evidence_gradient(data: PatchData, model: SurfaceModel, bend: PatchCurvature) -> tuple[float, FloatArray]:
    """Return the log evidence and its derivatives by the logarithms of the model's numbers, shape (6,).

    Minus infinity and zeros where the covariance is singular to rounding.
    """
    noise = data.noise(model)
    bent = model.bent(bend)
    factored = Factored.of(data, bent, noise)
    if not math.isfinite(factored.log_evidence):
        return -math.inf, np.zeros(6)
    weights = factored.weights
    inverse, _ = dpotri(factored.lower, lower=1, overwrite_c=1)
    half = 0.5 * data.extent
    slopes = evidence_slopes(
        inverse,
        weights,
        data.xy,
        *factored.apart,
        process_scales(bent, JITTER),
        noise.heights,
        noise.slopes,
        data.path,
        (*noise.of_heights, half, model.noise_length),
        (*noise.of_slopes, half, model.tilt_length),
    )
    return factored.log_evidence, 0.5 * slopes
