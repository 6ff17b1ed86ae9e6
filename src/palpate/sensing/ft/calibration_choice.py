"""Which model of a sensor predicts loads best that it never saw, and is proposed.

Two are linear: the sensor model (`palpate.sensing.ft.calibration`) and direct regression. Where loads and
channels are good they agree; where channels err alike, or much, direct regression predicts better, for it shrinks
the wrench towards the loads it has seen. The third is direct regression with terms beyond a line, if any are asked
for.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.ft.arrays import finite_rows, positive_entries
from palpate.sensing.ft.calibration import CalibrationFit, fit_calibration
from palpate.sensing.ft.calibration_regression import (
    BETTER,
    Readings,
    direct_regression,
    errors_by_group,
    surely_better,
    terms_asked_for,
)
from palpate.sensing.ft.left_out import Groups, equal_loads, grouped

ALIKE = 0.01
"""Of the error: as near, two models are equally good, and the one that does not shrink is taken."""

WARMEST = 150.0
"""[degrees Celsius] A sensor is not warmer than that, nor colder than -50."""


@dataclass(frozen=True, slots=True, eq=False)
class CalibrationChoice:
    """Models of one sensor, and the one that is proposed.

    Attributes:
        fits: All of them; the sensor model first.
        proposed: One of these.
        reason: Why, a sentence.
        temperature: At which it holds [degrees Celsius]; None: it was not measured.
        drift: Of its zero, shape (6,) [N/K, N m/K]; None: no term of the temperature was asked for.
        gain: Change of what each axis shows at full load, in units of its range, shape (6,) [1/K]; likewise.
    """

    fits: tuple[CalibrationFit, ...]
    proposed: CalibrationFit
    reason: str
    temperature: float | None = None
    drift: FloatArray | None = None
    gain: FloatArray | None = None


def choose_calibration(
    raw: npt.ArrayLike,
    wrench: npt.ArrayLike,
    *,
    ranges: npt.ArrayLike,
    temperature: npt.ArrayLike | None = None,
    used_at: float | None = None,
) -> CalibrationChoice:
    """Return the calibration that predicts loads best that it never saw.

    Args:
        raw: As in `fit_calibration`.
        wrench: Likewise; rows of equal loads are left out together.
        ranges: Likewise.
        temperature: Of the sensor at each load, shape (n,) [degrees Celsius]; None: not measured.
        used_at: Temperature at which the calibration is to hold; None: the mean of these.

    Raises:
        InvalidValueError: As in `fit_calibration`, or no such temperatures.
    """
    sensor = fit_calibration(raw, wrench, ranges=ranges)
    channels = finite_rows("raw", raw, None, "raw unit")
    scale = positive_entries("ranges", ranges, 6, "N, N m")
    warmth = None if temperature is None else _temperatures(temperature, len(channels))
    holds_at = (float(warmth.mean()) if used_at is None else used_at) if warmth is not None else None
    groups = grouped(equal_loads(sensor.loads))
    readings = Readings(channels, sensor.loads, scale, groups, warmth, holds_at)
    fits = [sensor]
    try:
        fits.append(direct_regression(readings, sensor))
        terms = terms_asked_for(readings)
        if terms:
            fits.append(direct_regression(readings, sensor, terms))
    except InvalidValueError:
        # too few loads for anything but the sensor model, whose verdict says so
        terms = ()
    proposed, reason = _best(fits, scale, groups)
    drift = gain = None
    if any(max(term) == channels.shape[1] for term in terms) and warmth is not None and holds_at is not None:
        warmer = Readings(channels, sensor.loads, scale, groups, warmth, holds_at + 1.0)
        drift, gain = _per_kelvin(fits[-1], direct_regression(warmer, sensor, terms), scale)
    return CalibrationChoice(tuple(fits), proposed, reason, holds_at, drift, gain)


def left_out_error(fit: CalibrationFit, ranges: FloatArray) -> float:
    """Return the root mean square error of loads that were left out, over all axes, in units of the ranges."""
    return float(np.sqrt(((fit.left_out / ranges) ** 2).mean()))


def _best(fits: list[CalibrationFit], ranges: FloatArray, groups: Groups) -> tuple[CalibrationFit, str]:
    sensor = fits[0]
    best, reason = sensor, "no model predicts loads better that were left out"
    errors = [left_out_error(fit, ranges) for fit in fits]
    if len(fits) > 1 and errors[1] < (1.0 - ALIKE) * errors[0]:
        best = fits[1]
        reason = (
            f"direct regression misses loads that were left out by {errors[1]:.3%} of the range, the sensor "
            f"model by {errors[0]:.3%}: channels err alike, or much, and it shrinks the wrench by that"
        )
    if len(fits) > 2:
        sure = surely_better(errors_by_group(best.left_out, groups), errors_by_group(fits[2].left_out, groups))
        if sure >= BETTER and errors[2] < left_out_error(best, ranges):
            better = fits[2]
            reason = (
                f"{better.model} misses loads that were left out by {errors[2]:.3%} of the range, {best.model} by "
                f"{left_out_error(best, ranges):.3%}: the difference is {sure:.2g} standard errors"
            )
            best = better
    return best, reason


def _per_kelvin(fit: CalibrationFit, warmer: CalibrationFit, ranges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return by how much a kelvin moves the zero, and what is shown at full load of each axis."""
    shown = np.vstack([fit.map.offset, np.diag(ranges) @ fit.sensitivity.T + fit.map.offset])
    # what a warmer sensor is said to feel less is what warmth makes it show more
    moved = fit.apply(shown) - warmer.apply(shown)
    return np.asarray(moved[0]), np.diag(moved[1:] - moved[0]) / ranges


def _temperatures(value: npt.ArrayLike, n: int) -> FloatArray:
    column = finite_rows("temperature", np.asarray(value).reshape(-1, 1), 1, "degrees Celsius")[:, 0]
    if len(column) != n:
        raise InvalidValueError(f"temperature has {len(column)} entries: must be {n}, one per load")
    bad = np.flatnonzero(~((column > -50.0) & (column < WARMEST)))
    if len(bad):
        raise InvalidValueError(
            f"temperature[{bad[0]}] = {column[bad[0]]:g}: must be from -50 to {WARMEST:g} degrees Celsius"
        )
    return column
