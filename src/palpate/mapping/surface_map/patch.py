"""One patch of a surface: a Gaussian process of heights over the plane of one contact."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg.blas import dtrsm
from scipy.linalg.lapack import dpotrf, dtpttr, dtrtrs, dtrttp

from palpate.errors import FloatArray
from palpate.mapping.surface_map.agreement import Agreement
from palpate.mapping.surface_map.covariance import (
    PathNoise,
    bend_covariance,
    bend_variance,
    height_covariance,
    height_variance,
    patch_covariance,
    weighted_sums,
)
from palpate.mapping.surface_map.kernel import correlate, sharpest_turn, squares
from palpate.mapping.surface_map.model import BENDS, PatchCurvature, SurfaceModel
from palpate.mapping.surface_map.stretches import Stretches

STEEPEST_COS = 0.5
"""Stretches whose normal leans more than 60 degrees from a patch's axis are of another face."""

JITTER = 1e-12
"""Added to the diagonal relative to itself, against rounding: 1e-6 of a standard deviation. A search takes it for
white noise; with less, rounding shows: 1e-13 left maps the same in other units to 1e-4 only, this to 1e-6."""

CREASE = math.radians(25.0)
"""Turn between stretches that follow one another from which on a patch has a crease [rad]: 1 mm of a radius of
3 mm, the smallest that a map is made for, turns by 19 degrees, and a stretch ends at 30. No length and no
curvature fit a crease, so a search that saw it would end at its limits."""

COARSE_JITTER = 1e-9
"""Instead, where a covariance is singular to rounding all the same."""


@dataclass(frozen=True, slots=True, eq=False)
class PatchFrame:
    """A plane through a contact: x and y in it, heights along the contact's normal.

    Attributes:
        center: Shape (3,) [m], in the base frame.
        axes: Rows are x, y and the normal in the base frame, shape (3, 3).
    """

    center: FloatArray
    axes: FloatArray

    @property
    def axis(self) -> FloatArray:
        """Direction of heights in the base frame, shape (3,)."""
        return np.asarray(self.axes[2])

    @classmethod
    def at(cls, position: FloatArray, normal: FloatArray) -> "PatchFrame":
        """Return the plane of a contact; x is any direction in it, since the process knows none."""
        x = np.eye(3, dtype=np.float64)[int(np.abs(normal).argmin())]
        x = x - (x @ normal) * normal
        x /= np.linalg.norm(x)
        return cls(position, np.array([x, np.cross(normal, x), normal], np.float64))


@dataclass(frozen=True, slots=True, eq=False)
class PatchData:
    """Stretches as heights and slopes over a patch's plane.

    Attributes:
        xy: Shape (n, 2) [m].
        values: Heights [m], then slopes along x, then along y, shape (3 n,).
        path: As in `Stretches`.
        extent: As in `Stretches`.
        noise_root: Standard deviation of heights over that of the model's noise, shape (n,).
        tilt_root: Square root of the covariance of slopes over the model's tilt, shape (n, 2, 2).
    """

    xy: FloatArray
    values: FloatArray
    path: FloatArray
    extent: FloatArray
    noise_root: FloatArray
    tilt_root: FloatArray

    @classmethod
    def over(cls, frame: PatchFrame, stretches: Stretches) -> "PatchData":
        """Return `stretches`, none steeper than `STEEPEST_COS`, in a patch's frame.

        With slopes p = -n_xy / n_z, an error e along the normal changes the height by e sqrt(1 + p^2) and a
        rotation of the normal by a small angle about any tangent changes p by that angle, with covariance
        (1 + p^2) (I + p p').
        """
        local = (stretches.position - frame.center) @ frame.axes.T
        normal = stretches.normal @ frame.axes.T
        p = -normal[:, :2] / normal[:, 2:]
        secant = 1.0 / normal[:, 2]
        along = p[:, :, None] * p[:, None, :] / (1.0 + secant)[:, None, None]
        return cls(
            xy=np.ascontiguousarray(local[:, :2]),
            values=np.concatenate([local[:, 2], p[:, 0], p[:, 1]]),
            path=stretches.path,
            extent=stretches.extent,
            noise_root=stretches.noise * secant,
            tilt_root=(stretches.tilt * secant)[:, None, None] * (np.eye(2) + along),
        )

    @property
    def sharpest_turn(self) -> float:
        """Largest angle between normals of stretches that follow one another [rad]; 0 without such."""
        return float(sharpest_turn(self.values, self.path, self.extent))

    def noise(self, model: SurfaceModel) -> PathNoise:
        """Return what errs in `values`."""
        return PathNoise(
            model.noise * self.noise_root,
            model.tilt * self.tilt_root,
            correlate(self.path, self.extent, model.noise_length),
            correlate(self.path, self.extent, model.tilt_length),
        )


@dataclass(frozen=True, slots=True, eq=False)
class Factored:
    """The covariance of what was felt, factored.

    Attributes:
        lower: Lower Cholesky factor; the upper triangle holds anything.
        log_evidence: Logarithm of the probability of what was felt, up to a constant (Rasmussen & Williams eq.
            5.8); minus infinity where the covariance is singular to rounding.
        mean_square: Of what was felt, in units of what the model expects.
        white: What was felt, each value less what the ones before say of it, in units of what that is off by.
        apart: Distances and exponentials as from `patch_covariance`.
    """

    lower: FloatArray
    log_evidence: float
    mean_square: float
    white: FloatArray
    apart: tuple[FloatArray, FloatArray]

    @property
    def weights(self) -> FloatArray:
        """Inverse of the covariance times what was felt, shape (3 n,)."""
        return np.asarray(dtrtrs(self.lower, self.white, lower=1, trans=1)[0])

    @classmethod
    def of(cls, data: PatchData, model: SurfaceModel, noise: PathNoise, jitter: float = JITTER) -> "Factored":
        """Factor surface and noise together; with `COARSE_JITTER` where they are singular with less."""
        K, *apart = patch_covariance(data.xy, model, noise, jitter)
        lower, failed = dpotrf(K.T, lower=1, clean=0, overwrite_a=1)
        if failed:
            singular = cls(lower, -np.inf, np.inf, data.values, (apart[0], apart[1]))
            return singular if jitter >= COARSE_JITTER else cls.of(data, model, noise, COARSE_JITTER)
        white, _ = dtrtrs(lower, data.values, lower=1)
        square = float(white @ white)
        evidence = -0.5 * square - float(np.log(np.diagonal(lower)).sum())
        return cls(lower, evidence, square / len(white), white, (apart[0], apart[1]))


def likeliest_bend(
    data: PatchData, model: SurfaceModel, noise: PathNoise, bends: Sequence[PatchCurvature] = BENDS
) -> tuple[PatchCurvature, Factored]:
    """Return which of `bends` makes what was felt, with its `noise`, most probable."""
    tried = [(bend, Factored.of(data, model.bent(bend), noise)) for bend in bends]
    return max(tried, key=lambda each: each[0].odds + each[1].log_evidence)


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePatch:
    """A fitted patch.

    Attributes:
        frame: Its plane.
        model: What it was fitted with: the map's, bent as it suits the patch.
        xy: Where it has data, shape (n, 2) [m].
        weights: Of the data in a mean, shape (3 n,).
        factor: Lower Cholesky factor of the data's covariance, packed by columns.
        surprise: Mean square of the data in units of what the model expects: 1 where the model holds, above it at
            edges, steps, and contacts that contradict each other.
        agreement: How far its rows are off what the others say of them.
        slope_misfit: Mean square of how far the slopes that were felt are off its own, about either axis.
    """

    frame: PatchFrame
    model: SurfaceModel
    xy: FloatArray
    weights: FloatArray
    factor: FloatArray
    surprise: float
    agreement: Agreement
    slope_misfit: float

    @classmethod
    def fitted(
        cls, frame: PatchFrame, stretches: Stretches, model: SurfaceModel, believed: SurfaceModel, middle: float
    ) -> "SurfacePatch":
        """Return the posterior of the heights over `frame` given `stretches`.

        Args:
            frame: Its plane.
            stretches: What was felt there.
            model: What to believe of surface and noise.
            believed: What was believed before: how the surface may bend, too, where it has a crease.
            middle: Up to this distance from its centre rows tell whether they agree [m].

        Raises:
            FloatingPointError: The covariance is not positive definite, which `COARSE_JITTER` excludes where data
                are finite.
        """
        data = PatchData.over(frame, stretches)
        noise = data.noise(model)
        # a crease says nothing of the rest, nor the rest of a crease
        beyond = [] if data.sharpest_turn < CREASE else [model.bend_of(believed.bent(each)) for each in BENDS]
        bend, factored = likeliest_bend(data, model, noise, (*BENDS, *beyond))
        if factored.log_evidence == -np.inf:
            raise FloatingPointError(f"covariance of {len(data.xy)} stretches with {model} is singular")
        weights = factored.weights
        packed, _ = dtrttp(factored.lower, uplo="L")
        passing = (data.xy**2).sum(axis=1) <= middle * middle
        claimed = max(1.0, factored.mean_square)
        agreement = Agreement.of(data.path, passing, noise.height_covariance, factored.lower, weights, claimed)
        off = noise.slope_covariance(weights[len(data.xy) :])
        misfit = float(off @ off) / len(off)
        return cls(frame, model.bent(bend), data.xy, weights, packed, factored.mean_square, agreement, misfit)

    def heights(self, xy: FloatArray) -> FloatArray:
        """Return mean heights and slopes (h, h_x, h_y) at points of the plane, shape (3, m)."""
        return weighted_sums(xy, self.xy, self.weights, self.model)

    def height_sd(self, xy: FloatArray) -> FloatArray:
        """Return standard deviations of the heights, shape (m,) [m].

        Widened where the data surprise: residuals of twice the expected variance mean that (Birge, 1932).
        """
        cross = height_covariance(self.xy, xy, self.model)
        lower, _ = dtpttr(3 * len(self.xy), self.factor, uplo="L")
        white = dtrsm(1.0, lower, cross.T, side=1, lower=1, trans_a=1, overwrite_b=1).T  # by rows, without a copy
        left = height_variance(xy, self.model) - (white**2).sum(axis=0)
        return np.asarray(np.sqrt(np.maximum(left, 0.0) * max(1.0, self.surprise)))

    def bends(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return second derivatives (h_xx, h_xy, h_yy) at points of the plane and their covariance.

        Widened as `height_sd`.

        Returns:
            Shapes (m, 3) [1/m] and (m, 3, 3) [1/m^2].
        """
        cross = bend_covariance(self.xy, xy, self.model)
        mean = (self.weights @ cross).reshape(3, -1).T
        lower, _ = dtpttr(3 * len(self.xy), self.factor, uplo="L")
        white = dtrsm(1.0, lower, cross.T, side=1, lower=1, trans_a=1, overwrite_b=1).T
        known = squares(white.reshape(len(lower), 3, -1))
        return mean, np.asarray((bend_variance(self.model) - known) * max(1.0, self.surprise))
