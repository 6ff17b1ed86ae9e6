"""The friction file of a run: the surface with intervals, and which numbers are bounds or assumed."""

import math
from collections.abc import Sequence

from palpate.experiments.friction.found import (
    ASSUMED_EXPONENT,
    AtLoad,
    FrictionFound,
)
from palpate.experiments.friction.pooled import growth_of, pooled
from palpate.experiments.friction.static import static_finding
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
from palpate.friction.rubbing.stroke_plan import MIN_LOAD_SPAN
from palpate.friction.rubbing.twisting import SpinBound, SpinMeasured

SIGMAS = 1.959964
"""Of a 95 % interval of a normal distribution."""

LEAST_EXPONENT, LARGEST_EXPONENT = 1.0, 2.0
"""Of p: diamond and ellipse."""


def friction_file(
    found: FrictionFound, speed: float, provenance: str, errors: SensorErrors
) -> FrictionFile | None:
    """Return what is kept; None if nothing was rubbed.

    Args:
        found: By one run.
        speed: Of its strokes [m/s].
        provenance: Where and how, in words.
        errors: Of the sensor: what a fit of slips does not know of it.
    """
    if not found.loads:
        return None
    friction = _friction(found)
    static = static_finding(found)
    most = max(friction.upper, 0.0 if static is None else static.upper)
    length, gamma, p = _spinning(found, most, errors.calibration)
    if found.fitted is not None:
        # mu is that of the strokes: their interval knows the sensor
        surface, (_, c_sd, gamma_sd, p_sd) = found.fitted.surface, found.fitted.standard_deviations
        forces = [slip.normal_force for slip in found.slips]
        # a zero that is off makes light loads another ratio of heavy ones
        zero = errors.force_zero / min(forces)
        c_sd = math.hypot(c_sd, surface.spin_length * math.hypot(errors.calibration, zero))
        gamma_sd = math.hypot(gamma_sd, zero / math.log(max(forces) / min(forces)))
        # and one that wanders makes slips with twist larger than those without: in the middle of the p-norm a load
        # is 2^(-1/p) of the ends
        wandered = errors.force_zero * sum(1.0 / force for force in forces) / len(forces)
        p_sd = math.hypot(p_sd, wandered * surface.norm_exponent**2 / math.log(2.0))
        length = _about(surface.spin_length, c_sd)
        gamma = _about(surface.load_exponent, gamma_sd, 0.0, LARGEST_LOAD_EXPONENT)
        p = _about(surface.norm_exponent, p_sd, LEAST_EXPONENT, LARGEST_EXPONENT)
    return FrictionFile(
        palpate_friction=VERSION,
        provenance=provenance,
        friction=friction,
        speed=_speed(found, speed),
        spin_length=length,
        load_exponent=gamma,
        norm_exponent=p,
        static_friction=static,
        loads=tuple(_at_load(each) for each in found.loads),
        speeds=tuple(
            SpeedFinding(
                speed=each.speed,
                friction=_of_strokes(each.friction),
                creeping=found.curve is not None and _slip_speed(each.friction) in found.curve.creeping,
            )
            for each in found.speeds
        ),
        broken=found.verdict.broken,
    )


def measured_lengths(loads: Sequence[AtLoad]) -> tuple[tuple[float, Estimate], ...]:
    """Return e [m] at each normal force [N] at which it was measured."""
    return tuple(
        (each.spin.normal_force, each.spin.spin_length) for each in loads if isinstance(each.spin, SpinMeasured)
    )


def _friction(found: FrictionFound) -> FrictionEstimate:
    """Return mu of all loads together; of those that slipped, if any did."""
    slipped = [each.friction.friction for each in found.loads if isinstance(each.friction, FrictionMeasured)]
    if slipped:
        return _measured(pooled(slipped))
    return _bound(
        max(each.friction.least_friction for each in found.loads if isinstance(each.friction, FrictionBound))
    )


def _spinning(
    found: FrictionFound, most: float, calibration: float
) -> tuple[FrictionEstimate | None, FrictionEstimate, FrictionEstimate]:
    """c, gamma and p from pure twists.

    Args:
        found: By one run.
        most: The largest mu that a torque may have been borne with; infinite where only a least is known.
        calibration: See `SensorErrors`.
    """
    gamma = FrictionEstimate(value=0.0, lower=0.0, upper=LARGEST_LOAD_EXPONENT, how=How.ASSUMED)
    p = FrictionEstimate(value=ASSUMED_EXPONENT, lower=LEAST_EXPONENT, upper=LARGEST_EXPONENT, how=How.ASSUMED)
    known = measured_lengths(found.loads)
    if not known:
        # at 1 N, for the largest gamma that may be, and the largest mu
        bounds = [
            each.spin.least_torque_ratio / max(1.0, each.spin.normal_force) ** gamma.upper
            for each in found.loads
            if isinstance(each.spin, SpinBound)
        ]
        if math.isfinite(most) and bounds and max(bounds) > 0.0:
            return _bound(max(bounds) / most), gamma, p
        return None, gamma, p
    forces, lengths = [force for force, _ in known], [length for _, length in known]
    if max(forces) < 0.99 * MIN_LOAD_SPAN * min(forces):
        return _measured(pooled(lengths)), gamma, p
    growth = growth_of(forces, lengths, calibration)
    exponent = min(max(growth.load_exponent, 0.0), LARGEST_LOAD_EXPONENT)
    gamma = _about(exponent, growth.load_exponent_sd, 0.0, LARGEST_LOAD_EXPONENT)
    if exponent == growth.load_exponent:
        return _about(growth.spin_length, growth.spin_length_sd), gamma, p
    # at an end of its range: c goes with that
    at_one = [_scaled(length, force**-exponent) for force, length in known]
    return _measured(pooled(at_one)), gamma, p


def _at_load(at: AtLoad) -> LoadFinding:
    length = ratio = None
    if isinstance(at.spin, SpinMeasured):
        length, ratio = _measured(at.spin.spin_length), _measured(at.spin.torque_ratio)
    elif isinstance(at.spin, SpinBound):
        ratio = _bound(at.spin.least_torque_ratio)
    return LoadFinding(
        normal_force=at.friction.normal_force,
        friction=_of_strokes(at.friction),
        spin_length=length,
        torque_ratio=ratio,
    )


def _of_strokes(friction: FrictionMeasured | FrictionBound) -> FrictionEstimate:
    return (
        _measured(friction.friction) if isinstance(friction, FrictionMeasured) else _bound(friction.least_friction)
    )


def _speed(found: FrictionFound, wanted: float) -> float:
    felt = [each.friction.speed for each in found.loads if isinstance(each.friction, FrictionMeasured)]
    return sum(felt) / len(felt) if felt else wanted


def _slip_speed(friction: FrictionMeasured | FrictionBound) -> float:
    return friction.speed if isinstance(friction, FrictionMeasured) else math.nan


def _measured(estimate: Estimate) -> FrictionEstimate:
    lower, upper = estimate.interval()
    return FrictionEstimate(value=estimate.value, lower=lower, upper=upper, how=How.MEASURED)


def _about(value: float, sd: float, least: float = -math.inf, most: float = math.inf) -> FrictionEstimate:
    lower, upper = max(value - SIGMAS * sd, least), min(value + SIGMAS * sd, most)
    return FrictionEstimate(value=value, lower=lower, upper=upper, how=How.MEASURED)


def _bound(least: float) -> FrictionEstimate:
    return FrictionEstimate(value=max(least, 1e-6), lower=max(least, 1e-6), upper=math.inf, how=How.BOUND)


def _scaled(estimate: Estimate, factor: float) -> Estimate:
    return Estimate(factor * estimate.value, factor * estimate.noise, factor * estimate.model, estimate.freedom)
