"""Identification of the contact and of the robot behind it by pressing, and the force gain that follows.

Ramps between two forces give the stiffnesses: force against where the tip is, of the contact (K, with a viscous
part c v that must not be taken for it); and how far the tip falls behind its commands under force, of the servo.
Sines from slow to fast give the force's whole response to commands, and with it the largest gain that force
control bears: robots and damped contacts have no such thing as one delay, and are stiffer when it goes fast. Where
that is what limits the gain, an admittance bears a larger one: see `palpate.controllers.measured_admittance`.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.controllers.gains import LOOP_GAIN, ForceGain, series_stiffness
from palpate.controllers.measured_admittance import MeasuredAdmittance, measured_admittance
from palpate.controllers.measured_loop import ForceResponse
from palpate.controllers.tone import Tone, lag_of
from palpate.errors import FloatArray, InvalidValueError
from palpate.estimation import Assumption, BrokenAssumption, Verdict

LINEAR_WITHIN = 0.1
"""A contact counts as linear if its stiffness changes by less than this over the ramps, or by no more than its
uncertainty explains."""

MIN_SAMPLES = 100
"""Least number of samples on steady ramps from which a contact is identified."""

SIGMAS = 3.0
"""Standard deviations that a number must differ by to differ."""

LARGEST_SD = 0.1
"""Of a stiffness or of a response to a sine, relative: a tenth of the phase margin, nearly."""

LARGEST_CHANGE = 0.2
"""Of the stiffness from one half of the ramps to the other, relative, beyond `SURE` standard deviations."""

SURE = 5.0
"""Standard deviations: residuals of ramps are hardly white."""

STEEPEST = 1.5
"""Stiffness at an end of the ramps over that in the middle: half of the gain margin is then gone."""


@dataclass(frozen=True, slots=True)
class MeasuredValue:
    """A number and its standard deviation."""

    value: float
    sd: float


@dataclass(frozen=True, slots=True)
class Identification:
    """What was found.

    Attributes:
        stiffness: K of the contact, in the middle of the ramps [N/m].
        linear: Whether it is the same all over the ramps.
        stiffness_low: K where the force is lowest [N/m].
        stiffness_high: K where it is highest [N/m].
        damping_time: c / K of the contact [s].
        servo_stiffness: Of the robot alone [N/m]; None where the contact yields too much to tell.
        series_stiffness: Of contact and servo [N/m].
        lag: By which the tip, in contact, follows a slow sine [s]; negative if it is led.
        delay: T [s]: that of a delayed integrator which begins to oscillate at the same gain as this contact.
        oscillation_frequency: At which that would be [Hz].
        gain: Of force control, with its margins.
        phase_margin_deg: As measured at that gain [degrees].
        verdict: Whether force control may go by it.
        admittance: A law that bears a larger gain, where one is found; None where the direct law does as well.
    """

    stiffness: MeasuredValue
    linear: bool
    stiffness_low: float
    stiffness_high: float
    damping_time: float
    servo_stiffness: MeasuredValue | None
    series_stiffness: MeasuredValue
    lag: MeasuredValue
    delay: MeasuredValue
    oscillation_frequency: float
    gain: ForceGain
    phase_margin_deg: float
    verdict: Verdict
    admittance: MeasuredAdmittance | None = None


@dataclass(frozen=True, slots=True, eq=False)
class PressRecord:
    """What was recorded on the ramps, one entry per period.

    Attributes:
        force: Normal force [N], shape (n,).
        depth: n.x of the tip [m], shape (n,).
        wanted: Likewise as commanded, the commands so far added up [m], shape (n,).
        steady: Whether the tip has gone on at the same speed for a while, shape (n,).
        period: Of control [s].
    """

    force: FloatArray
    depth: FloatArray
    wanted: FloatArray
    steady: npt.NDArray[np.bool_]
    period: float


def identify(
    record: PressRecord, tones: Sequence[Tone], sensing_delay: float, loop_gain: float = LOOP_GAIN
) -> Identification:
    """Return the parameters identified from a record.

    Args:
        record: Of the ramps.
        tones: Of the sines, from slow to fast: depth, wanted, force.
        sensing_delay: From a load to the observation that shows it [s]: `Touch.delay`.
        loop_gain: Wanted k K T.

    Raises:
        InvalidValueError: The ramps were too short.
    """
    found = int(np.count_nonzero(record.steady))
    if found < MIN_SAMPLES:  # a velocity takes two at least
        raise _too_short(found)
    behind = round(sensing_delay / record.period)
    span = slice(None, -behind) if behind else slice(None)
    velocity = np.gradient(record.depth, record.period)
    steady = record.steady[behind:]  # of the force, which turns later
    force, depth = record.force[behind:][steady], record.depth[span][steady]
    behind_commands, velocity = (record.wanted - record.depth)[span][steady], velocity[span][steady]
    if len(force) < MIN_SAMPLES:
        raise _too_short(len(force))
    stiffness, curve, damping_time = _contact(force, depth, velocity)
    half = 0.5 * float(np.ptp(depth))
    change = 4.0 * abs(curve.value) * half  # of dF/dx = K + 2 q x, from end to end
    linear = change < LINEAR_WITHIN * stiffness.value or change < SIGMAS * 4.0 * curve.sd * half
    servo = _servo(force, behind_commands, depth, velocity)
    series = _series(stiffness, servo)

    response = ForceResponse(
        np.array([tone.angular for tone in tones]),
        np.array([tone.amplitude(2) / tone.amplitude(1) for tone in tones]),
        record.period,
    )
    gain, (frequency, critical) = response.gain(loop_gain), response.oscillation()
    # k K T = pi/2 where the delayed integrator begins to oscillate
    delay = 0.5 * math.pi / (critical * series.value)
    near = min(tones, key=lambda tone: abs(tone.angular - frequency))
    relative = math.hypot(near.noise(2) / abs(near.amplitude(2)), series.sd / series.value)
    middle = len(force) // 2
    halves = [
        _contact(force[part], depth[part], velocity[part])[0] for part in (slice(middle), slice(middle, None))
    ]
    steepest = 1.0 if linear else 1.0 + 2.0 * abs(curve.value) * half / stiffness.value
    return Identification(
        stiffness=stiffness,
        linear=linear,
        stiffness_low=stiffness.value - 2.0 * curve.value * half,
        stiffness_high=stiffness.value + 2.0 * curve.value * half,
        damping_time=damping_time,
        servo_stiffness=servo,
        series_stiffness=series,
        lag=_lag(tones[0]),
        delay=MeasuredValue(delay, delay * relative),
        oscillation_frequency=frequency / (2.0 * math.pi),
        gain=ForceGain(gain, series.value, delay),
        phase_margin_deg=response.phase_margin_deg(gain),
        verdict=Verdict(tuple(_broken(relative, halves, steepest))),
        admittance=measured_admittance(response, series.value, loop_gain),
    )


def _broken(relative: float, halves: Sequence[MeasuredValue], steepest: float) -> Iterator[BrokenAssumption]:
    if relative > LARGEST_SD:
        yield BrokenAssumption(
            Assumption.CONDITIONED,
            f"stiffness and delay are uncertain by {relative:.0%}, at most {LARGEST_SD:.0%}",
            "press with more force, or with a sensor of less noise",
        )
    first, second = halves
    change = abs(second.value - first.value)
    if change > max(
        LARGEST_CHANGE * min(abs(first.value), abs(second.value)), SURE * math.hypot(first.sd, second.sd)
    ):
        yield BrokenAssumption(
            Assumption.WHITE_IN_TIME,
            f"the stiffness is {first.value:.3g} N/m in the first half of the ramps, {second.value:.3g} in the "
            f"second, at most {LARGEST_CHANGE:.0%} apart",
            "let it land on a surface that stands still and does not give way",
        )
    if steepest > STEEPEST:
        yield BrokenAssumption(
            Assumption.WHITE_IN_PLACE,
            f"at an end of the ramps the contact is {steepest:.2g} times as stiff as in the middle, at most "
            f"{STEEPEST:g} times",
            "press between forces that are nearer to each other",
        )


def _too_short(samples: int) -> InvalidValueError:
    return InvalidValueError(
        f"the ramps have {samples} steady samples: must have {MIN_SAMPLES} at least; take a smaller rate"
    )


def _contact(
    force: FloatArray, depth: FloatArray, velocity: FloatArray
) -> tuple[MeasuredValue, MeasuredValue, float]:
    """K [N/m], its slope q [N/m^2] and c / K [s] of F = F0 + K x + q x^2 + c v, x from the middle."""
    x = depth - 0.5 * (depth.min() + depth.max())
    columns = np.stack([np.ones_like(x), x, x * x, velocity], axis=1)
    found, sd = _least_squares(columns, force)
    return MeasuredValue(found[1], sd[1]), MeasuredValue(found[2], sd[2]), found[3] / found[1]


def _servo(force: FloatArray, behind: FloatArray, depth: FloatArray, velocity: FloatArray) -> MeasuredValue | None:
    """The servo's stiffness from how far the tip is behind its commands: F / K_s + lag v, from where it began."""
    columns = np.stack([np.ones_like(force), force, velocity], axis=1)
    found, sd = _least_squares(columns, behind)
    compliance, uncertainty = found[1], sd[1]
    # a hundredth of the contact's own compliance is what the ramps' ends, not noise, make uncertain
    if compliance < max(SIGMAS * uncertainty, 0.01 * float(np.ptp(depth) / np.ptp(force))):
        return None
    return MeasuredValue(1.0 / compliance, uncertainty / compliance**2)


def _series(contact: MeasuredValue, servo: MeasuredValue | None) -> MeasuredValue:
    """Both in series; compliances add up, and so do their variances."""
    if servo is None:
        return contact
    value = series_stiffness(contact.value, servo.value)
    return MeasuredValue(value, value**2 * math.hypot(contact.sd / contact.value**2, servo.sd / servo.value**2))


def _lag(tone: Tone) -> MeasuredValue:
    """Lag of the tip behind its commands."""
    depth, wanted = tone.amplitude(0), tone.amplitude(1)
    return MeasuredValue(lag_of(depth / wanted, tone.angular), tone.noise(0) / (abs(depth) * tone.angular))


def _least_squares(columns: FloatArray, values: FloatArray) -> tuple[list[float], list[float]]:
    """Coefficients and their standard deviations, from the residuals; columns scaled to their largest entries."""
    scale = np.abs(columns).max(axis=0)
    scale[scale == 0.0] = 1.0
    A = columns / scale
    found, *_ = np.linalg.lstsq(A, values, rcond=None)
    rest = values - A @ found
    variance = float(rest @ rest) / max(1, len(values) - A.shape[1])
    covariance = variance * np.linalg.pinv(A.T @ A)
    return (found / scale).tolist(), (np.sqrt(np.diag(covariance)) / scale).tolist()
