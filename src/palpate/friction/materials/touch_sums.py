"""Accumulated evidence of the touches of one object, for each material of a library.

Touch i of material k says y_i = H_i (theta_k + delta + s_i) + v_i: theta_k the library's ln mu, ln c, gamma and p,
delta ~ N(0, B_k) what is particular to this specimen and to the sensor's calibration, the same in all touches,
s_i ~ N(0, S_k) the scatter from touch to touch, v_i ~ N(0, R_i) the measurement. With C_i = H_i S_k H_i' + R_i and
residuals r_i = y_i - H_i theta_k, everything follows from four sums over the touches, in whatever order:

    P = sum H' C^-1 H,   q = sum H' C^-1 r,   s = sum r' C^-1 r,   d = sum ln|2 pi C|,
    ln L = -1/2 (d + s + ln|I + B P| - q' (I + B P)^-1 B q),   delta ~ N((I + B P)^-1 B q, (I + B P)^-1 B).

Of touches that never slipped only the one that tells most counts for each material: holding the same again is no
new evidence.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc, log_ndtr

from palpate.errors import FloatArray
from palpate.friction.materials.library import MaterialLibrary
from palpate.friction.materials.material import PARAMETERS
from palpate.friction.materials.touch_evidence import NeverSlipped, TouchEvidence

STRANGER_DEVIATIONS = (1.0, 1.0, 0.15, 0.4)
"""Of ln mu, ln c, gamma and p of surfaces in general, about the library's middle: mu 0.1 to 1.2 and e 1 to 8 mm
lie within 1.3 of them about their middles, and so do gamma and p about theirs."""

_SINGULAR = 1e-9
"""Eigenvalues of what the touches tell, over the largest once every parameter has a scale of 1, taken for 0."""

_MIN_VARIANCE = 1e-18
"""Of a touch, where neither sensor nor surface have any [square of a relative error]."""


@dataclass(frozen=True, slots=True, eq=False)
class Known:
    """What would be known of this specimen if it were of a certain material; k materials, the last a stranger.

    The stranger is any surface at all: centred on the library's middle, of `STRANGER_DEVIATIONS`.

    Attributes:
        mean: ln mu_k, ln c, gamma, p of the specimen, shape (k, 4).
        covariance: Of the same, shape (k, 4, 4).
        scatter: Of a touch about them, variances, shape (k, 4).
        log_likelihood: Of all touches, shape (k,).
    """

    mean: FloatArray
    covariance: FloatArray
    scatter: FloatArray
    log_likelihood: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class TouchSums:
    """Sums over the touches; k materials, the last a stranger.

    Attributes:
        theta: ln mu_k, ln c, gamma, p as the library has them, shape (k, 4).
        specimen: B, variances, shape (k, 4).
        scatter: S, variances, shape (k, 4).
        P: Shape (k, 4, 4).
        q: Shape (k, 4).
        s: Shape (k,).
        d: Shape (k,).
        values: n, how many logarithms were measured.
        bounds: Touches that never slipped, and ln of static over kinetic mu, shape (k,).
    """

    theta: FloatArray
    specimen: FloatArray
    scatter: FloatArray
    P: FloatArray
    q: FloatArray
    s: FloatArray
    d: FloatArray
    values: int
    bounds: tuple[tuple[NeverSlipped, FloatArray], ...]

    @classmethod
    def of(
        cls, library: MaterialLibrary, calibration: float, touches: Sequence[TouchEvidence | NeverSlipped]
    ) -> "TouchSums":
        """Return the sums over touches of one object.

        Args:
            library: Of materials.
            calibration: Standard deviation of the sensor's error that all touches share, relative.
            touches: In any order.
        """
        materials = library.materials
        theta = np.array([material.parameters for material in materials])
        scatter = np.array([material.scatter.variances for material in materials])
        shared = calibration**2 * np.array([1.0, 1.0, 0.0, 0.0])
        specimen = np.array([material.specimen.variances for material in materials]) + shared
        theta = np.vstack([theta, np.median(theta, axis=0)])
        scatter = np.vstack([scatter, np.median(scatter, axis=0)])
        specimen = np.vstack([specimen, np.square(STRANGER_DEVIATIONS)])
        k = len(theta)
        P, q, s, d = np.zeros((k, PARAMETERS, PARAMETERS)), np.zeros((k, PARAMETERS)), np.zeros(k), np.zeros(k)
        count, bounds = 0, []
        still = speed_shifts(library, 0.0, 0.0, 1.0)
        shifts: dict[tuple[float, float, float], FloatArray] = {}
        for touch in touches:
            if isinstance(touch, NeverSlipped):
                bounds.append((touch, still))
                continue
            moving = touch.speed, touch.spin, touch.normal_force
            if moving not in shifts:
                shifts[moving] = speed_shifts(library, *moving)
            H = touch.rows
            C = np.einsum("ma,ka,na->kmn", H, scatter, H) + touch.covariance
            C = C + _MIN_VARIANCE * np.eye(len(H))
            r = touch.values - theta @ H.T - np.outer(shifts[moving], H[:, 0])
            stacked = np.concatenate([np.broadcast_to(H, (k, *H.shape)), r[:, :, None]], axis=2)
            whitened = np.linalg.solve(C, stacked)
            P += H.T @ whitened[:, :, :-1]
            q += whitened[:, :, -1] @ H
            s += (r * whitened[:, :, -1]).sum(axis=1)
            d += np.linalg.slogdet(2.0 * math.pi * C)[1]
            count += len(H)
        return cls(theta, specimen, scatter, P, q, s, d, count, tuple(bounds))

    def known(self) -> Known:
        """Return what is known of the specimen, for each material and a stranger."""
        eye = np.eye(PARAMETERS)
        B = self.specimen[:, :, None] * eye
        I_BP = eye + B @ self.P
        both = np.linalg.solve(I_BP, np.concatenate([B, (self.specimen * self.q)[:, :, None]], axis=2))
        covariance, delta = both[:, :, :-1], both[:, :, -1]
        covariance = 0.5 * (covariance + covariance.transpose(0, 2, 1))
        logdet = np.linalg.slogdet(I_BP)[1]
        log_likelihood = -0.5 * (self.d + self.s + logdet - (self.q * delta).sum(axis=1))
        mean = self.theta + delta
        passed = self._bounds_passed(mean, covariance)
        return Known(mean, covariance, self.scatter, log_likelihood + passed.min(axis=0, initial=0.0))

    def fit(self) -> FloatArray:
        """Return the p-value of each material and of a stranger, shape (k,).

        If the material is k,

            q' (P + P B P)^+ q ~ chi^2 of rank P         do the touches together lie where the material does?
            s - q' P^+ q       ~ chi^2 of n - rank P     do they scatter as its touches do?

        and a bound is passed with the probability that one touch bears so much. The least of them times their
        number (Bonferroni): below any level at most as often as that level.
        """
        p_values = []
        eigenvalues, vectors, scale = _scaled_eigen(self.P)
        determined = eigenvalues > _SINGULAR * eigenvalues.max(axis=1, initial=0.0, keepdims=True)
        rank = determined.sum(axis=1)
        # in the eigenvectors' coordinates P is diagonal; B is taken there too
        inverse = np.where(determined, 1.0 / np.where(determined, eigenvalues, 1.0), 0.0)
        estimate = inverse * np.einsum("kab,ka->kb", vectors, self.q * scale)
        turned = vectors / scale[:, :, None]
        B = np.einsum("kab,ka,kac->kbc", turned, self.specimen, turned)
        both = determined[:, :, None] & determined[:, None, :]
        spread = np.where(both, B, 0.0) + np.where(determined, inverse, 1.0)[:, :, None] * np.eye(PARAMETERS)
        place = (estimate * np.linalg.solve(spread, estimate[:, :, None])[:, :, 0]).sum(axis=1)
        if self.values:
            p_values.append(chdtrc(rank, place))
        spare = self.values - rank
        if (spare > 0).any():
            rest = np.maximum(self.s - (estimate**2 * np.where(determined, eigenvalues, 0.0)).sum(axis=1), 0.0)
            p_values.append(np.where(spare > 0, chdtrc(np.maximum(spare, 1), rest), 1.0))
        passed = self._bounds_passed(self.theta, self.specimen[:, :, None] * np.eye(PARAMETERS))
        if len(passed):
            p_values.append(np.minimum(1.0, len(passed) * np.exp(passed.min(axis=0))))
        if not p_values:
            return np.ones(len(self.theta))
        return np.asarray(np.minimum(1.0, len(p_values) * np.min(p_values, axis=0)))

    def _bounds_passed(self, mean: FloatArray, covariance: FloatArray) -> FloatArray:
        """Log of the probability that a touch bears what was borne, for every bound and material."""
        passed = np.zeros((len(self.bounds), len(mean)))
        for i, (bound, shift) in enumerate(self.bounds):
            h = np.array(bound.row)
            spread = np.einsum("a,kab,b->k", h, covariance, h) + self.scatter @ h**2
            passed[i] = log_ndtr((mean @ h + shift - bound.least) / np.sqrt(spread))
        return passed


def _scaled_eigen(P: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Eigenvalues and vectors of D P D, whose diagonal is 1 or 0, and D."""
    diagonal = np.diagonal(P, axis1=1, axis2=2)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))
    eigenvalues, vectors = np.linalg.eigh(P * scale[:, :, None] * scale[:, None, :])
    return np.asarray(eigenvalues), np.asarray(vectors), scale


def speed_shifts(library: MaterialLibrary, speed: float, spin: float, normal_force: float) -> FloatArray:
    """Return ln of mu at a slip over the kinetic one, for every material and a stranger (0), shape (k + 1,).

    Args:
        library: Of materials.
        speed: Of the slip along the surface [m/s].
        spin: About the normal [rad/s].
        normal_force: At which it spins [N].
    """
    slips = (math.hypot(speed, m.spin_length_at(normal_force) * spin) for m in library.materials)
    mu = [m.friction_at(slip) / m.kinetic_friction for m, slip in zip(library.materials, slips, strict=True)]
    shifts: npt.NDArray[np.float64] = np.log([*mu, 1.0])
    return shifts
