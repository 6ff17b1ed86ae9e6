"""Covariances between heights and slopes of a Matern-5/2 process, and of noise that keeps along a path.

With a = sqrt(5) / length and r = |x - x'|, k = s^2 (1 + a r + a^2 r^2 / 3) exp(-a r) (Rasmussen & Williams 2006,
eq. 4.17). Its derivatives are those of the process (ibid. eq. 9.1): with d = x - x',
A1 = s^2 a^2 / 3 (1 + a r) exp(-a r) and A2 = s^2 a^4 / 3 exp(-a r),

    cov(h, h') = k,  cov(h, grad_j h') = A1 d_j,  cov(grad_i h, grad_j h') = A1 delta_ij - A2 d_i d_j.

Onto it comes a plane of vague height and slope, so that a patch is bent by the process and tilted for free.
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.mapping.surface_map.kernel import (
    correlate,
    distances,
    fill_bends,
    fill_covariance,
    fill_heights,
    sum_surface,
)
from palpate.mapping.surface_map.model import SurfaceModel

PLANE_SLOPE = 0.3
"""Standard deviation of the slope of a patch's plane: its axis is the normal of a contact, the rest is bend."""


@dataclass(frozen=True, slots=True, eq=False)
class PathNoise:
    """What errs in heights and slopes along a path.

    Attributes:
        heights: Standard deviations of heights, shape (n,) [m].
        slopes: Square roots of the covariances of slopes, shape (n, 2, 2).
        of_heights: How errors of heights keep along the path: what `kernel.correlate` returns.
        of_slopes: Likewise.
    """

    heights: FloatArray
    slopes: FloatArray
    of_heights: tuple[FloatArray, FloatArray, FloatArray]
    of_slopes: tuple[FloatArray, FloatArray, FloatArray]

    @property
    def height_covariance(self) -> FloatArray:
        """Of errors of heights, shape (n, n) [m^2]."""
        return np.asarray(np.outer(self.heights, self.heights) * self.of_heights[0])

    def slope_covariance(self, weights: FloatArray) -> FloatArray:
        """Return the covariance of errors of slopes along x, then along y, times weights, all of shape (2 n,)."""
        along = np.einsum("nij,in->nj", self.slopes, weights.reshape(2, -1))
        return np.asarray(np.einsum("nij,nj->in", self.slopes, self.of_slopes[0] @ along).ravel())


def patch_covariance(
    xy: FloatArray, model: SurfaceModel, noise: PathNoise, jitter: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the covariance of what is felt of (h, h_x, h_y) at n points, errors included.

    Args:
        xy: Shape (n, 2) [m].
        model: Length scale and curvature.
        noise: What errs.
        jitter: By which part of itself the diagonal grows.

    Returns:
        The covariance, all heights first [m], then all slopes along x, then along y, shape (3 n, 3 n); distances
        times a, and exponentials of minus these, shape (n, n). Of all, only upper triangles are given.
    """
    n = len(xy)
    K, ar, decay = np.empty((3 * n, 3 * n)), np.empty((n, n)), np.empty((n, n))
    errors = noise.heights, noise.slopes, noise.of_heights[0], noise.of_slopes[0]
    fill_covariance(K, ar, decay, xy, process_scales(model, jitter), *errors)
    return K, ar, decay


def process_scales(model: SurfaceModel, jitter: float) -> tuple[float, float, float, float, float]:
    """Return what `kernel.fill_covariance` wants to know of a process."""
    return math.sqrt(5.0) / model.length, model.height**2, model.plane**2, PLANE_SLOPE**2, jitter


def height_covariance(xy: FloatArray, xy_at: FloatArray, model: SurfaceModel) -> FloatArray:
    """Return the covariance of (h, h_x, h_y) at n points with heights at m points, shape (3 n, m).

    The first m columns of what is before anything errs.
    """
    a = math.sqrt(5.0) / model.length
    ar = distances(xy, xy_at, a)
    K = np.empty((3 * len(xy), len(xy_at)))
    fill_heights(K, xy, xy_at, ar, np.exp(-ar), (a, model.height**2, model.plane**2, PLANE_SLOPE**2))
    return K


def weighted_sums(xy_at: FloatArray, xy: FloatArray, weights: FloatArray, model: SurfaceModel) -> FloatArray:
    """Return the covariance of (h, h_x, h_y) at some points with those at others, times weights, without itself.

    With weights (w, u) for heights and slopes, h = sum k w + A1 d.u and grad h = sum A1 u - (A1 w + A2 d.u) d.

    Args:
        xy_at: Where, shape (m, 2) [m].
        xy: Of the weights, shape (n, 2) [m].
        weights: Shape (3 n,).
        model: Length scale and curvature.

    Returns:
        Rows h, h_x, h_y, shape (3, m).
    """
    w, u = weights[: len(xy)], weights[len(xy) :].reshape(2, -1)
    a = math.sqrt(5.0) / model.length
    h2, p2 = model.plane**2, PLANE_SLOPE**2
    ar = distances(xy_at, xy, a)
    sums = np.empty((3, len(xy_at)))
    sum_surface(sums, xy_at, xy, weights, ar, np.exp(-ar), (a * a, model.height**2))
    plane = p2 * (w @ xy + u.sum(axis=1))
    sums[0] += h2 * w.sum() + xy_at @ plane
    sums[1:] += plane[:, None]
    return sums


def bend_covariance(xy: FloatArray, xy_at: FloatArray, model: SurfaceModel) -> FloatArray:
    """Return the covariance of (h, h_x, h_y) at n points with (h_xx, h_xy, h_yy) at m points, shape (3 n, 3 m).

    One derivative more of those above, with d = x_at - x: cov(h, h_ij) = A2 d_i d_j - A1 delta_ij and
    cov(grad_k h, h_ij) = (a / r) A2 d_i d_j d_k - A2 (delta_ij d_k + delta_ik d_j + delta_jk d_i). The plane is
    not bent: it adds nothing.
    """
    a = math.sqrt(5.0) / model.length
    ar = distances(xy, xy_at, a)
    K = np.empty((3, len(xy), 3, len(xy_at)))
    fill_bends(K, xy, xy_at, ar, np.exp(-ar), (a, model.height**2))
    return K.reshape(3 * len(xy), -1)


def bend_variance(model: SurfaceModel) -> FloatArray:
    """Return the covariance of (h_xx, h_xy, h_yy) at a point before anything is felt, shape (3, 3) [1/m^2]."""
    return model.curvature**2 / 3.0 * np.array([[3.0, 0.0, 1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 3.0]])


def height_variance(xy: FloatArray, model: SurfaceModel) -> FloatArray:
    """Return the variance of heights before anything is felt, shape (n,) [m^2]."""
    flat = model.height**2 + model.plane**2
    return np.asarray(flat + PLANE_SLOPE**2 * (xy**2).sum(axis=1))


def path_correlation(path: FloatArray, extent: FloatArray, length: float) -> FloatArray:
    """Return the covariance of means over stretches of a unit noise with correlation exp(-s / length).

    The exact double integrals: stretches i and j do not overlap, so theirs is a product of hyperbolic sines with
    the decay between centres; that of a stretch with itself is its long-run variance 2 L / b, less its ends.

    Args:
        path: Where the centre of each stretch lies along the path, increasing, shape (n,) [m].
        extent: How long each stretch is, shape (n,) [m]; centres lie at least half of both apart.
        length: Path over which noise keeps its value [m].

    Returns:
        Shape (n, n).
    """
    return np.asarray(correlate(path, extent, length)[0])
