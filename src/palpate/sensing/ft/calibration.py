"""The calibration of a multi-axis force/torque sensor, by least squares from known loads.

The loads are known well and the k channels are noisy, so what is fitted is the sensor itself,
    raw = S wrench + offset + noise,                                        (S: k x 6)
and the calibration matrix is the generalised inverse of S, C = (S'PS)^-1 S'P with P the inverse variances of the
channels. (Fitting wrench = C raw directly shrinks C by the noise of the raw channels, and has no unique solution
when k > 6 channels carry little noise.) S is solved by QR of centred loads in units of the sensor's ranges, so
that newtons and newton metres compare.

The condition number of S in those units is the figure of merit of sensor design (Uchiyama, Bayo & Palma-Villalon
1991, J. Dyn. Sys. Meas. Control 113; Bicchi 1992, IEEE Trans. Robotics and Automation 8): it bounds by how much a
relative error of the channels grows in the wrench.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Verdict
from palpate.sensing.ft.arrays import AXES, finite_rows, positive_entries, same_length
from palpate.sensing.ft.calibration_checks import UNKNOWNS, FittedCalibration, calibration_verdict
from palpate.sensing.ft.calibration_map import CalibrationMap
from palpate.sensing.ft.left_out import equal_loads, grouped, solved_left_out

MIN_LOADS = UNKNOWNS + 1
"""One more than unknowns, so that the residuals tell something."""

SMALLEST_EXCITATION = 0.01
"""Root mean square of the loads in a direction, in units of the range, below which it counts as not loaded:
weights and levers on a bench are known to about a thousandth."""

LARGEST_LEVERAGE = 1.0 - 1e-6
"""Beyond, one load alone decides about a direction, and no other checks it."""

FELT = 2.0
"""Standard errors by which the response of a sensor in any direction must differ from none; see also
`calibration_checks.SURE`."""

SMALLEST_NOISE = 1e-6
"""Noise of a channel relative to its response, as weights are concerned: that of 20 bits."""


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationFit:
    """A fitted calibration and what is to be thought of it. Axes are Fx Fy Fz Mx My Mz, in N and N m.

    Attributes:
        model: How it was found.
        map: From raw channels to the wrench.
        sensitivity: S, what the channels show per load, shape (k, 6).
        condition: Condition number of S in units of the ranges: 1 is ideal.
        felt: Standard errors by which the response to the weakest direction of load differs from none.
        load_condition: Condition number of the set of loads, likewise: how evenly they excite the sensor.
        loads: The known loads, shape (n, 6).
        residual: Predicted minus known, shape (n, 6).
        left_out: Likewise, each load predicted by a calibration from the others, none of its group: the honest
            error, shape (n, 6).
        matrix_sd: Standard errors of the entries of the calibration matrix, given how channels are weighted where
            there are more than six, with n - 7 degrees of freedom (Student's t), shape (6, k).
        noise: Covariance of one measured wrench from what the model leaves unexplained, shape (6, 6).
        leverage: By which factor of `noise` the calibration's own uncertainty moves a wrench of shape (6,).
        doubt: Standard deviation by which the calibration is off at full range, in units of the range, shape (6,).
        verdict: Whether it can be relied on.
    """

    model: str
    map: CalibrationMap
    sensitivity: FloatArray
    condition: float
    felt: float
    load_condition: float
    loads: FloatArray
    residual: FloatArray
    left_out: FloatArray
    matrix_sd: FloatArray
    noise: FloatArray
    leverage: Callable[[FloatArray], float]
    doubt: FloatArray
    verdict: Verdict

    @property
    def load_count(self) -> int:
        """Number of known loads used."""
        return len(self.loads)

    @property
    def residual_rms(self) -> FloatArray:
        """Root mean square of predicted minus known wrench, shape (6,)."""
        return np.asarray(np.sqrt((self.residual**2).mean(axis=0)))

    @property
    def residual_max(self) -> FloatArray:
        """Largest of them in size, shape (6,)."""
        return np.asarray(np.abs(self.residual).max(axis=0))

    @property
    def left_out_rms(self) -> FloatArray:
        """Root mean square error of loads that were left out, shape (6,)."""
        return np.asarray(np.sqrt((self.left_out**2).mean(axis=0)))

    @property
    def r_squared(self) -> FloatArray:
        """Share of the known loads' variance that is explained, per axis, shape (6,)."""
        spread = self.loads - self.loads.mean(axis=0)
        return np.asarray(1.0 - (self.residual**2).sum(axis=0) / (spread**2).sum(axis=0))

    def apply(self, raw: npt.ArrayLike) -> FloatArray:
        """Return the wrenches, shape (n, 6), of readings of shape (n, k)."""
        return self.map.apply(raw)

    def calibration_covariance(self, wrench: npt.ArrayLike) -> FloatArray:
        """Return the covariance that the calibration's own uncertainty adds to a measured wrench, shape (6, 6).

        To first order: C (S + dS) w = w + C dS w, and cov(dS w + d offset) = x'(X'X)^-1 x cov(raw), x = (w, 1).
        """
        w = finite_rows("wrench", np.atleast_2d(np.asarray(wrench)), 6, "N, N m")[0]
        return np.asarray(self.leverage(w) * self.noise)


def fit_calibration(
    raw: npt.ArrayLike,
    wrench: npt.ArrayLike,
    *,
    ranges: npt.ArrayLike,
    weights: npt.ArrayLike = 1.0,
    groups: npt.ArrayLike | None = None,
) -> CalibrationFit:
    """Return the calibration of a sensor from readings under known loads.

    Args:
        raw: Readings of k >= 6 channels, all in one unit, shape (n, k), n >= 8.
        wrench: The known loads, on the sensor's tip side about its origin, shape (n, 6) [N, N m].
        ranges: Of the sensor, shape (6,) [N, N m]: the scale by which forces and moments compare.
        weights: Of the loads, shape (n,): 1/variance of a row's readings, up to a factor.
        groups: Which rows are left out together, shape (n,): equal numbers for one load that was put on several
            times. None: those of equal loads (see `equal_loads`).

    Raises:
        InvalidValueError: Wrong shapes, not finite, loads that do not span all directions (the missing one is
            named), or a sensor that does not respond in some direction.
    """
    readings = finite_rows("raw", raw, None, "raw unit")
    loads = finite_rows("wrench", wrench, 6, "N, N m")
    same_length("raw", readings, "wrench", loads)
    scale = positive_entries("ranges", ranges, 6, "N, N m")
    n, k = readings.shape
    if k < 6:
        raise InvalidValueError(f"raw has {k} channels: six loads cannot be distinguished by fewer than 6")
    if n < MIN_LOADS:
        raise InvalidValueError(f"{n} loads: give {MIN_LOADS} or more ({UNKNOWNS} unknowns per channel)")
    root = np.sqrt(positive_entries("weights", weights, n, ""))[:, None]
    root = root / np.sqrt((root**2).mean())

    mean = (root**2 * loads).sum(axis=0) / n
    load_condition = _refuse_unloaded(root * (loads - mean) / scale)
    design = root * np.column_stack([(loads - mean) / scale, np.ones(n)])
    q, r = np.linalg.qr(design)
    leverage = (q**2).sum(axis=1)
    if leverage.max() > LARGEST_LEVERAGE:
        worst = int(np.argmax(leverage))
        raise InvalidValueError(
            f"load {worst}, {_wrench_text(loads[worst])}, is the only one of its direction and unchecked; load "
            "that direction again, best with the opposite sign"
        )
    inverse = np.linalg.inv(r)
    # The readings' means come out first: offsets are often much larger than the response.
    typical = readings.mean(axis=0)
    coefficients = inverse @ (q.T @ (root * (readings - typical)))
    residual = root * (readings - typical) - design @ coefficients
    covariance = residual.T @ residual / (n - UNKNOWNS)
    sd = np.sqrt(np.diag(covariance))
    spread = inverse @ inverse.T
    rounding = SMALLEST_NOISE * np.linalg.norm(coefficients[:6])
    noisy = sd > rounding
    weight = 1.0 / np.maximum(sd, rounding)
    condition, felt = _refuse_unfelt(coefficients[:6].T, weight, spread[:6, :6])

    C, offset = _inverted(coefficients, weight, mean, scale)
    missed = (readings - typical - offset) @ C.T - loads
    left_out = np.empty_like(loads)
    for group in grouped(equal_loads(loads) if groups is None else np.asarray(groups)):
        # Leaving out rows is a change of low rank (Sherman, Morrison, Woodbury).
        kept = np.eye(len(group)) - q[group] @ q[group].T
        without = coefficients - spread @ design[group].T @ solved_left_out(kept, residual[group])
        C_i, offset_i = _inverted(without, weight, mean, scale)
        left_out[group] = (readings[group] - typical - offset_i) @ C_i.T - loads[group]
    wrench_part = C @ covariance @ C.T
    doubt = np.sqrt(np.diag(wrench_part)) / scale * np.sqrt(np.diag(spread)[:6].max())
    # To (wrench, 1) from ((wrench - mean)/scale, 1).
    unscale = np.diag([*(1.0 / scale), 1.0])
    unscale[:6, 6] = -mean / scale
    load_covariance = unscale.T @ spread @ unscale
    channel_part = C.T @ load_covariance[:6, :6] @ C
    matched = np.where(noisy, weight, 0.0)[:, None] ** 2 * coefficients[:6].T
    linear = readings - residual / root
    names = tuple(f"channel {j}" for j in range(k))
    tested = FittedCalibration(
        loads,
        scale,
        readings,
        linear,
        q,
        root,
        linear,
        residual,
        names,
        np.empty((n, 0)),
        (),
        noisy,
        matched,
        left_out,
        doubt,
        condition,
        felt,
    )

    def of_wrench(wrench: FloatArray) -> float:
        x = np.append(wrench, 1.0)
        return float(x @ load_covariance @ x)

    return CalibrationFit(
        model="sensor model",
        map=CalibrationMap(tuple(map(tuple, C.tolist())), tuple((offset + typical).tolist())),
        sensitivity=coefficients[:6].T / scale,
        condition=condition,
        felt=felt,
        load_condition=load_condition,
        loads=loads,
        residual=missed,
        left_out=left_out,
        # dC = -C dS C to first order.
        matrix_sd=np.sqrt(np.outer(np.diag(wrench_part), np.diag(channel_part))),
        noise=wrench_part,
        leverage=of_wrench,
        doubt=doubt,
        verdict=calibration_verdict(tested),
    )


def _inverted(
    coefficients: FloatArray, weight: FloatArray, mean: FloatArray, scale: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return C and the readings at zero load, from the fit in scaled, centred loads."""
    scaled = weight[:, None] * coefficients[:6].T
    q, r = np.linalg.qr(scaled)
    C = scale[:, None] * np.linalg.solve(r, q.T * weight)
    return C, coefficients[6] - (mean / scale) @ coefficients[:6]


def _refuse_unloaded(scaled: FloatArray) -> float:
    """Return the condition number of the set of loads; raise if a direction is not loaded."""
    singular, directions = np.linalg.svd(scaled, full_matrices=False)[1:]
    excitation = singular / np.sqrt(len(scaled))
    if excitation[-1] < SMALLEST_EXCITATION:
        missing = "; ".join(
            _direction_text(v) for v, e in zip(directions, excitation, strict=True) if e < SMALLEST_EXCITATION
        )
        raise InvalidValueError(
            f"the {len(scaled)} loads do not vary in {missing} (in units of the ranges; {excitation[-1]:.1e} RMS, "
            f"{SMALLEST_EXCITATION} is needed): what the sensor shows for it cannot be distinguished from "
            "other loads or the offset. Add loads in that direction, of both signs"
        )
    return float(singular[0] / singular[-1])


def _refuse_unfelt(sensitivity: FloatArray, weight: FloatArray, spread: FloatArray) -> tuple[float, float]:
    """Return the condition number of the sensor, and how surely it responds; raise if not in some direction."""
    # In units of each channel's noise, whose uncertainty is sqrt(v' spread v) in every direction of the channels.
    response, directions = np.linalg.svd(weight[:, None] * sensitivity)[1:]
    weakest = directions[-1]
    error = float(np.sqrt(weakest @ spread @ weakest))
    if not response[-1] > FELT * error:
        raise InvalidValueError(
            f"the channels hardly respond to {_direction_text(weakest)} (in units of the ranges): "
            f"{response[-1]:.1e} times their noise, uncertain by {error:.1e}. "
            "Is a channel dead, or are two wired to one gauge?"
        )
    singular = np.linalg.svd(sensitivity, compute_uv=False)
    return float(singular[0] / singular[-1]), float(response[-1]) / max(error, 1e-300)


def _direction_text(direction: FloatArray) -> str:
    """Name a direction in the space of wrenches by its axes, largest first, leaving out the small ones."""
    order = [int(i) for i in np.argsort(-np.abs(direction)) if abs(direction[i]) > 0.1]
    sign = np.sign(direction[order[0]])
    if len(order) == 1:
        return AXES[order[0]]
    return " ".join(f"{sign * direction[i]:+.2f} {AXES[i]}" for i in order)


def _wrench_text(wrench: FloatArray) -> str:
    return "(" + ", ".join(f"{x:.3g}" for x in wrench) + ")"
