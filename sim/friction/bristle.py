"""The load that a bristle bears at the end of a time step, compiled: return mapping onto the limit surface.

A contact is an elastic-viscous bristle (stiffness K, damping C, about the normal r^2 as much) in series with a
slider that slips when the load is on the limit surface, along its normal. Backward Euler over a time step dt turns
that into a trial load, borne if nothing slipped, and where it lies outside, into its projection onto the limit
surface in the norm of the bristle's compliance (Simo & Hughes 1998, chapter 3). So a load inside is borne for ever
without creep, a load outside never appears, and what is dissipated is never negative: the surface is convex and
holds the origin. LuGre's model was not taken, as it creeps under any vibration (Dupont et al. 2002).

In full slip mu depends on the slip speed and this on mu: one equation for the speed, solved implicitly. The
surface is isotropic, so lengths are enough here: both |f_t| and |tau| only shrink.
"""

import math
from collections.abc import Callable
from typing import TypeVar, cast

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.sim.friction.law import FrictionLaw

_Function = TypeVar("_Function", bound=Callable[..., object])

STATIC, KINETIC, STRIBECK, VISCOUS, SPIN_LENGTH, LOAD_EXPONENT, NORM_EXPONENT, STIFFNESS, DAMPING = range(9)
"""Where the entries of a packed law are."""

NO_FORCE = 1e-12
"""A normal force [N] below which nothing is borne: 1e-9 of a sensor's noise, and no division overflows."""

_FARTHEST = 60.0
"""Largest |log(y/x)| looked at: the smaller of the two is then 1e-26 of its limit."""
_ITERATIONS = 100
"""Nothing needs more: bisection alone ends after 60."""


def compiled(function: _Function) -> _Function:
    """Compile a function of the inner loop; it keeps its type."""
    return cast(_Function, njit(error_model="numpy")(function))


def compiled_once(function: _Function) -> _Function:
    """Compile a function that Python calls, and what it calls, and keep the result on disk."""
    return cast(_Function, njit(error_model="numpy", cache=True)(function))


def packed(law: FrictionLaw, damping: float) -> tuple[float, ...]:
    """Return a law and the bristle's damping [N s/m] in the order of the constants above."""
    return (
        law.static_friction,
        law.kinetic_friction,
        law.stribeck_speed,
        law.viscous_friction,
        law.spin_length,
        law.load_exponent,
        law.norm_exponent,
        law.stiffness,
        damping,
    )


@compiled
def nearest(a: float, b: float, w: float, p: float) -> tuple[float, float]:
    """Return the x, y >= 0 with x^p + y^p = 1 that minimise (x - a)^2 + w (y - b)^2, for a, b >= 0 outside.

    There (a - x) / x^(p-1) = w (b - y) / y^(p-1). The logarithm of it, left less right, is nearly linear in
    log(y/x) and rises throughout x < a, y < b: Newton's method within a shrinking bracket.
    """
    if b <= 0.0:
        return 1.0, 0.0
    if a <= 0.0:
        return 0.0, 1.0
    if p == 2.0 and abs(w - 1.0) < 1e-15:
        length = math.sqrt(a * a + b * b)
        return a / length, b / length
    if p == 1.0:
        x = min(max((a + w * (1.0 - b)) / (1.0 + w), 0.0), 1.0)
        return x, 1.0 - x
    low = math.log(a**-p - 1.0) / p if a < 1.0 else -_FARTHEST
    high = -math.log(b**-p - 1.0) / p if b < 1.0 else _FARTHEST
    low, high = max(low, -_FARTHEST), min(high, _FARTHEST)
    x, y = 1.0, 0.0
    between = 0.5 * (low + high)
    for _ in range(_ITERATIONS):
        ratio = math.exp(p * between)
        share = ratio / (1.0 + ratio)  # y^p
        if ratio < 1.0:
            x = (1.0 + ratio) ** (-1.0 / p)
            y = x * math.exp(between)
        else:
            y = (1.0 + 1.0 / ratio) ** (-1.0 / p)
            x = y * math.exp(-between)
        over, above = a - x, b - y
        if over <= 0.0:
            low = between
            between = 0.5 * (low + high)
        elif above <= 0.0:
            high = between
            between = 0.5 * (low + high)
        else:
            value = math.log(over / (w * above)) + (p - 1.0) * between
            slope = p - 1.0 + x * share / over + y * (1.0 - share) / above
            if value < 0.0:
                low = between
            else:
                high = between
            step = value / slope
            guess = between - step
            if not low < guess < high:
                guess = 0.5 * (low + high)
            done = abs(guess - between) <= 1e-15 * max(1.0, abs(between))
            between = guess
            if done:
                break
        if high - low <= 1e-15:
            break
    return x, y


@compiled
def slipped(
    force: float, torque: float, most: float, drag: float, e: float, w: float, p: float
) -> tuple[float, float, float]:
    """Return the load on the limit surface nearest to a trial load, and the slip speed that takes it there."""
    a, b = force / most, torque / (most * e)
    x, y = nearest(a, b, w, p)
    return x * most, y * most * e, most / drag * ((a - x) * x + w * (b - y) * y)


@compiled
def borne(
    force: float, torque: float, normal_force: float, drag: float, law: FloatArray, factor: float
) -> tuple[float, float, float]:
    """Return what of a trial load is borne.

    Args:
        force: Length of the tangential trial force [N].
        torque: Size of the trial torque about the normal [N m].
        normal_force: [N].
        drag: Force per slip speed, K dt + C [N s/m].
        law: As packed, shape (9,).
        factor: By which mu is multiplied at this place.

    Returns:
        Force [N], torque [N m], slip speed [m/s]: exactly 0 if it sticks.
    """
    radius = law[SPIN_LENGTH]
    if normal_force <= NO_FORCE:
        return 0.0, 0.0, math.hypot(force, torque / radius) / drag
    e = radius * normal_force ** law[LOAD_EXPONENT]
    w, p = (e / radius) ** 2, law[NORM_EXPONENT]
    static, kinetic = factor * law[STATIC] * normal_force, factor * law[KINETIC] * normal_force
    if (force / static) ** p + (torque / (static * e)) ** p <= 1.0:
        return force, torque, 0.0
    found = slipped(force, torque, static, drag, e, w, p)
    growth = factor * law[VISCOUS] * normal_force
    if static == kinetic and growth == 0.0:
        return found
    # slip against the least friction is fastest: that brackets the speed; then regula falsi (Illinois)
    low, excess_low = 0.0, found[2]
    high = slipped(force, torque, kinetic, drag, e, w, p)[2]
    at, excess_high, kept = high, 0.0, 0
    for _ in range(_ITERATIONS):
        drop = math.exp(-((at / law[STRIBECK]) ** 2))
        found = slipped(force, torque, kinetic + (static - kinetic) * drop + growth * at, drag, e, w, p)
        excess = found[2] - at
        # one part in 1e12 of the speed
        if abs(excess) <= 1e-12 * high or high - low <= 1e-12 * high:
            break
        if excess > 0.0:
            low, excess_low = at, excess
            if kept == 1:
                excess_high *= 0.5
            kept = 1
        else:
            high, excess_high = at, excess
            if kept == -1:
                excess_low *= 0.5
            kept = -1
        at = (low * excess_high - high * excess_low) / (excess_high - excess_low)
        if not low < at < high:
            at = 0.5 * (low + high)
    return found
