"""Log evidence of a patch and how it changes with each of the model's six numbers.

With K the covariance of what was felt and a = K^-1 y, the derivative of the log evidence by any number t is
1/2 tr((a a' - K^-1) dK/dt) (Rasmussen & Williams 2006, eq. 5.9). All numbers share the one inverse, so a gradient
costs some two evaluations, where differences cost six.
"""

import math

import numpy as np
from scipy.linalg.lapack import dpotri, dpotrs

from palpate.errors import FloatArray
from palpate.mapping.surface_map.covariance import path_correlation_slope, surface_slopes
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
    weights, _ = dpotrs(factored.lower, data.values, lower=1)
    inverse, _ = dpotri(factored.lower, lower=1)
    W = np.tril(inverse, -1)
    W += W.T
    W[np.diag_indices(len(W))] += np.diagonal(inverse)
    np.subtract(np.outer(weights, weights), W, out=W)
    W[np.diag_indices(len(W))] *= 1.0 + JITTER
    n = len(data.xy)
    by_length, by_curvature = surface_slopes(data.xy, bent, W)
    heights = np.outer(data.noise_root, data.noise_root) * W[:n, :n] * model.noise**2
    r, along = data.tilt_root, np.zeros((n, n))
    for i in range(2):
        for j in range(2):
            block = W[(1 + i) * n : (2 + i) * n, (1 + j) * n : (2 + j) * n]
            along += block * (np.outer(r[:, i, 0], r[:, j, 0]) + np.outer(r[:, i, 1], r[:, j, 1]))
    along *= model.tilt**2
    parts = [by_length, by_curvature]
    for spread, length in ((heights, model.noise_length), (along, model.tilt_length)):
        C, slope = path_correlation_slope(data.path, data.extent, length)
        parts += [2.0 * float((spread * C).sum()), float((spread * slope).sum())]
    return factored.log_evidence, 0.5 * np.array(parts)
