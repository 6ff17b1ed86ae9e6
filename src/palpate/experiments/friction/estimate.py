"""Estimates from the strokes and twists of one run: mu, e, slip loads, speed curve and exponents."""

import math
from collections.abc import Iterable, Sequence
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
from palpate.friction.rubbing.uniformity import FrictionProfile, uniformity_of
from palpate.friction.rubbing.zero_check import zero_check

ASSUMED_EXPONENT, ASSUMED_EXPONENT_ERROR = 1.7, 0.3
"""Norm exponent p where it was not measured: pressure under elastic bodies, from a sphere's to uniform. Its error
covers rubber (1.1 to 2 were measured)."""

DRIFT_SHARE = 0.1
"""Share of the sensor's drift that is left after linear interpolation."""

ZERO_SHARE = 0.2
"""Share of a sensor's zero error that is left after measurements in free air before and after: 1 mN, the mean over
a second of correlated noise of 10 mN."""

MIN_SLIPS = 6
"""Smallest number of slip loads, of both kinds, for a fit of the limit surface."""

Friction = FrictionMeasured | FrictionBound


@dataclass(frozen=True, slots=True, eq=False)
class AtSpeed:
    """Friction from strokes at one speed.

    Attributes:
        speed: Requested speed [m/s].
        friction: mu, or a lower bound.
    """

    speed: float
    friction: Friction


@dataclass(frozen=True, slots=True, eq=False)
class AtLoad:
    """Friction and spin length at one load.

    Attributes:
        load: Requested load [N].
        friction: mu at the main speed, or a lower bound.
        spin: e, or a lower bound of mu e; None without twists.
    """

    load: float
    friction: Friction
    spin: SpinMeasured | SpinBound | None


@dataclass(frozen=True, slots=True, eq=False)
class FrictionFound:
    """Estimates of one run.

    Attributes:
        loads: Estimates at each load, rising.
        speeds: Estimates at each speed of one load, rising, the main speed included.
        curve: mu over the speed; None without two speeds that slipped.
        slips: Loads in full slip, of all kinds of slip, converted to the main slip speed.
        fitted: Limit surface through the slip loads, with its exponents; None if they were not requested, or
            cannot be measured.
        verdict: Verdict on the assumptions of these numbers.
    """

    loads: tuple[AtLoad, ...]
    speeds: tuple[AtSpeed, ...]
    curve: SpeedCurve | None
    slips: tuple[SlipLoad, ...]
    fitted: LimitSurfaceFit | None
    verdict: Verdict = HELD


def slipped(found: Iterable[AtLoad | AtSpeed]) -> list[FrictionMeasured]:
    """Return the friction of the loads or speeds that slipped."""
    return _measured(each.friction for each in found)


def spun(found: Iterable[AtLoad]) -> list[SpinMeasured]:
    """Return the spin friction of the loads that slipped about the normal."""
    return [each.spin for each in found if isinstance(each.spin, SpinMeasured)]


def listed(words: Sequence[str]) -> str:
    """Return words as a list in a sentence: "1, 2 and 4"."""
    return " and ".join(part for part in (", ".join(words[:-1]), words[-1]) if part)


def _measured(frictions: Iterable[Friction | None]) -> list[FrictionMeasured]:
    return [each for each in frictions if isinstance(each, FrictionMeasured)]


def sensor_errors(air: FreeAir | None, calibration: float) -> SensorErrors:
    """Return the errors of the sensor: measured in free air, or typical for the Nano17 class.

    Args:
        air: Zero and noise in free air; None if they were not measured.
        calibration: Relative error of the calibration.
    """
    usual = SensorErrors(calibration=calibration)
    if air is None:
        return usual
    noise = replace(
        usual,
        force_noise=max(float(air.noise[:3].max()), 1e-6),
        moment_noise=max(float(air.noise[3:].max()), 1e-8),
    )
    if len(air.time) < 2:
        return noise
    seconds = float(air.time[-1] - air.time[0])
    moved, turned = float(np.linalg.norm(air.moved[:3])), float(np.linalg.norm(air.moved[3:]))
    return replace(
        noise,
        force_zero=max(ZERO_SHARE * usual.force_zero, DRIFT_SHARE * moved),
        moment_zero=max(ZERO_SHARE * usual.moment_zero, DRIFT_SHARE * turned),
        # interpolation of the zero has removed the rest of the drift
        force_drift=DRIFT_SHARE * moved / seconds,
        moment_drift=DRIFT_SHARE * turned / seconds,
    )


def found_by(
    pairs: Sequence[RubbedPair],
    speed: float,
    errors: SensorErrors,
    settling: float = SETTLING,
    tip_error: float = 0.0,
) -> FrictionFound:
    """Return the estimates from rubs; exponents, if some rubs slid and turned at once.

    Args:
        pairs: Rubs in the order of the run.
        speed: Main speed, used at every load [m/s].
        errors: Errors of the sensor, its zero subtracted.
        settling: Duration of transients, the sensor's delay included [s].
        tip_error: Error of the tip's size, compressed [m]: friction moves the estimated contact by mu times this.
    """
    return _Evaluation(pairs, speed, errors, settling).result(tip_error)


class _Evaluation:
    """Estimates that build upon each other: friction, then its speed curve, spin lengths and slip loads."""

    def __init__(self, pairs: Sequence[RubbedPair], speed: float, errors: SensorErrors, settling: float) -> None:
        cleaned = [without_spikes(each.pair, errors) for each in pairs]
        self._pairs = [RubbedPair(each.rub, pair) for each, (pair, _) in zip(pairs, cleaned, strict=True)]
        self._speed, self._errors, self._settling = speed, errors, settling
        loads = sorted({each.rub.normal_force for each in pairs})
        strokes = {load: self._strokes(load, speed) for load in loads}
        bare = {load: measure_friction(part, errors, settling) for load, part in strokes.items() if part}
        bare_speeds = self._over_speed(bare)
        others = [each for each in bare_speeds if each.speed != speed]
        aside = [
            each for each in self._pairs if each.rub.heading != 0.0 == each.rub.spin and each.rub.speed == speed
        ]
        across = [measure_friction([each.pair], errors, settling) for each in aside]
        # friction between directions at one load and speed, and along every stroke
        main = aside[0].rub.normal_force if aside else None
        uniform = uniformity_of(
            _profiles([*(bare[load] for load in bare if load == main), *across]),
            _profiles([*(bare[load] for load in bare if load != main), *(each.friction for each in others)]),
        )
        self._variation = uniform.variation
        zero = zero_check(_measured((*bare.values(), *(each.friction for each in others), *across)), errors)
        spikes, readings = (
            sum(count for _, count in cleaned),
            sum(len(stroke) for pair, _ in cleaned for stroke in pair.both),
        )
        self._verdict = uniform.verdict.and_also((*_spiked(spikes, readings), *zero))
        self._frictions = {load: self._widened(each) for load, each in bare.items()}
        self._speeds = tuple(replace(each, friction=self._widened(each.friction)) for each in bare_speeds)
        self._points = [SpeedPoint(each.speed, each.friction) for each in slipped(self._speeds)]
        self._curve = fit_speed_curve(self._points) if len(self._points) > 1 else None

    def result(self, tip_error: float) -> FrictionFound:
        """Return all estimates; exponents, if some rubs slid and turned at once."""
        first = self._at_loads(ASSUMED_EXPONENT, ASSUMED_EXPONENT_ERROR)
        slips = self._slips(first, ASSUMED_EXPONENT)
        mixed = any(each.rub.speed > 0.0 and each.rub.spin != 0.0 for each in self._pairs)
        if not mixed or len(slips) < MIN_SLIPS:
            return FrictionFound(first, self._speeds, self._curve, slips, None, self._verdict)
        mu = max(each.friction.value for each in _measured(self._frictions.values()))
        place = math.hypot(PLACE_ERROR, mu * tip_error)
        fitted = fit_limit_surface(slips, place_error=place)
        # p determines the speed of a combined slip
        slips = self._slips(first, fitted.surface.norm_exponent)
        fitted = fit_limit_surface(slips, place_error=place)
        again = self._at_loads(fitted.surface.norm_exponent, fitted.standard_deviations[3])
        verdict = self._verdict.and_also(fitted.verdict)
        return FrictionFound(again, self._speeds, self._curve, slips, fitted, verdict)

    def _strokes(self, load: float, speed: float) -> list[TwoWay]:
        """Return the pure strokes at a load and speed: the longest ones, which went on until they slipped."""
        found = [
            each
            for each in self._pairs
            if each.rub.spin == each.rub.heading == 0.0
            and (each.rub.normal_force, each.rub.speed) == (load, speed)
        ]
        longest = max((each.rub.duration for each in found), default=0.0)
        return [each.pair for each in found if each.rub.duration == longest]

    def _over_speed(self, frictions: dict[float, Friction]) -> tuple[AtSpeed, ...]:
        """Return friction over the speed, at the load with most speeds."""
        speeds = {
            load: sorted(
                {each.rub.speed for each in self._pairs if each.rub.spin == 0.0 and each.rub.normal_force == load}
                | {self._speed}
            )
            for load in frictions
        }
        if not speeds:
            return ()
        load = max(speeds, key=lambda each: (len(speeds[each]), each))
        return tuple(
            AtSpeed(
                speed,
                frictions[load]
                if speed == self._speed
                else measure_friction(self._strokes(load, speed), self._errors, self._settling),
            )
            for speed in speeds[load]
        )

    def _widened(self, friction: Friction) -> Friction:
        """Return friction whose interval covers other places and directions, too."""
        if not isinstance(friction, FrictionMeasured) or self._variation == 0.0:
            return friction
        mu = friction.friction
        return replace(friction, friction=replace(mu, model=math.hypot(mu.model, self._variation * mu.value)))

    def _at_loads(self, p: float, p_error: float) -> tuple[AtLoad, ...]:
        return tuple(
            AtLoad(load, friction, self._spin(load, friction, p, p_error))
            for load, friction in self._frictions.items()
        )

    def _spin(self, load: float, friction: Friction, p: float, p_error: float) -> SpinMeasured | SpinBound | None:
        twists = [each for each in self._pairs if each.rub.speed == 0.0 and each.rub.normal_force == load]
        longest = max((each.rub.duration for each in twists), default=0.0)
        # twists of the survey; later slips for the exponents are evaluated with those
        fastest = abs(twists[0].rub.spin) if twists else 0.0
        kept = [each.pair for each in twists if each.rub.duration == longest and abs(each.rub.spin) == fastest]
        if not kept:
            return None
        if not isinstance(friction, FrictionMeasured):
            return bound_spin(kept, friction.normal, self._errors, self._settling)

        def measured(known: FrictionMeasured) -> SpinMeasured | SpinBound:
            return measure_spin(
                kept, known, self._errors, self._settling, norm_exponent=p, norm_exponent_error=p_error
            )

        # twists are done beside the strokes' middle, where a bent surface has another normal
        here = np.mean([stroke.contact.mean(axis=0) for pair in kept for stroke in pair.both], axis=0)
        friction = replace(friction, normal=friction.normal_at(here))
        spin, curve = measured(friction), self._curve
        if curve is None or not curve.creep_excluded or not isinstance(spin, SpinMeasured):
            return spin
        # mu at the slip speed of these twists, e omega, instead of the strokes' speed
        turning = spin.torque_ratio.value * abs(spin.spin)
        own, slow = spin_friction(curve, self._points, turning, friction.friction, friction.speed)
        return measured(replace(friction, friction=own, speed=slow))

    def _slips(self, loads: Sequence[AtLoad], p: float) -> tuple[SlipLoad, ...]:
        """Return loads in full slip, converted to the main slip speed if mu over the speed is known."""
        lengths = {each.load: each.spin.spin_length.value for each in loads if isinstance(each.spin, SpinMeasured)}
        # speeds of the survey: exponents are measured at one speed, slower than the main speed if need be
        others = {each.speed for each in self._speeds} - {self._speed}
        found = []
        for each in self._pairs:
            rub, friction = each.rub, self._frictions.get(each.rub.normal_force)
            length = lengths.get(rub.normal_force)
            if not isinstance(friction, FrictionMeasured) or length is None:
                continue
            if rub.spin == 0.0 and rub.speed in others:
                continue  # strokes at other speeds have another mu
            here = np.mean([stroke.contact.mean(axis=0) for stroke in each.pair.both], axis=0)
            slip = slip_load(each.pair, friction.normal_at(here), length, self._settling)
            if slip is not None:
                found.append(self._at_main_speed(replace(slip, heading=rub.heading), length, p))
        return tuple(found)

    def _at_main_speed(self, slip: SlipLoad, length: float, p: float) -> SlipLoad:
        curve = self._curve
        if curve is None or not curve.creep_excluded:
            return slip
        a, b = slip.speed, length * slip.spin
        x, y = dual_point(a, b, p)  # dissipated power over mu f_n
        share = 1.0 / friction_ratio(curve, self._points, a * x + b * y, self._speed).value
        return replace(slip, tangential_force=share * slip.tangential_force, spin_torque=share * slip.spin_torque)


def _spiked(spikes: int, readings: int) -> tuple[BrokenAssumption, ...]:
    if spikes <= LARGEST_SHARE * readings:
        return ()
    finding = f"{spikes} of {spikes + readings} readings are spikes, at most {100.0 * LARGEST_SHARE:g} %"
    return (BrokenAssumption(Assumption.NO_OUTLIERS, finding, "check the sensor's cable and connection"),)


def _profiles(frictions: Iterable[Friction]) -> list[FrictionProfile]:
    return [profile for each in _measured(frictions) for profile in each.profiles]
