"""Static friction, as far as rubbing measured it: from stick-slip, from mu extrapolated to rest, or a bound."""

import math
from collections.abc import Sequence

from palpate.experiments.friction.found import FrictionFound
from palpate.friction.friction_file import FrictionEstimate, How
from palpate.friction.rubbing.sliding import FrictionMeasured
from palpate.friction.rubbing.speed_curve import SpeedCurve
from palpate.friction.rubbing.stick_slip import MIN_LET_GO, STATIC_ABOVE, STATIC_BELOW

STATIC_RISE = 1.02
"""Least static over kinetic friction that is reported: less does not matter to a measurement at one speed."""

LEVEL = 0.02
"""How much of static friction may lie between the slowest stroke and rest, for the curve to determine it."""

STEEPER = 3.0
"""How many times as far mu may still rise as its Gaussian curve: a drop that is linear in the speed
rises three times as far from the slowest stroke to rest as one that is quadratic, given mu there and at twice that
speed."""


def static_finding(found: FrictionFound) -> FrictionEstimate | None:
    """Return mu at which slip begins, where that is more than in slip; None if nothing shows that."""
    frictions = _measured(found)
    sticking = [each for each in frictions if each.turns is not None]
    sure = [each for each in sticking if each.turns is not None and each.turns.times >= MIN_LET_GO]
    if sure:
        highest = max(sure, key=lambda each: each.static_friction or 0.0)
        mu, static = highest.friction, highest.static_friction or 0.0
        off = (mu.interval()[1] - mu.value) / mu.value
        return FrictionEstimate(
            value=static, lower=static / STATIC_ABOVE, upper=static * (STATIC_BELOW + off), how=How.MEASURED
        )
    by_curve = None if found.curve is None else _towards_rest(found, found.curve)
    if by_curve is not None and by_curve.how is How.MEASURED:
        return by_curve
    # it let go a few times, or mu still rose at the slowest speed: at least that much
    bounds = [each.turns.ratio / STATIC_ABOVE for each in sticking if each.turns is not None]
    bounds += [] if by_curve is None else [by_curve.value]
    lowest = min((each.friction.value for each in frictions), default=math.inf)
    least = max(bounds, default=0.0)
    if least < STATIC_RISE * lowest:
        return None
    return FrictionEstimate(value=least, lower=least, upper=math.inf, how=How.BOUND)


def _measured(found: FrictionFound) -> list[FrictionMeasured]:
    every = [each.friction for each in found.loads] + [each.friction for each in found.speeds]
    return [each for each in every if isinstance(each, FrictionMeasured)]


def _towards_rest(found: FrictionFound, curve: SpeedCurve) -> FrictionEstimate | None:
    """Static friction by extrapolating mu over the speed to rest."""
    kept = _slipped(found, curve)
    if len(kept) < 2:
        return None
    slow, lowest = kept[0].friction, min(each.friction.value for each in kept)
    lower, upper = slow.interval()
    if slow.value < STATIC_RISE * lowest:
        return None
    misfit = abs(curve.friction_at(kept[0].speed) / slow.value - 1.0)
    gap = curve.static_friction - slow.value
    determined = math.isfinite(curve.stribeck_speed) and misfit < 0.5 * LEVEL and kept[0].turns is None
    if not determined or gap > LEVEL * curve.static_friction:
        return FrictionEstimate(value=lower, lower=lower, upper=math.inf, how=How.BOUND)
    static = max(curve.static_friction, slow.value)
    most = slow.value + STEEPER * max(gap, 0.0) + (upper - slow.value)
    return FrictionEstimate(value=static, lower=lower, upper=max(static, most), how=How.MEASURED)


def _slipped(found: FrictionFound, curve: SpeedCurve) -> Sequence[FrictionMeasured]:
    """At one load, by rising speed; what crept left out."""
    slipped = [each.friction for each in found.speeds if isinstance(each.friction, FrictionMeasured)]
    return sorted((each for each in slipped if each.speed not in curve.creeping), key=lambda each: each.speed)
