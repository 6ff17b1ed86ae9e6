"""Tests of residuals that should depend on nothing: in time, in place and in direction.

Each returns the probability with which white residuals would look so dependent or more. They are made for
residuals of a fit with few parameters beside the number of data.
"""

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree
from scipy.special import chdtrc, fdtrc, ndtr

from palpate.errors import FloatArray, InvalidValueError

FEWEST = 8
"""Data for any of these tests."""

LAGS = 5
"""Of correlations in time that are tested: what drifts, or comes and goes slowly, shows in the first few."""

NEIGHBOURS = 4
"""Of a place whose residual should not be like its own."""


def white_in_time(residuals: npt.ArrayLike) -> float:
    """Return the p-value of Ljung and Box (1978) for residuals in the order in which they were taken.

    Args:
        residuals: Shape (n,) or (n, k): k series are tested together.

    Raises:
        InvalidValueError: Fewer than `FEWEST` rows, or not finite.
    """
    rows = _columns(residuals)
    n = len(rows)
    lags = min(LAGS, n // 4)
    centred = rows - rows.mean(axis=0)
    power = np.sum(centred**2, axis=0)
    used = power > 0.0
    if not used.any():
        return 1.0
    total = 0.0
    for lag in range(1, lags + 1):
        r = np.sum(centred[lag:] * centred[:-lag], axis=0)[used] / power[used]
        total += float(np.sum(r**2)) / (n - lag)
    return float(chdtrc(lags * int(used.sum()), n * (n + 2) * total))


def white_in_place(points: npt.ArrayLike, residuals: npt.ArrayLike) -> float:
    """Return the p-value of Moran's I (1950) over nearest neighbours: residuals that are alike where near.

    Args:
        points: Shape (n, d) [any unit].
        residuals: Shape (n,).

    Raises:
        InvalidValueError: Fewer than `FEWEST` rows, another number of points, or not finite.
    """
    rows = _columns(residuals)[:, 0]
    places = _columns(points)
    n = len(rows)
    if len(places) != n:
        raise InvalidValueError(f"points: {len(places)} for {n} residuals: must be as many")
    z = rows - rows.mean()
    power = float(z @ z)
    if power == 0.0:
        return 1.0
    near = np.asarray(KDTree(places).query(places, min(NEIGHBOURS, n - 2) + 1)[1])[:, 1:]
    k = near.shape[1]
    i = n / (n * k) * float(np.sum(z[:, None] * z[near])) / power
    # moments of I for exchangeable normal residuals (Cliff & Ord 1981), weights 1 from each to its neighbours
    mutual = np.zeros(n)
    np.add.at(mutual, near.ravel(), 1.0)
    pairs = np.repeat(np.arange(n), k) * n + near.ravel()
    both = int(np.isin(near.ravel() * n + np.repeat(np.arange(n), k), pairs).sum())
    s0, s1, s2 = float(n * k), float(n * k + both), float(np.sum((k + mutual) ** 2))
    mean = -1.0 / (n - 1)
    variance = (n * n * s1 - n * s2 + 3.0 * s0 * s0) / ((n * n - 1.0) * s0 * s0) - mean * mean
    return float(1.0 - ndtr((i - mean) / np.sqrt(max(variance, 1e-12))))


def white_in_direction(directions: npt.ArrayLike, residuals: npt.ArrayLike) -> float:
    """Return the p-value of an F-test that residuals follow first and second harmonics of a direction.

    Args:
        directions: Unit vectors, shape (n, 2) or (n, 3).
        residuals: Shape (n,).

    Raises:
        InvalidValueError: Fewer rows than the harmonics need, another number of directions, or not finite.
    """
    rows, u = _columns(residuals)[:, 0], _columns(directions)
    n, d = u.shape
    if len(rows) != n:
        raise InvalidValueError(f"directions: {n} for {len(rows)} residuals: must be as many")
    second = [u[:, a] * u[:, b] for a in range(d) for b in range(a, d)][: -1 if d > 1 else None]
    X = np.column_stack([np.ones(n), u, *second])
    X = X - np.where(np.arange(X.shape[1]) == 0, 0.0, X.mean(axis=0))
    U, s, _ = np.linalg.svd(X, full_matrices=False)
    U = U[:, s > 1e-9 * s[0]]
    q = U.shape[1] - 1
    centred = rows - rows.mean()
    fitted = U @ (U.T @ centred)
    left, explained = n - q - 1, float(fitted @ fitted)
    unexplained = float(centred @ centred) - explained
    if q < 1 or left < 1 or explained + unexplained == 0.0:
        return 1.0
    return float(fdtrc(q, left, explained / q / max(unexplained / left, 1e-300)))


def _columns(values: npt.ArrayLike) -> FloatArray:
    rows = np.asarray(values, dtype=np.float64)
    rows = rows[:, None] if rows.ndim == 1 else rows
    if rows.ndim != 2 or len(rows) < FEWEST or not np.isfinite(rows).all():
        raise InvalidValueError(f"shape {rows.shape}: must be {FEWEST} finite rows or more")
    return rows
