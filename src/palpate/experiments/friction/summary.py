"""The friction file of a run: estimates of all loads together, with intervals, bounds and assumed values."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.friction.estimate import (
    ASSUMED_EXPONENT,
    AtLoad,
    Friction,
    FrictionFound,
    slipped,
    spun,
)
from palpate.friction.friction_file import (
    VERSION,
    FrictionEstimate,
    FrictionFile,
    How,
    LoadFinding,
    SpeedFinding,
)
from palpate.friction.limit_surface import LARGEST_LOAD_EXPONENT
from palpate.friction.rubbing.estimate import Estimate, SensorErrors
from palpate.friction.rubbing.sliding import FrictionBound, FrictionMeasured
from palpate.friction.rubbing.speed_curve import SpeedCurve
from palpate.friction.rubbing.stick_slip import MIN_LET_GO, STATIC_ABOVE, STATIC_BELOW
from palpate.friction.rubbing.stroke_plan import MIN_LOAD_SPAN
from palpate.friction.rubbing.twisting import SpinBound, SpinMeasured

SIGMAS = 1.959964
"""Half width of a 95 % interval of a normal distribution [standard deviations]."""

MIN_EXPONENT, MAX_EXPONENT = 1.0, 2.0
"""Range of p: diamond and ellipse."""

MIN_STATIC_RISE = 1.02
"""Smallest ratio of static to kinetic friction that is reported; a smaller one does not matter at one speed."""

MAX_STATIC_GAP = 0.02
"""Largest rise of mu between the slowest stroke and rest, relative to static friction, for the curve to determine
static friction."""

MAX_STEEPNESS = 3.0
"""Largest rise of mu towards rest, relative to its Gaussian curve: a drop linear in the speed rises three times as
far as a quadratic one, given mu at the slowest speed and at twice that speed."""


# --- estimates at several loads, combined ---


def pooled(estimates: Sequence[Estimate]) -> Estimate:
    """Return the mean of estimates of one quantity.

    Noise is weighted by its variance, and at least as large as the scatter of the estimates explains. Common model
    errors remain.
    """
    values = np.array([each.value for each in estimates])
    noise = np.array([max(each.noise, 1e-9 * abs(each.value), 1e-15) for each in estimates])
    model = np.array([each.model for each in estimates])
    # weights by noise alone would prefer the quietest load even where models differ
    weights = 1.0 / (noise**2 + model**2)
    weights = weights / weights.sum()
    mean = float(weights @ values)
    sd = math.sqrt(float(weights**2 @ noise**2))
    if len(values) > 1:
        sd = max(sd, math.sqrt(float(weights @ (values - mean) ** 2) / (len(values) - 1)))
    return Estimate(mean, sd, float(weights @ model))


@dataclass(frozen=True, slots=True, eq=False)
class Growth:
    """e over the load as a power law, e = c f_n^gamma.

    Attributes:
        spin_length: c [m].
        load_exponent: gamma.
        spin_length_sd: Standard deviation of c [m].
        load_exponent_sd: Standard deviation of gamma.
    """

    spin_length: float
    load_exponent: float
    spin_length_sd: float
    load_exponent_sd: float


def growth_of(loads: Sequence[float], lengths: Sequence[Estimate], calibration: float = 0.0) -> Growth:
    """Return the power law through e at two or more loads: a straight line in logarithms.

    Args:
        loads: Normal forces [N].
        lengths: e at these forces [m].
        calibration: Relative error that all lengths share; it affects c but not gamma.
    """
    x = np.log(np.array(loads))
    y = np.log([each.value for each in lengths])
    own = [(each.standard_deviation / each.value) ** 2 - calibration**2 for each in lengths]
    sd = np.sqrt(np.maximum(own, 1e-12))
    design: FloatArray = np.column_stack([np.ones_like(x), x])
    information = design.T @ (design / sd[:, None] ** 2)
    covariance = np.linalg.inv(information)
    line = covariance @ (design.T @ (y / sd**2))
    if len(x) > 2:
        misfit = float((((y - design @ line) / sd) ** 2).sum()) / (len(x) - 2)
        covariance = covariance * max(1.0, misfit)
    c = math.exp(float(line[0]))
    c_sd = c * math.hypot(math.sqrt(covariance[0, 0]), calibration)
    return Growth(c, float(line[1]), c_sd, math.sqrt(covariance[1, 1]))


# --- the file ---


def friction_file(
    found: FrictionFound, speed: float, provenance: str, errors: SensorErrors
) -> FrictionFile | None:
    """Return the friction file; None if nothing was rubbed.

    Args:
        found: Estimates of one run.
        speed: Main speed of its strokes [m/s].
        provenance: Place and method, in words.
        errors: Errors of the sensor, which a fit of slips does not contain.
    """
    if not found.loads:
        return None
    frictions = slipped(found.loads)
    if frictions:
        friction = _estimate(pooled([each.friction for each in frictions]))
        speed = sum(each.speed for each in frictions) / len(frictions)
    else:
        bounds = [each.friction for each in found.loads]
        friction = _bound(max(each.least_friction for each in bounds if isinstance(each, FrictionBound)))
    static = _static(found)
    largest = max(friction.upper, 0.0 if static is None else static.upper)
    if found.fitted is None:
        length, gamma, p = _from_twists(found, largest, errors.calibration)
    else:
        length, gamma, p = _from_fit(found, errors)
    creeping = () if found.curve is None else found.curve.creeping
    return FrictionFile(
        palpate_friction=VERSION,
        provenance=provenance,
        friction=friction,
        speed=speed,
        spin_length=length,
        load_exponent=gamma,
        norm_exponent=p,
        static_friction=static,
        loads=tuple(map(_at_load, found.loads)),
        speeds=tuple(
            SpeedFinding(
                speed=each.speed,
                friction=_of_strokes(each.friction),
                creeping=isinstance(each.friction, FrictionMeasured) and each.friction.speed in creeping,
            )
            for each in found.speeds
        ),
        broken=found.verdict.broken,
    )


def _from_fit(found: FrictionFound, errors: SensorErrors) -> tuple[FrictionEstimate, ...]:
    """Return c, gamma and p of the fitted limit surface; mu is of the strokes, whose interval has the sensor."""
    assert found.fitted is not None
    surface, (_, c_sd, gamma_sd, p_sd) = found.fitted.surface, found.fitted.standard_deviations
    forces = [slip.normal_force for slip in found.slips]
    # an error of the zero makes light loads another ratio of heavy ones
    zero = errors.force_zero / min(forces)
    c_sd = math.hypot(c_sd, surface.spin_length * math.hypot(errors.calibration, zero))
    gamma_sd = math.hypot(gamma_sd, zero / math.log(max(forces) / min(forces)))
    # a drift of the zero makes slips with twist larger than slips without: in the middle of the p-norm a load
    # is 2^(-1/p) of the ends
    drift = errors.force_zero * sum(1.0 / force for force in forces) / len(forces)
    p_sd = math.hypot(p_sd, drift * surface.norm_exponent**2 / math.log(2.0))
    return (
        _about(surface.spin_length, c_sd),
        _about(surface.load_exponent, gamma_sd, 0.0, LARGEST_LOAD_EXPONENT),
        _about(surface.norm_exponent, p_sd, MIN_EXPONENT, MAX_EXPONENT),
    )


def _from_twists(
    found: FrictionFound, largest: float, calibration: float
) -> tuple[FrictionEstimate | None, FrictionEstimate, FrictionEstimate]:
    """Return c, gamma and p from pure twists.

    Args:
        found: Estimates of one run.
        largest: Largest mu that may have carried a torque; infinite if only a lower bound is known.
        calibration: Relative error of the calibration.
    """
    gamma = FrictionEstimate(value=0.0, lower=0.0, upper=LARGEST_LOAD_EXPONENT, how=How.ASSUMED)
    p = FrictionEstimate(value=ASSUMED_EXPONENT, lower=MIN_EXPONENT, upper=MAX_EXPONENT, how=How.ASSUMED)
    spins = spun(found.loads)
    if not spins:
        # bound at 1 N, for the largest possible gamma and mu
        bounds = [
            each.spin.least_torque_ratio / max(1.0, each.spin.normal_force) ** gamma.upper
            for each in found.loads
            if isinstance(each.spin, SpinBound)
        ]
        if math.isfinite(largest) and bounds and max(bounds) > 0.0:
            return _bound(max(bounds) / largest), gamma, p
        return None, gamma, p
    forces, lengths = [each.normal_force for each in spins], [each.spin_length for each in spins]
    if max(forces) < 0.99 * MIN_LOAD_SPAN * min(forces):
        return _estimate(pooled(lengths)), gamma, p
    growth = growth_of(forces, lengths, calibration)
    exponent = min(max(growth.load_exponent, 0.0), LARGEST_LOAD_EXPONENT)
    gamma = _about(exponent, growth.load_exponent_sd, 0.0, LARGEST_LOAD_EXPONENT)
    if exponent == growth.load_exponent:
        return _about(growth.spin_length, growth.spin_length_sd), gamma, p
    # gamma is at an end of its range: c follows from it
    factors = [force**-exponent for force in forces]
    at_one = [
        Estimate(factor * each.value, factor * each.noise, factor * each.model, each.freedom)
        for factor, each in zip(factors, lengths, strict=True)
    ]
    return _estimate(pooled(at_one)), gamma, p


def _at_load(at: AtLoad) -> LoadFinding:
    length = ratio = None
    if isinstance(at.spin, SpinMeasured):
        length, ratio = _estimate(at.spin.spin_length), _estimate(at.spin.torque_ratio)
    elif isinstance(at.spin, SpinBound):
        ratio = _bound(at.spin.least_torque_ratio)
    return LoadFinding(
        normal_force=at.friction.normal_force,
        friction=_of_strokes(at.friction),
        spin_length=length,
        torque_ratio=ratio,
    )


def _of_strokes(friction: Friction) -> FrictionEstimate:
    if isinstance(friction, FrictionMeasured):
        return _estimate(friction.friction)
    return _bound(friction.least_friction)


def _estimate(estimate: Estimate) -> FrictionEstimate:
    lower, upper = estimate.interval()
    return FrictionEstimate(value=estimate.value, lower=lower, upper=upper, how=How.MEASURED)


def _about(value: float, sd: float, least: float = -math.inf, most: float = math.inf) -> FrictionEstimate:
    lower, upper = max(value - SIGMAS * sd, least), min(value + SIGMAS * sd, most)
    return FrictionEstimate(value=value, lower=lower, upper=upper, how=How.MEASURED)


def _bound(least: float) -> FrictionEstimate:
    least = max(least, 1e-6)
    return FrictionEstimate(value=least, lower=least, upper=math.inf, how=How.BOUND)


# --- static friction ---


def _static(found: FrictionFound) -> FrictionEstimate | None:
    """Return static friction: from stick-slip, or mu extrapolated to rest, or a bound; None if it is not seen."""
    frictions = slipped([*found.loads, *found.speeds])
    sticking = [each.turns for each in frictions if each.turns is not None]
    clear = [each for each in frictions if each.turns is not None and each.turns.times >= MIN_LET_GO]
    if clear:
        highest = max(clear, key=lambda each: each.static_friction or 0.0)
        mu, static = highest.friction, highest.static_friction or 0.0
        error = (mu.interval()[1] - mu.value) / mu.value
        return FrictionEstimate(
            value=static, lower=static / STATIC_ABOVE, upper=static * (STATIC_BELOW + error), how=How.MEASURED
        )
    by_curve = None if found.curve is None else _towards_rest(found, found.curve)
    if by_curve is not None and by_curve.measured:
        return by_curve
    # few slips out of sticking, or mu that still rises at the slowest speed, give a bound
    bounds = [each.ratio / STATIC_ABOVE for each in sticking]
    bounds += [] if by_curve is None else [by_curve.value]
    lowest = min((each.friction.value for each in frictions), default=math.inf)
    least = max(bounds, default=0.0)
    return None if least < MIN_STATIC_RISE * lowest else _bound(least)


def _towards_rest(found: FrictionFound, curve: SpeedCurve) -> FrictionEstimate | None:
    """Return static friction by extrapolating mu over the speed to rest, creep left out."""
    steady = [each for each in slipped(found.speeds) if each.speed not in curve.creeping]
    steady.sort(key=lambda each: each.speed)
    if len(steady) < 2:
        return None
    slowest, lowest = steady[0], min(each.friction.value for each in steady)
    mu, (lower, upper) = slowest.friction.value, slowest.friction.interval()
    if mu < MIN_STATIC_RISE * lowest:
        return None
    misfit = abs(curve.friction_at(slowest.speed) / mu - 1.0)
    gap = curve.static_friction - mu
    determined = math.isfinite(curve.stribeck_speed) and misfit < 0.5 * MAX_STATIC_GAP and slowest.turns is None
    if not determined or gap > MAX_STATIC_GAP * curve.static_friction:
        return FrictionEstimate(value=lower, lower=lower, upper=math.inf, how=How.BOUND)
    static = max(curve.static_friction, mu)
    most = mu + MAX_STEEPNESS * max(gap, 0.0) + (upper - mu)
    return FrictionEstimate(value=static, lower=lower, upper=max(static, most), how=How.MEASURED)
