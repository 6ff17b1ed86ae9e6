"""Interpolated ratio of mu at two slip speeds, with its uncertainty.

Between two rubbed speeds mu lies between the two, wherever it rises or falls evenly. The curve through all speeds
says more, if it goes through all that was measured: as much more as it agrees with a curve of no law at all
(Fritsch & Carlson 1980, monotone cubics, over ln v).
"""

import math
from collections.abc import Sequence

import numpy as np
from scipy.interpolate import PchipInterpolator

from palpate.errors import InvalidValueError, positive
from palpate.friction.rubbing.estimate import Estimate
from palpate.friction.rubbing.speed_curve import SpeedCurve, SpeedPoint

LARGEST_MISFIT = 0.003
"""How far a point may lie off the curve, relative, beyond three deviations of its noise, and the curve still be
believed between the points: a tenth of what is wanted of mu."""

BEYOND = 1.0
"""Standard deviation of ln mu per change of ln v outside of what was rubbed, over that within: as much
again: a Stribeck curve is steeper beyond as often as it levels."""

VIBRATED = 0.1
"""ASSUMPTION: by how much a twist may slip faster than its finger turns, relative, where mu falls with the speed:
contacts then vibrate unseen. Of 11 % the torques of simulated twists at 4 N showed."""

_EVEN = math.sqrt(12.0)
"""Width over standard deviation of what lies evenly between two ends."""

_ROUNDS = 40


def friction_ratio(curve: SpeedCurve, points: Sequence[SpeedPoint], speed: float, reference: float) -> Estimate:
    """Return mu at a slip speed over mu at another.

    Args:
        curve: Through the points.
        points: As measured, in any order; those at which it crept are left out.
        speed: Of the first [m/s].
        reference: Of the second [m/s]; it should be one of the points.

    Raises:
        InvalidValueError: No point is left.
    """
    positive("speed", speed, "m/s")
    kept = sorted((point for point in points if point.speed not in curve.creeping), key=lambda each: each.speed)
    if not kept:
        raise InvalidValueError("0 speeds without creep: must be at least one")
    if len(kept) == 1:
        return Estimate(1.0, 0.0, 0.0)
    x = np.log([point.speed for point in kept])
    mu = np.array([point.friction.value for point in kept])
    noise = np.array([point.friction.noise for point in kept])
    free = PchipInterpolator(x, mu)
    at, asked = (min(max(math.log(v), float(x[0])), float(x[-1])) for v in (speed, reference))
    bare = float(free(at)) / float(free(asked))
    off = np.abs([curve.friction_at(point.speed) - point.friction.value for point in kept])
    believed = bool((off <= 3.0 * noise + LARGEST_MISFIT * mu).all())
    value = curve.friction_at(speed) / curve.friction_at(reference) if believed else bare

    i = min(max(int(np.searchsorted(x, at)) - 1, 0), len(kept) - 2)
    step = abs(math.log(mu[i + 1] / mu[i]))
    share = (at - float(x[i])) / float(x[i + 1] - x[i])
    between = step / _EVEN * 2.0 * math.sqrt(max(0.0, share * (1.0 - share)))
    if believed:
        between = min(between, abs(math.log(value / bare)))
    outside = abs(math.log(speed) - at)
    beyond = BEYOND * outside * step / float(x[i + 1] - x[i])
    known = math.hypot(noise[i] / mu[i], noise[i + 1] / mu[i + 1])
    return Estimate(value, value * known, value * math.hypot(between, beyond))


def spin_friction(
    curve: SpeedCurve, points: Sequence[SpeedPoint], torque_speed: float, friction: Estimate, reference: float
) -> tuple[Estimate, float]:
    """Return mu at the slip speed of a twist, and that speed [m/s].

    A twist's speed is e omega, and e = (tau / f_n) / mu: so mu and speed are looked for together, at which
    speed mu = omega tau / f_n.

    Args:
        curve: mu over the speed.
        points: As measured.
        torque_speed: Spin times torque over normal force [m/s].
        friction: mu at `reference`.
        reference: Speed at which strokes measured it [m/s].
    """
    positive("torque_speed", torque_speed, "m/s")
    speed = torque_speed / friction.value
    ratio = friction_ratio(curve, points, speed, reference)
    for _ in range(_ROUNDS):
        again = torque_speed / (friction.value * ratio.value)
        if abs(again - speed) < 1e-9 * speed:
            break
        speed = math.sqrt(speed * again)
        ratio = friction_ratio(curve, points, speed, reference)
    nearby = friction_ratio(curve, points, 1.02 * speed, reference)
    slope = math.log(nearby.value / ratio.value) / math.log(1.02)
    # mu too large by 1 % makes e, and so the speed, too small: where mu falls with it, mu is larger still
    gain = ratio.value / max(1.0 + slope, 0.2)
    mu = friction.value
    return (
        Estimate(
            ratio.value * mu,
            math.hypot(ratio.value * friction.noise, gain * mu * ratio.noise / ratio.value),
            math.hypot(
                ratio.value * friction.model,
                gain * mu * ratio.model / ratio.value,
                ratio.value * mu * VIBRATED * max(-slope, 0.0),
            ),
            friction.freedom,
        ),
        speed,
    )
