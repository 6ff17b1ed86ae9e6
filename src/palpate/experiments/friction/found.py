"""The friction model of one run: everything that `palpate.friction` estimates from its strokes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.estimation import HELD, Assumption, BrokenAssumption, Verdict
from palpate.experiments.friction.strokes import FreeAir, RubbedPair
from palpate.friction.p_norm import dual_point
from palpate.friction.rubbing.estimate import SensorErrors
from palpate.friction.rubbing.sliding import SETTLING, FrictionBound, FrictionMeasured, measure_friction
from palpate.friction.rubbing.slip_load import SlipLoad
from palpate.friction.rubbing.slip_loads import slip_load
from palpate.friction.rubbing.speed_curve import SpeedCurve, SpeedPoint, fit_speed_curve
from palpate.friction.rubbing.speed_ratio import friction_ratio, spin_friction
from palpate.friction.rubbing.spikes import LARGEST_SHARE, without_spikes
from palpate.friction.rubbing.stroke import TwoWay
from palpate.friction.rubbing.surface_fit import PLACE_ERROR, LimitSurfaceFit, fit_limit_surface
from palpate.friction.rubbing.twisting import SpinBound, SpinMeasured, bound_spin, measure_spin
from palpate.friction.rubbing.uniformity import FrictionProfile, Uniformity, uniformity_of
from palpate.friction.rubbing.zero_check import zero_check

ASSUMED_EXPONENT, ASSUMED_ERROR = 1.7, 0.3
"""Of p where it was not measured: that of pressure as under elastic bodies, from a sphere's to uniform, and how
far rubber is from it (1.1 to 2 were measured)."""

LEFT_DRIFT = 0.1
"""Share of the sensor's drift that is left after linear interpolation."""

FELT_ZERO = 0.2
"""Share of a sensor's zero that is left where it was felt in free air before and after: 1 mN, the mean of a second
of noise of 10 mN with what hangs together of it."""

FEWEST_SLIPS = 6
"""Loads for a fit of the limit surface, of both kinds."""


@dataclass(frozen=True, slots=True, eq=False)
class AtSpeed:
    """Friction from strokes at one speed.

    Attributes:
        speed: Asked for [m/s].
        friction: mu, or a lower bound.
    """

    speed: float
    friction: FrictionMeasured | FrictionBound


@dataclass(frozen=True, slots=True, eq=False)
class AtLoad:
    """Friction and spin length at one load.

    Attributes:
        load: Asked for [N].
        friction: mu at the main speed, or a lower bound.
        spin: e, or a lower bound of mu e; None if it did not turn.
    """

    load: float
    friction: FrictionMeasured | FrictionBound
    spin: SpinMeasured | SpinBound | None


@dataclass(frozen=True, slots=True, eq=False)
class FrictionFound:
    """Everything that one run has measured of a surface.

    Attributes:
        loads: At each load, rising.
        speeds: At each speed of one load, rising; the main one is among them.
        curve: mu over the speed; None without two speeds that slipped.
        slips: Loads in full slip, of all kinds of slip, as they would be at the main slip speed.
        fitted: The limit surface through them, with its exponents; None if they were not asked for, or cannot be
            measured.
        verdict: Whether the surface is one that these numbers describe.
    """

    loads: tuple[AtLoad, ...]
    speeds: tuple[AtSpeed, ...]
    curve: SpeedCurve | None
    slips: tuple[SlipLoad, ...]
    fitted: LimitSurfaceFit | None
    verdict: Verdict = HELD


def sensor_errors(air: FreeAir | None, calibration: float) -> SensorErrors:
    """Return what the sensor may be off by, as far as free air has shown it; of the Nano17 class else.

    Args:
        air: What it showed.
        calibration: See `SensorErrors`.
    """
    usual = SensorErrors(calibration=calibration)
    if air is None:
        return usual
    force, moment = float(air.noise[:3].max()), float(air.noise[3:].max())
    if len(air.time) < 2:
        return replace(usual, force_noise=max(force, 1e-6), moment_noise=max(moment, 1e-8))
    seconds = float(air.time[-1] - air.time[0])
    moved, turned = float(np.linalg.norm(air.moved[:3])), float(np.linalg.norm(air.moved[3:]))
    return replace(
        usual,
        force_noise=max(force, 1e-6),
        moment_noise=max(moment, 1e-8),
        force_zero=max(FELT_ZERO * usual.force_zero, LEFT_DRIFT * moved),
        moment_zero=max(FELT_ZERO * usual.moment_zero, LEFT_DRIFT * turned),
        # what the zero was interpolated over, strokes need not cancel again
        force_drift=LEFT_DRIFT * moved / seconds,
        moment_drift=LEFT_DRIFT * turned / seconds,
    )


def found_by(
    pairs: Sequence[RubbedPair],
    speed: float,
    errors: SensorErrors,
    settling: float = SETTLING,
    tip_error: float = 0.0,
) -> FrictionFound:
    """Return what rubs have measured; exponents, if some slid and turned at once.

    Args:
        pairs: In the order in which they were done.
        speed: The main one, at which each load was rubbed [m/s].
        errors: Of the sensor, its zero taken off.
        settling: How long transients last, the sensor's delay included [s].
        tip_error: By how much the tip may be smaller or larger than it is taken for, compressed [m]: friction
            then moves the contact that is felt, and turned about, by mu times that.
    """
    cleaned = [without_spikes(each.pair, errors) for each in pairs]
    pairs = [RubbedPair(each.rub, pair) for each, (pair, _) in zip(pairs, cleaned, strict=True)]
    spikes, readings = sum(count for _, count in cleaned), sum(len(s) for pair, _ in cleaned for s in pair.both)
    loads = sorted({pair.rub.normal_force for pair in pairs})
    strokes = {load: _strokes(pairs, load, speed) for load in loads}
    bare = {load: measure_friction(part, errors, settling) for load, part in strokes.items() if part}
    bare_speeds = _over_speed(pairs, bare, speed, errors, settling)
    aside = [pair for pair in pairs if pair.rub.heading != 0.0 == pair.rub.spin and pair.rub.speed == speed]
    across = [measure_friction([pair.pair], errors, settling) for pair in aside]
    uniform = _uniformity(bare, bare_speeds, speed, aside[0].rub.normal_force if aside else None, across)
    pure = (*bare.values(), *(each.friction for each in bare_speeds if each.speed != speed), *across)
    zero = zero_check([each for each in pure if isinstance(each, FrictionMeasured)], errors)
    verdict = uniform.verdict.and_also((*_spiked(spikes, readings), *zero))
    frictions = {load: _counting(uniform, each) for load, each in bare.items()}
    speeds = tuple(replace(each, friction=_counting(uniform, each.friction)) for each in bare_speeds)
    points = [
        SpeedPoint(each.friction.speed, each.friction.friction)
        for each in speeds
        if isinstance(each.friction, FrictionMeasured)
    ]
    curve = fit_speed_curve(points) if len(points) > 1 else None
    first = tuple(
        _at_load(pairs, load, frictions, curve, points, errors, settling) for load in loads if load in frictions
    )

    def slips_by(p: float) -> tuple[SlipLoad, ...]:
        return _slips(pairs, frictions, first, speeds, curve, points, speed, settling, p)

    slips = slips_by(ASSUMED_EXPONENT)
    mixed = any(pair.rub.speed > 0.0 and pair.rub.spin != 0.0 for pair in pairs)
    if not mixed or len(slips) < FEWEST_SLIPS:
        return FrictionFound(first, speeds, curve, slips, None, verdict)
    mu = max(each.friction.value for each in frictions.values() if isinstance(each, FrictionMeasured))
    place = math.hypot(PLACE_ERROR, mu * tip_error)
    fitted = fit_limit_surface(slips, place_error=place)
    # p determines the speed of a combined slip
    slips = slips_by(fitted.surface.norm_exponent)
    fitted = fit_limit_surface(slips, place_error=place)
    p, sd = fitted.surface.norm_exponent, fitted.standard_deviations[3]
    again = tuple(
        _at_load(pairs, load, frictions, curve, points, errors, settling, p, sd)
        for load in loads
        if load in frictions
    )
    return FrictionFound(again, speeds, curve, slips, fitted, verdict.and_also(fitted.verdict))


def _strokes(pairs: Sequence[RubbedPair], load: float, speed: float) -> list[TwoWay]:
    """Pure strokes at a load and speed: of those that went on until they slipped, the longest."""
    found = [
        pair
        for pair in pairs
        if pair.rub.spin == pair.rub.heading == 0.0 and (pair.rub.normal_force, pair.rub.speed) == (load, speed)
    ]
    longest = max((pair.rub.duration for pair in found), default=0.0)
    return [pair.pair for pair in found if pair.rub.duration == longest]


def _spiked(spikes: int, readings: int) -> tuple[BrokenAssumption, ...]:
    if spikes <= LARGEST_SHARE * readings:
        return ()
    finding = f"{spikes} of {spikes + readings} readings are spikes, at most {100.0 * LARGEST_SHARE:g} %"
    return (BrokenAssumption(Assumption.NO_OUTLIERS, finding, "check the sensor's cable and connection"),)


def _uniformity(
    frictions: dict[float, FrictionMeasured | FrictionBound],
    speeds: Sequence[AtSpeed],
    main: float,
    load: float | None,
    across: Sequence[FrictionMeasured | FrictionBound],
) -> Uniformity:
    """How far mu is the same: between directions at one load and speed, and along every stroke."""
    here = [None if load is None else frictions.get(load), *across]
    beside = [frictions[each] for each in frictions if each != load] + [
        each.friction for each in speeds if each.speed != main
    ]
    return uniformity_of(_profiles(here), _profiles(beside))


def _profiles(frictions: Sequence[FrictionMeasured | FrictionBound | None]) -> list[FrictionProfile]:
    return [one for each in frictions if isinstance(each, FrictionMeasured) for one in each.profiles]


def _counting(uniform: Uniformity, friction: FrictionMeasured | FrictionBound) -> FrictionMeasured | FrictionBound:
    """Friction whose interval holds other places and directions, too."""
    if not isinstance(friction, FrictionMeasured) or uniform.variation == 0.0:
        return friction
    mu = friction.friction
    return replace(friction, friction=replace(mu, model=math.hypot(mu.model, uniform.variation * mu.value)))


def _over_speed(
    pairs: Sequence[RubbedPair],
    frictions: dict[float, FrictionMeasured | FrictionBound],
    main: float,
    errors: SensorErrors,
    settling: float,
) -> tuple[AtSpeed, ...]:
    """At the load at which most speeds were rubbed."""
    speeds = {
        load: sorted(
            {pair.rub.speed for pair in pairs if pair.rub.spin == 0.0 and pair.rub.normal_force == load} | {main}
        )
        for load in frictions
    }
    if not speeds:
        return ()
    load = max(speeds, key=lambda each: (len(speeds[each]), each))
    return tuple(
        AtSpeed(
            speed,
            frictions[load] if speed == main else measure_friction(_strokes(pairs, load, speed), errors, settling),
        )
        for speed in speeds[load]
    )


def _at_load(
    pairs: Sequence[RubbedPair],
    load: float,
    frictions: dict[float, FrictionMeasured | FrictionBound],
    curve: SpeedCurve | None,
    points: Sequence[SpeedPoint],
    errors: SensorErrors,
    settling: float,
    p: float = ASSUMED_EXPONENT,
    p_error: float = ASSUMED_ERROR,
) -> AtLoad:
    friction = frictions[load]
    twists = [pair for pair in pairs if pair.rub.speed == 0.0 and pair.rub.normal_force == load]
    longest = max((pair.rub.duration for pair in twists), default=0.0)
    # of those that the survey did; slips for the exponents come later, and are judged with them
    fastest = abs(twists[0].rub.spin) if twists else 0.0
    kept = [each.pair for each in twists if each.rub.duration == longest and abs(each.rub.spin) == fastest]
    if not kept:
        return AtLoad(load, friction, None)
    if not isinstance(friction, FrictionMeasured):
        return AtLoad(load, friction, bound_spin(kept, friction.normal, errors, settling))

    def measured(known: FrictionMeasured) -> SpinMeasured | SpinBound:
        return measure_spin(kept, known, errors, settling, norm_exponent=p, norm_exponent_error=p_error)

    # where they were done: beside the strokes' middle, where a bent surface has another normal
    here = np.mean([stroke.contact.mean(axis=0) for pair in kept for stroke in pair.both], axis=0)
    friction = replace(friction, normal=friction.normal_at(here))
    spin = measured(friction)
    if curve is not None and curve.creep_excluded and isinstance(spin, SpinMeasured):
        # mu at the speed of these twists, e omega, not at that of the strokes
        turning = spin.torque_ratio.value * abs(spin.spin)
        own, slow = spin_friction(curve, points, turning, friction.friction, friction.speed)
        spin = measured(replace(friction, friction=own, speed=slow))
    return AtLoad(load, frictions[load], spin)


def _slips(
    pairs: Sequence[RubbedPair],
    frictions: dict[float, FrictionMeasured | FrictionBound],
    loads: Sequence[AtLoad],
    over_speed: Sequence[AtSpeed],
    curve: SpeedCurve | None,
    points: Sequence[SpeedPoint],
    speed: float,
    settling: float,
    p: float,
) -> tuple[SlipLoad, ...]:
    """Loads in full slip, as they would be at the main slip speed, as far as mu over the speed is known."""
    lengths = {each.load: each.spin.spin_length.value for each in loads if isinstance(each.spin, SpinMeasured)}
    # those of the survey: exponents are measured at one speed, slower than the main one if need be
    others = {each.speed for each in over_speed} - {speed}
    found = []
    for each in pairs:
        rub, friction = each.rub, frictions.get(each.rub.normal_force)
        if not isinstance(friction, FrictionMeasured) or rub.normal_force not in lengths:
            continue
        if rub.spin == 0.0 and rub.speed in others:
            continue  # strokes at other speeds have another mu
        here = np.mean([stroke.contact.mean(axis=0) for stroke in each.pair.both], axis=0)
        slip = slip_load(each.pair, friction.normal_at(here), lengths[rub.normal_force], settling)
        if slip is None:
            continue
        slip = replace(slip, heading=rub.heading)
        if curve is not None and curve.creep_excluded:
            a, b = slip.speed, lengths[rub.normal_force] * slip.spin
            x, y = dual_point(a, b, p)  # dissipated power over mu f_n
            slow = a * x + b * y
            share = 1.0 / friction_ratio(curve, points, slow, speed).value
            slip = replace(
                slip,
                tangential_force=share * slip.tangential_force,
                spin_torque=share * slip.spin_torque,
            )
        found.append(slip)
    return tuple(found)
