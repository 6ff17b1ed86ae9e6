"""e of one load from twists there and back, once mu and the normal are known from strokes.

The torque about the normal is m.f / f.n (see `palpate.friction.rubbing.stroke`): the sensor's origin does not come
in, and the normal only by its share along the tangential force. What the finger slides while it turns, by a
servo's error or by turning beside the contact, lowers the torque: on the limit surface it is sqrt(1 - (f_t / mu
f_n)^2) of that of a pure twist, generally by the p-norm; f_t is measured in the same samples, and taken into
account, whether it is steady or shakes.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, not_negative
from palpate.friction.rubbing.estimate import Estimate, SensorErrors
from palpate.friction.rubbing.sliding import (
    LATE_SHARES,
    SEEN_RISE,
    SETTLING,
    STRETCHES,
    FrictionMeasured,
)
from palpate.friction.rubbing.slip_test import Resistance, SlipEvidence, slip_evidence
from palpate.friction.rubbing.stick_slip import MIN_TURNS, stick_slip
from palpate.friction.rubbing.stroke import MIN_SAMPLES, RubbingStroke, TwoWay, batch_means, steady_part

LARGEST_SLIDE = 0.9
"""Of mu f_n, how much tangential force a twist may have: above, sqrt(1 - x^2) < 0.44 makes 1 % in mu 4 % in e."""


@dataclass(frozen=True, slots=True)
class SpinMeasured:
    """Spin friction measured by twists there and back, at one load.

    Attributes:
        spin_length: e [m], the largest torque of a pure twist over mu f_n.
        torque_ratio: mu e [m], the same over f_n.
        static_torque_ratio: At which spinning begins [m], seen in stick-slip; None otherwise.
        normal_force: Mean [N].
        spin: Angular speed about the normal, mean [rad/s]; e spin is the speed that mu belongs to.
        slide: Tangential force that was left, over mu f_n: the torque was corrected for it.
        evidence: That it slipped.
    """

    spin_length: Estimate
    torque_ratio: Estimate
    static_torque_ratio: float | None
    normal_force: float
    spin: float
    slide: float
    evidence: SlipEvidence

    @property
    def stick_slip(self) -> bool:
        """Whether it stuck and slipped by turns."""
        return self.static_torque_ratio is not None


class SpinUncertainty(Enum):
    """Why twists gave no more than a bound."""

    NEVER_SLIPPED = "never slipped"
    """The torque still rose with the angle."""
    SLID = "slid"
    """The finger slid along the surface more than it spun: the twist was too far beside the contact."""
    FRICTION_UNKNOWN = "friction unknown"
    """It spun, but did not slip along the surface: mu e is known, neither of the two alone."""


@dataclass(frozen=True, slots=True)
class SpinBound:
    """Bound on spin friction from twists that never slipped.

    Attributes:
        least_torque_ratio: mu e is at least this [m].
        normal_force: Mean [N].
        doubt: Why it is no more than a bound.
        evidence: What the torque did.
    """

    least_torque_ratio: float
    normal_force: float
    doubt: SpinUncertainty
    evidence: SlipEvidence


def measure_spin(
    twists: Sequence[TwoWay],
    friction: FrictionMeasured,
    errors: SensorErrors | None = None,
    settling: float = SETTLING,
    norm_exponent: float = 2.0,
    norm_exponent_error: float = 0.0,
    normal_error: float = 0.003,
) -> SpinMeasured | SpinBound:
    """Return e, or a lower bound of mu e if the finger never spun on the surface.

    Args:
        twists: About the normal as nearly as it was known, where the strokes rubbed, at their load.
        friction: As measured by strokes, at about the slip speed of these twists.
        errors: Of the sensor; those of the Nano17 class if not given.
        settling: How long transients last, the sensor's filter and delay included [s].
        norm_exponent: p of the limit surface, for the correction.
        norm_exponent_error: By how much that may be too large.
        normal_error: Standard deviation of the normal's angle between strokes and twists [rad]: 0.12 mm on a
            surface of 40 mm radius.

    Raises:
        InvalidValueError: There are none, or one is too short or does not reverse the other.
    """
    if not twists:
        raise InvalidValueError("0 twists: must be at least one there and one back")
    not_negative("norm_exponent_error", norm_exponent_error, "")
    errors, mu = errors or SensorErrors(), friction.friction.value
    turns = [_turned(pair, friction.normal, settling) for pair in twists]
    evidence = slip_evidence([turn.resistance for pair in turns for turn in pair])
    if not evidence.slipped:
        return _bound(twists, friction.normal, errors, SpinUncertainty.NEVER_SLIPPED, turns)
    turns = _in_slip(twists, friction.normal, settling, turns)
    each = [turn for pair in turns for turn in pair]
    normal_force = float(np.mean([turn.normal_force for turn in each]))
    measured = float(np.mean([turn.torque / turn.normal_force for turn in each]))
    x = math.sqrt(float(np.mean([(turn.slide_force / turn.normal_force) ** 2 for turn in each]))) / mu
    if x > LARGEST_SLIDE:
        return SpinBound(measured, normal_force, SpinUncertainty.SLID, evidence)
    share = torque_share(x, norm_exponent)
    ratio = measured / share

    variances = [batch_means(turn.resistance.ratio).var(ddof=1) / 8.0 for turn in each]
    noise = math.sqrt(float(np.sum(variances))) / len(each) / measured
    # d ln share / dx: what a wrong x does
    steepness = x ** (norm_exponent - 1.0) / (1.0 - x**norm_exponent)
    sway = math.hypot(normal_error, errors.force_zero / normal_force) / mu
    waits = [
        math.copysign(pair.back.time.mean() - pair.there.time.mean(), turn[0].sense * turns[0][0].sense)
        for pair, turn in zip(twists, turns, strict=True)
    ]
    drift = 0.5 * errors.moment_drift * abs(float(np.mean(waits))) / (measured * normal_force)
    least = torque_share(x, max(1.0, norm_exponent - norm_exponent_error))
    own = math.hypot(drift, steepness * sway, math.log(share / least))
    known = errors.of_friction(normal_force)
    # f_t / mu f_n is wrong as mu is: that goes against mu's own part in e
    by_mu = 1.0 - x * steepness
    freedom = 7.0 * len(each)
    of_mu = friction.friction
    e = ratio / mu
    of_speed = math.sqrt(max((of_mu.model / mu) ** 2 - known**2, 0.0))
    lever = float(np.mean([turn.lever for turn in each]))
    sensor = math.hypot(errors.moment_noise, lever * errors.force_noise) / normal_force
    turning = stick_slip([turn.resistance for turn in each], measured, sensor)
    return SpinMeasured(
        Estimate(
            e,
            e * math.hypot(noise, by_mu * of_mu.noise / mu),
            e * math.hypot(errors.calibration, own, by_mu * of_speed),
            freedom,
        ),
        Estimate(
            ratio,
            ratio * math.hypot(noise, x * steepness * of_mu.noise / mu),
            ratio * math.hypot(known, own),
            freedom,
        ),
        None if turning is None or turning.times < MIN_TURNS else turning.ratio / share,
        normal_force,
        float(np.mean([turn.spin for turn in each])),
        x,
        evidence,
    )


def bound_spin(
    twists: Sequence[TwoWay],
    normal: FloatArray,
    errors: SensorErrors | None = None,
    settling: float = SETTLING,
) -> SpinBound:
    """Return the largest mu e that twists bore where mu itself is not known, so that they cannot tell e.

    Args:
        twists: As for `measure_spin`.
        normal: As well as it is known, out of the finger into the object, base coordinates, shape (3,).
        errors: Of the sensor; those of the Nano17 class if not given.
        settling: How long transients last, the sensor's filter and delay included [s].

    Raises:
        InvalidValueError: There are none, or one is too short or does not reverse the other.
    """
    if not twists:
        raise InvalidValueError("0 twists: must be at least one there and one back")
    turns = [_turned(pair, normal, settling) for pair in twists]
    slipped = slip_evidence([turn.resistance for pair in turns for turn in pair]).slipped
    doubt = SpinUncertainty.FRICTION_UNKNOWN if slipped else SpinUncertainty.NEVER_SLIPPED
    return _bound(twists, normal, errors or SensorErrors(), doubt, turns)


def torque_share(slide: float, norm_exponent: float) -> float:
    """Return the torque that a contact bears beside a tangential force of `slide` mu f_n, over that without."""
    return float((1.0 - slide**norm_exponent) ** (1.0 / norm_exponent))


@dataclass(frozen=True, slots=True, eq=False)
class _Turn:
    """The steady part of a twist."""

    resistance: Resistance
    torque: float
    normal_force: float
    slide_force: float
    spin: float
    sense: float
    lever: float


_Turns = list[tuple[_Turn, _Turn]]


def _in_slip(twists: Sequence[TwoWay], normal: FloatArray, settling: float, turns: _Turns) -> _Turns:
    """Leave out the part of every motion before slip: what remains no longer rises."""
    for left_out in LATE_SHARES:
        each = [turn.resistance for pair in turns for turn in pair]
        evidence = slip_evidence(each)
        kept = min(len(one.travel) for one in each) * (1.0 - left_out)
        if evidence.rise <= SEEN_RISE * evidence.uncertainty or kept < MIN_SAMPLES:
            break
        turns = [_turned(pair, normal, settling, left_out) for pair in twists]
    return turns


def _turned(pair: TwoWay, normal: FloatArray, settling: float, left_out: float = 0.0) -> tuple[_Turn, _Turn]:
    senses = [float(np.sign((stroke.angular_velocity @ normal).mean())) for stroke in pair.both]
    if senses[0] * senses[1] != -1.0:
        raise InvalidValueError("the second twist does not reverse the first: must turn back along the same path")
    there, back = (
        _turn(stroke, normal, sense, settling, left_out) for stroke, sense in zip(pair.both, senses, strict=True)
    )
    return there, back


def _turn(stroke: RubbingStroke, normal: FloatArray, sense: float, settling: float, left_out: float) -> _Turn:
    """The steady part of a twist, but for a share of it at its beginning."""
    spin = sense * (stroke.angular_velocity @ normal)
    part = steady_part(stroke.time, spin, settling)
    part = slice(part.start + round(left_out * (part.stop - part.start)), part.stop)
    angle = np.concatenate([[0.0], np.cumsum(0.5 * (spin[1:] + spin[:-1]) * np.diff(stroke.time))])
    force = stroke.force[part]
    pushing = -(force @ normal)
    torque = -sense * stroke.spin_torque(normal)[part]
    return _Turn(
        Resistance(angle[part], torque / pushing),
        float(torque.mean()),
        float(pushing.mean()),
        _slide_force(force + pushing[:, None] * normal),
        float(spin[part].mean()),
        sense,
        _lever(stroke.wrench[part], pushing),
    )


def _slide_force(tangential: FloatArray) -> float:
    """Root mean square of a tangential force [N], (n, 3), without noise: a tip that shakes slides as well.

    Noise is estimated by its steps from sample to sample, which a shaking tip hardly makes (40 Hz at 1 kHz: 3 %).
    Means over stretches bound it from below: where noise is all there is, they hold what it leaves of a steady
    force.
    """
    noise = 0.5 * float((np.diff(tangential, axis=0) ** 2).sum(axis=1).mean())
    shaken = float((tangential**2).sum(axis=1).mean()) - noise
    steady = float((batch_means(tangential) ** 2).sum(axis=1).mean())
    return math.sqrt(max(shaken, steady))


def _bound(
    twists: Sequence[TwoWay], normal: FloatArray, errors: SensorErrors, doubt: SpinUncertainty, turns: _Turns
) -> SpinBound:
    each = [turn for pair in turns for turn in pair]
    evidence = slip_evidence([turn.resistance for turn in each])
    normal_force = float(np.mean([turn.normal_force for turn in each]))
    return SpinBound(_least_torque_ratio(twists, normal, errors), normal_force, doubt, evidence)


def _least_torque_ratio(twists: Sequence[TwoWay], normal: FloatArray, errors: SensorErrors) -> float:
    """Half of how far the torque went from one end to the other, less three standard deviations of noise."""
    means, noise = [], 0.0
    for pair in twists:
        for stroke in pair.both:
            pushing = -(stroke.force @ normal)
            means.append(batch_means(stroke.spin_torque(normal) / pushing, STRETCHES))
            sample = math.hypot(errors.moment_noise, _lever(stroke.wrench, pushing) * errors.force_noise)
            noise = max(noise, sample / math.sqrt(len(stroke) // STRETCHES) / float(pushing.mean()))
    ratios = np.concatenate(means)
    return max(0.0, 0.5 * (float(ratios.max() - ratios.min()) - 3.0 * math.sqrt(2.0) * noise))


def _lever(wrench: FloatArray, pushing: FloatArray) -> float:
    """By how much noise of the force comes into the torque [m]."""
    return float(np.linalg.norm(wrench[:, 3:], axis=1).mean() / pushing.mean())
