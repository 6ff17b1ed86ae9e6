"""Identification of what a sensor carries, from static poses.

At rest and without contact, with a the specific force (up, length g) in the sensor frame, the sensor shows
    force  = bias_f - m a                   unknown: m, bias_f
    moment = bias_m + [a]x h,  h = m c      unknown: h, bias_m
(`palpate.sensing.compensation`: load = contact - m a, and a x h = -c x (m a) up to sign). Both are linear and, as
the noises of force and moment are independent, two separate least-squares problems, whose biases may drift and
jump (`palpate.sensing.ft.zero_drift`). The centre c = h/m then has the covariance
    (cov(h) + c c' var(m)) / m^2
to first order; m and h are uncorrelated.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.special import ndtri

from palpate.errors import FloatArray, InvalidValueError, not_negative
from palpate.estimation import Verdict
from palpate.sensing.compensation import SensorPayload
from palpate.sensing.ft.arrays import finite_rows, positive_entries, same_length
from palpate.sensing.ft.payload_checks import PayloadFit, payload_verdict
from palpate.sensing.ft.zero_drift import Whitened, Zero, ZeroDrift, explained, zero_in_time
from palpate.spatial import Vector, as_vector

MIN_POSES = 4
"""Three poses already determine everything; the fourth lets the residuals speak."""

MOST_POSES = 2000
"""Time and memory grow with the square; more poses than that are readings to be averaged."""

SMALLEST_SPREAD = 0.01
"""Root mean square tilt [rad] of the poses below which they count as one orientation (or one axis): the poses
themselves are known to about 1e-3 rad, which the fit takes as exact."""

STATIC_TOLERANCE = 0.05
"""Relative deviation from g at which a specific force is taken to be no pose at rest: ten times the spread of g
over the earth."""

NEIGHBOURS = 2
"""Poses on either side whose misfit may be alike."""

TWO_SIDED = float(ndtri(0.5 + 0.5 * 0.95))
"""Half-width of a 95 % interval in standard deviations (1.96)."""


@dataclass(frozen=True, slots=True, eq=False)
class IdentifiedPayload:
    """A payload with its uncertainty, in the sensor frame.

    Attributes:
        payload: Mass and centre of mass; massless when the mass is lost in the noise.
        bias_force: What the sensor shows without any load [N], on the average over the poses if it drifts.
        bias_moment: Likewise [N m].
        mass_sd: Standard deviation of the mass [kg].
        center_covariance: Of the centre of mass, shape (3, 3) [m^2]; infinite without a mass.
        bias_covariance: Of (bias_force, bias_moment), shape (6, 6) [N, N m].
        mass_by_differences: From changes between successive poses alone [kg], which no slow drift reaches.
        mass_by_differences_sd: Its standard deviation [kg].
        zero: How the zero moved, and the poses that were left out.
        zero_span_force: Largest range of the zero over the poses, of any axis [N].
        zero_span_moment: Likewise [N m].
        residuals: Of each pose, shape (n, 6) [N, N m]; of poses that were left out, how far off they are.
        force_chi2: Sum of squared force residuals in standard deviations over its degrees of freedom: about 1.
        moment_chi2: Likewise for the moment.
        force_rms: Root mean square residual of the force [N], poses that were left out not counted.
        moment_rms: Likewise of the moment [N m].
        worst_pose: The pose with the largest residual in units of the root mean square.
        condition: Ratio of the best to the worst determined component of h = m c: 1 is ideal.
        pose_count: Number of poses.
        verdict: Whether it can be relied on.
    """

    payload: SensorPayload
    bias_force: Vector
    bias_moment: Vector
    mass_sd: float
    center_covariance: FloatArray
    bias_covariance: FloatArray
    mass_by_differences: float
    mass_by_differences_sd: float
    zero: Zero
    zero_span_force: float
    zero_span_moment: float
    residuals: FloatArray
    force_chi2: float
    moment_chi2: float
    force_rms: float
    moment_rms: float
    worst_pose: int
    condition: float
    pose_count: int
    verdict: Verdict

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
    gravity_sd: float = 0.0,
) -> IdentifiedPayload:
    """Return mass, centre of mass and bias from static poses without contact.

    Args:
        specific_force: At the sensor in its frame, shape (n, 3) [m/s^2], in the order in which the poses were
            taken: at rest it points up and has length g. From an accelerometer, or `palpate.sensing.ft.poses`.
        wrench: What the sensor showed, one (averaged) row per pose, shape (n, 6) [N, N m].
        force_sd: Noise of one row's forces [N] (of the average, if it is one), without any drift.
        moment_sd: Noise of one row's moments [N m], likewise.
        gravity_sd: Standard deviation of the length of the specific force, the same for all poses [m/s^2].

    Raises:
        InvalidValueError: Wrong shapes, not finite, poses not at rest, a mass that is clearly negative (the
            sign of the wrench), or poses that leave something undetermined; the message says what.
    """
    a = finite_rows("specific_force", specific_force, 3, "m/s^2")
    rows = finite_rows("wrench", wrench, 6, "N, N m")
    same_length("specific_force", a, "wrench", rows)
    sd_f = float(positive_entries("force_sd", force_sd, 1, "N")[0])
    sd_m = float(positive_entries("moment_sd", moment_sd, 1, "N m")[0])
    not_negative("gravity_sd", gravity_sd, "m/s^2")
    n = len(a)
    if not MIN_POSES <= n <= MOST_POSES:
        raise InvalidValueError(
            f"{n} poses: give {MIN_POSES} or more, up to {MOST_POSES}, in different orientations"
        )
    _refuse_moving(a)
    condition = _refuse_singular(a)
    lever = _moment_per_first_moment(a)
    model = explained((-a[:, :, None], rows[:, :3], sd_f), (lever, rows[:, 3:], sd_m))
    force, moment, zero = model.force, model.moment, model.zero

    var_f, var_m = noise_variance(force, zero, sd_f), noise_variance(moment, zero, sd_m)
    mass = float(force.theta[0])
    mass_var = float(theta_covariance(force, var_f, zero)[0, 0])
    h, h_cov = moment.theta, theta_covariance(moment, var_m, zero)
    if mass < -_sure(mass_var):
        raise InvalidValueError(
            f"the mass comes out as {mass:.4g} +- {math.sqrt(mass_var):.1g} kg: below zero. The wrench must be "
            "what acts on the sensor's tip side, and the specific force must point up at rest; one of them has "
            "the wrong sign"
        )
    zero_f, left_f = zero_in_time(force, -a[:, :, None], rows[:, :3], zero)
    zero_m, left_m = zero_in_time(moment, lever, rows[:, 3:], zero)
    good = np.setdiff1d(np.arange(n), zero.bad)
    mean_a = a[good].mean(axis=0)
    if mass > _sure(mass_var):
        center = h / mass
        payload = SensorPayload(mass, as_vector(center))
        center_cov = (h_cov + mass_var * np.outer(center, center)) / mass**2
    else:
        # the mass may still be what was found: that is what "none" is uncertain by
        payload, center_cov = SensorPayload(), np.full((3, 3), np.inf)
        mass_var += mass**2
    bias_cov = _bias_covariance(mean_a, mass_var, h_cov, max(var_f, sd_f**2), max(var_m, sd_m**2), len(good))
    residuals = np.hstack([left_f, left_m])
    for array in (center_cov, bias_cov, residuals):
        array.setflags(write=False)
    g = float(np.median(np.linalg.norm(a, axis=1)))
    difference, difference_var = _by_differences(a[good], rows[good, :3])
    mass_sd = math.hypot(math.sqrt(mass_var), payload.mass * gravity_sd / g)
    rms_f, rms_m = (math.sqrt(float((left[good] ** 2).mean())) for left in (left_f, left_m))
    return IdentifiedPayload(
        payload=payload,
        bias_force=as_vector(zero_f[good].mean(axis=0)),
        bias_moment=as_vector(zero_m[good].mean(axis=0)),
        mass_sd=mass_sd,
        center_covariance=center_cov,
        bias_covariance=bias_cov,
        mass_by_differences=difference,
        mass_by_differences_sd=math.sqrt(difference_var),
        zero=zero,
        zero_span_force=float(np.ptp(zero_f[good], axis=0).max()),
        zero_span_moment=float(np.ptp(zero_m[good], axis=0).max()),
        residuals=residuals,
        force_chi2=force.variance / sd_f**2,
        moment_chi2=moment.variance / sd_m**2,
        force_rms=rms_f,
        moment_rms=rms_m,
        worst_pose=int(
            np.argmax(
                (left_f**2).sum(axis=1) / max(rms_f, 1e-300) ** 2
                + (left_m**2).sum(axis=1) / max(rms_m, 1e-300) ** 2
            )
        ),
        condition=condition,
        pose_count=n,
        verdict=payload_verdict(
            PayloadFit(
                model,
                g,
                condition,
                mass,
                mass_var,
                difference,
                difference_var,
                sd_f,
                sd_m,
            )
        ),
    )


def _sure(variance: float) -> float:
    """Four standard deviations: beyond, a number has its sign for sure (1 in 16 000)."""
    return 4.0 * math.sqrt(variance)


def noise_variance(fit: Whitened, zero: Zero, given: float) -> float:
    """Return the variance of the white noise: as given, or as found where the zero takes its share of it."""
    return fit.variance + fit.floor / fit.freedom if zero.moves else given**2


def theta_covariance(fit: Whitened, variance: float, zero: Zero) -> FloatArray:
    """Return the covariance of a regression's unknowns, larger where a drift is not quite as its model has it."""
    values, vectors = np.linalg.eigh(fit.information)
    # what the zero took away altogether is not determined: finite, that sums stay numbers
    root = vectors / np.sqrt(np.maximum(values, 1e-12))
    larger = 1.0 if zero.drift is ZeroDrift.NONE else _uneven(fit.scores() @ root) / max(variance, 1e-300)
    return np.asarray(max(1.0, larger) * variance * root @ root.T)


def _uneven(scores: FloatArray) -> float:
    """Return the variance that scores of shape (n, p), of unit information, show in their worst direction.

    Newey & West (1987): a drift that is not as its model has it misses some poses by more, and neighbours alike.
    """
    total = scores.T @ scores
    for lag in range(1, NEIGHBOURS + 1):
        shared = (1.0 - lag / (NEIGHBOURS + 1)) * scores[lag:].T @ scores[:-lag]
        total = total + shared + shared.T
    return float(np.linalg.eigvalsh(total)[-1])


def _moment_per_first_moment(a: FloatArray) -> FloatArray:
    """Return [a]x of each pose, shape (n, 3, 3): moment = [a]x h."""
    return np.cross(a[:, None, :], np.eye(3)[None, :, :]).transpose(0, 2, 1)


def _by_differences(a: FloatArray, force: FloatArray) -> tuple[float, float]:
    """Return the mass from changes between successive poses, and its variance."""
    da, df = np.diff(a, axis=0), np.diff(force, axis=0)
    energy = float((da**2).sum())
    mass = -float((da * df).sum()) / energy
    left = df + mass * da
    # successive differences share a pose: the sum of da' left has the variance of its terms and of neighbours
    terms = (da * left).sum(axis=1)
    variance = float((left**2).sum()) / max(left.size - 1, 1) * energy
    shared = float((terms**2).sum() + 2.0 * (terms[1:] * terms[:-1]).sum())
    return mass, max(variance, shared) / energy**2


def _bias_covariance(
    mean_a: FloatArray, mass_var: float, h_cov: FloatArray, var_f: float, var_m: float, n: int
) -> FloatArray:
    x, y, z = mean_a
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    covariance = np.zeros((6, 6))
    covariance[:3, :3] = var_f / n * np.eye(3) + mass_var * np.outer(mean_a, mean_a)
    covariance[3:, 3:] = var_m / n * np.eye(3) + cross @ h_cov @ cross.T
    return covariance


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


def _refuse_singular(a: FloatArray) -> float:
    """Return the condition number of the problem for h; raise if something cannot be distinguished."""
    g = float(np.median(np.linalg.norm(a, axis=1)))
    s, vt = np.linalg.svd(a - a.mean(axis=0), full_matrices=False)[1:]
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
