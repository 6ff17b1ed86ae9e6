"""Covariances of heights and slopes where nothing errs."""

import numpy as np

from palpate.mapping.surface_map.covariance import PathNoise, patch_covariance


def without_errors(n):
    """What errs in n stretches: nothing."""
    kept = (np.zeros((n, n)), np.zeros(n), np.zeros(n))
    return PathNoise(np.zeros(n), np.zeros((n, 2, 2)), kept, kept)


def surface_covariance(xy, model):
    """The whole covariance of (h, h_x, h_y) at points (n, 2), shape (3, n, 3, n)."""
    n = len(xy)
    upper = np.triu(patch_covariance(xy, model, without_errors(n), 0.0)[0])
    return (upper + np.triu(upper, 1).T).reshape(3, n, 3, n)
