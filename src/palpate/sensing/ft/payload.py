"""Identification of what a sensor carries, from static poses.

At rest and without contact, with a the specific force (up, length g) in the sensor frame, the sensor shows
    force  = bias_f - m a                   unknown: m, bias_f
    moment = bias_m + [a]x h,  h = m c      unknown: h, bias_m
(`palpate.sensing.compensation`: load = contact - m a, and a x h = -c x (m a) up to sign). Both are linear and, as
the noises of force and moment are independent, two separate least-squares problems, solved by SVD after
subtraction of the means, which takes the biases out. The centre c = h/m then has the covariance
    (cov(h) + c c' var(m)) / m^2
to first order; m and h are uncorrelated.
"""

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt
from scipy.special import chdtrc, ndtri

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.arrays import finite_rows, positive_entries, same_length
from palpate.spatial import Vector, as_vector

MIN_POSES = 4
"""Three poses already determine everything; the fourth lets the residuals speak."""

SMALLEST_SPREAD = 0.01
"""Root mean square tilt [rad] of the poses below which they count as one orientation (or one axis): the poses
themselves are known to about 1e-3 rad, which the fit takes as exact."""

STATIC_TOLERANCE = 0.05
"""Relative deviation from g at which a specific force is taken to be no pose at rest: ten times the spread of g
over the earth."""

TWO_SIDED = float(ndtri(0.5 + 0.5 * 0.95))
"""Half-width of a 95 % interval in standard deviations (1.96)."""

INCONSISTENT_PROBABILITY = 1e-4
"""Residuals that noise would explain more rarely than this are held against the model."""


class PayloadStatus(IntEnum):
    """Whether an identified payload can be relied on."""

    OK = 0
    """Determined, and the residuals are what the noise explains."""
    UNRESOLVED = 1
    """The mass is lost in the noise: there is nothing to compensate, and no centre of mass to speak of."""
    INCONSISTENT = 2
    """The residuals are larger than the noise explains: contact or cable forces, motion, wrong poses, or a noise
    given too small. The intervals are then too narrow."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedPayload:
    """A payload with its uncertainty, in the sensor frame.

    Attributes:
        payload: Mass and centre of mass; massless when `status` is UNRESOLVED.
        bias_force: What the sensor shows without any load [N].
        bias_moment: Likewise [N m].
        mass_sd: Standard deviation of the mass [kg].
        center_covariance: Of the centre of mass, shape (3, 3) [m^2]; infinite when UNRESOLVED.
        bias_covariance: Of (bias_force, bias_moment), shape (6, 6) [N, N m].
        force_chi2: Sum of squared force residuals in standard deviations over its degrees of freedom: about 1.
        moment_chi2: Likewise for the moment.
        force_rms: Root mean square residual of the force [N].
        moment_rms: Likewise of the moment [N m].
        condition: Ratio of the best to the worst determined component of h = m c: 1 is ideal.
        pose_count: Number of poses used.
        status: See `PayloadStatus`.
    """

    payload: SensorPayload
    bias_force: Vector
    bias_moment: Vector
    mass_sd: float
    center_covariance: FloatArray
    bias_covariance: FloatArray
    force_chi2: float
    moment_chi2: float
    force_rms: float
    moment_rms: float
    condition: float
    pose_count: int
    status: PayloadStatus

    @property
    def center_sd(self) -> FloatArray:
        """Standard deviation of the centre of mass along each axis, shape (3,) [m]."""
        return np.sqrt(np.diag(self.center_covariance))


def identify_payload(
    specific_force: npt.ArrayLike,
    wrench: npt.ArrayLike,
    *,
    force_sd: float,
    moment_sd: float,
) -> IdentifiedPayload:
    """Return mass, centre of mass and bias from static poses without contact.

    Args:
        specific_force: At the sensor in its frame, shape (n, 3) [m/s^2]: at rest it points up and has length
            g. From an accelerometer, or `palpate.sensing.ft.poses`.
        wrench: What the sensor showed, one (averaged) row per pose, shape (n, 6) [N, N m].
        force_sd: Noise of one row's forces [N] (of the average, if it is one).
        moment_sd: Noise of one row's moments [N m].

    Raises:
        InvalidValueError: Wrong shapes, not finite, poses not at rest, a mass that is clearly negative (the
            sign of the wrench), or poses that leave something undetermined; the message says what.
    """
    a = finite_rows("specific_force", specific_force, 3, "m/s^2")
    rows = finite_rows("wrench", wrench, 6, "N, N m")
    same_length("specific_force", a, "wrench", rows)
    sd_f = float(positive_entries("force_sd", force_sd, 1, "N")[0])
    sd_m = float(positive_entries("moment_sd", moment_sd, 1, "N m")[0])
    if len(a) < MIN_POSES:
        raise InvalidValueError(f"{len(a)} poses: give {MIN_POSES} or more, in different orientations")
    _refuse_moving(a)
    mean_a, mean_w = a.mean(axis=0), rows.mean(axis=0)
    da, dw = a - mean_a, rows - mean_w
    condition = _refuse_singular(a, da)

    mass, mass_var = _mass(da, dw[:, :3], sd_f)
    if mass < -_sure(mass_var):
        raise InvalidValueError(
            f"the mass comes out as {mass:.4g} +- {math.sqrt(mass_var):.1g} kg: below zero. The wrench must be "
            "what acts on the sensor's tip side, and the specific force must point up at rest; one of them has "
            "the wrong sign"
        )
    h, h_cov = _first_moment(da, dw[:, 3:], sd_m)
    bias_f = mean_w[:3] + mass * mean_a
    bias_m = mean_w[3:] - np.cross(mean_a, h)
    residual_f = dw[:, :3] + mass * da
    residual_m = dw[:, 3:] - np.cross(da, h)
    n = len(a)
    chi_f, fits_f = _chi2(residual_f / sd_f, 3 * n - 4)
    chi_m, fits_m = _chi2(residual_m / sd_m, 3 * n - 6)
    if mass <= _sure(mass_var):
        payload, center_cov, status = SensorPayload(), np.full((3, 3), np.inf), PayloadStatus.UNRESOLVED
    else:
        center = h / mass
        center_cov = (h_cov + mass_var * np.outer(center, center)) / mass**2
        payload = SensorPayload(mass, as_vector(center))
        status = PayloadStatus.OK
    if not (fits_f and fits_m):
        status = PayloadStatus.INCONSISTENT
    center_cov.setflags(write=False)
    return IdentifiedPayload(
        payload=payload,
        bias_force=as_vector(bias_f),
        bias_moment=as_vector(bias_m),
        mass_sd=math.sqrt(mass_var),
        center_covariance=center_cov,
        bias_covariance=_bias_covariance(mean_a, mass_var, h_cov, sd_f, sd_m, n),
        force_chi2=chi_f,
        moment_chi2=chi_m,
        force_rms=float(np.sqrt((residual_f**2).mean())),
        moment_rms=float(np.sqrt((residual_m**2).mean())),
        condition=condition,
        pose_count=n,
        status=status,
    )


def _sure(variance: float) -> float:
    """Four standard deviations: beyond, a number has its sign for sure (1 in 16 000)."""
    return 4.0 * math.sqrt(variance)


def _mass(da: FloatArray, df: FloatArray, sd: float) -> tuple[float, float]:
    """Solve df = -m da for m; return it and its variance."""
    energy = float((da**2).sum())
    return -float((da * df).sum()) / energy, sd**2 / energy


def _first_moment(da: FloatArray, dm: FloatArray, sd: float) -> tuple[FloatArray, FloatArray]:
    """Solve dm = [da]x h for h; return it and its covariance."""
    stacked = np.cross(da[:, None, :], np.eye(3)[None, :, :]).transpose(0, 2, 1).reshape(-1, 3)
    u, s, vt = np.linalg.svd(stacked, full_matrices=False)
    spread = vt.T / s
    return spread @ (u.T @ dm.ravel()), sd**2 * (spread @ spread.T)


def _bias_covariance(
    mean_a: FloatArray, mass_var: float, h_cov: FloatArray, sd_f: float, sd_m: float, n: int
) -> FloatArray:
    x, y, z = mean_a
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = sd_f**2 / n * np.eye(3) + mass_var * np.outer(mean_a, mean_a)
    covariance[3:, 3:] = sd_m**2 / n * np.eye(3) + cross @ h_cov @ cross.T
    covariance.setflags(write=False)
    return covariance


def _chi2(residual_in_sd: FloatArray, freedom: int) -> tuple[float, bool]:
    total = float((residual_in_sd**2).sum())
    return total / freedom, bool(chdtrc(freedom, total) >= INCONSISTENT_PROBABILITY)


def _refuse_moving(a: FloatArray) -> None:
    length = np.linalg.norm(a, axis=1)
    typical = float(np.median(length))
    if not 9.0 < typical < 10.5:
        raise InvalidValueError(
            f"specific_force has length {typical:.4g}: at rest it is g, about 9.81 m/s^2; unit vectors become "
            "so by palpate.sensing.ft.specific_force_from_gravity"
        )
    worst = int(np.argmax(np.abs(length - typical)))
    if abs(length[worst] - typical) > STATIC_TOLERANCE * typical:
        raise InvalidValueError(
            f"specific_force[{worst}] has length {length[worst]:.4g} m/s^2, the others {typical:.4g}: pose "
            f"{worst} is not at rest (limit {100 * STATIC_TOLERANCE:.0f} %); wait until the arm stands still"
        )


def _refuse_singular(a: FloatArray, da: FloatArray) -> float:
    """Return the condition number of the problem for h; raise if something cannot be distinguished."""
    g = float(np.median(np.linalg.norm(a, axis=1)))
    s, vt = np.linalg.svd(da, full_matrices=False)[1:]
    tilt = s / (g * math.sqrt(len(a)))
    if tilt[0] < SMALLEST_SPREAD:
        raise InvalidValueError(
            f"all {len(a)} poses have the same direction of gravity in the sensor (they differ by {tilt[0]:.1e} "
            f"rad RMS, {SMALLEST_SPREAD} is needed; turning about the vertical changes nothing): the weight "
            "cannot be distinguished from the force bias, nor mass * centre from the moment bias. Tilt the "
            "sensor, best onto all six sides"
        )
    if tilt[1] < SMALLEST_SPREAD:
        axis = ", ".join(f"{x:.2f}" for x in vt[0])
        raise InvalidValueError(
            f"gravity changes only along ({axis}) of the sensor frame, in all {len(a)} poses: the centre of mass "
            "along that direction cannot be distinguished from the moment bias. Add a pose tilted about "
            "another axis"
        )
    # The information on h is sum |da|^2 I - da da' = V diag(sum s^2 - s_i^2) V'.
    information = (s**2).sum() - s**2
    return float(np.sqrt(information.max() / information.min()))
