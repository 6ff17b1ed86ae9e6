"""How mu depends on the slip speed, and which strokes crept instead of slipping.

What yields in proportion to the speed (a simulator's regularised friction below its creep speed, a film of
grease) looks like slip at any one speed: a steady force however far it goes. Only another speed shows it: such
friction is proportional to the speed, where dry friction hardly changes. Fitted to the rest (Armstrong-Helouvry,
Dupont, Canudas de Wit 1994):

    mu(v) = mu_k + (mu_s - mu_k) exp(-(v/v_s)^2) + viscous v.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.friction.rubbing.estimate import Estimate

LARGEST_CREEP_SLOPE = 0.3
"""Of d ln mu / d ln v between a stroke and the next faster one: 1 in creep, at most 0.1 or so in slip, as even
boundary lubrication changes mu by tens of per cent over decades of speed."""

MIN_CREEP_LOSS = 0.02
"""How much less mu must be than at the next faster speed to be called creep: below, it does no harm."""

_COARSE, _FINE = 60, 41
"""Values of v_s that are tried: over all of the range, and between neighbours of the best of these."""


@dataclass(frozen=True, slots=True)
class SpeedPoint:
    """mu at one slip speed.

    Attributes:
        speed: [m/s].
        friction: mu, as measured there.
    """

    speed: float
    friction: Estimate

    def __post_init__(self) -> None:
        positive("speed", self.speed, "m/s")


@dataclass(frozen=True, slots=True)
class SpeedCurve:
    """mu over the slip speed.

    Attributes:
        kinetic_friction: mu_k, Coulomb's.
        static_friction: mu_s, to which mu rises towards rest; equal to mu_k where nothing shows a rise.
        stribeck_speed: v_s [m/s]; infinite where nothing shows a rise.
        viscous_friction: Growth with the speed [s/m], 0 where nothing shows it.
        creeping: Speeds left out, at which the contact crept [m/s].
        creep_excluded: Whether at least two speeds were left: a single one cannot tell creep from slip.
    """

    kinetic_friction: float
    static_friction: float
    stribeck_speed: float
    viscous_friction: float
    creeping: tuple[float, ...]
    creep_excluded: bool

    def friction_at(self, speed: float) -> float:
        """Return mu at a slip speed [m/s]."""
        rise = self.static_friction - self.kinetic_friction
        drop = 0.0 if math.isinf(self.stribeck_speed) else rise * math.exp(-((speed / self.stribeck_speed) ** 2))
        return self.kinetic_friction + drop + self.viscous_friction * speed


def fit_speed_curve(points: Sequence[SpeedPoint]) -> SpeedCurve:
    """Return the simplest curve that explains mu at all speeds.

    Of a constant, one that grows, one that falls, and one that does both, the one with the least corrected Akaike
    information: so two or three speeds tell a constant or a growth, five tell all.

    Args:
        points: At one load, in any order; speeds a factor of two apart tell most.

    Raises:
        InvalidValueError: There are none.
    """
    if not points:
        raise InvalidValueError("0 speeds: must be at least one")
    ordered = sorted(points, key=lambda point: point.speed)
    crept = _crept(ordered)
    kept = ordered[crept:]
    v = np.array([point.speed for point in kept])
    mu = np.array([point.friction.value for point in kept])
    sd = np.maximum([point.friction.noise for point in kept], 1e-4 * mu)
    coarse = np.geomspace(0.5 * v[0], v[-1], _COARSE)
    best = _best(v, mu, sd, (None, *coarse.tolist()))
    if best is not None and math.isfinite(best[1][2]):
        step = float(coarse[1] / coarse[0])
        fine = np.geomspace(best[1][2] / step, best[1][2] * step, _FINE)
        finer = _best(v, mu, sd, fine.tolist())
        best = finer if finer is not None and finer[0] < best[0] else best
    found = (float(np.average(mu, weights=sd**-2)), 0.0, math.inf, 0.0) if best is None else best[1]
    kinetic, rise, speed, growth = found
    return SpeedCurve(
        kinetic, kinetic + rise, speed, growth, tuple(point.speed for point in ordered[:crept]), len(kept) > 1
    )


def _best(
    v: FloatArray, mu: FloatArray, sd: FloatArray, speeds: Sequence[float | None]
) -> tuple[float, tuple[float, float, float, float]] | None:
    """Information, and mu_k, rise to static, v_s and growth, of the best curve with one of these v_s, or none."""
    best = None
    for stribeck in speeds:
        for grows in (False, True):
            columns = [np.ones_like(v)]
            if stribeck is not None:
                columns.append(np.exp(-((v / stribeck) ** 2)))
            if grows:
                columns.append(v)
            unknowns = len(columns) + (stribeck is not None)
            if unknowns > 1 and len(v) < unknowns + 1:
                continue
            information, weights = _information(np.column_stack(columns), mu, sd, unknowns)
            if best is None or information < best[0]:
                rise = 0.0 if stribeck is None else float(weights[1])
                growth = float(weights[-1]) if grows else 0.0
                best = information, (float(weights[0]), rise, math.inf if stribeck is None else stribeck, growth)
    return best


def _crept(ordered: Sequence[SpeedPoint]) -> int:
    """How many of the slowest crept: all up to the fastest pair between which mu rises with the speed."""
    for i in range(len(ordered) - 2, -1, -1):
        slow, fast = ordered[i], ordered[i + 1]
        low, high = slow.friction.value, fast.friction.value
        noise = math.hypot(slow.friction.noise, fast.friction.noise)
        if high - low < MIN_CREEP_LOSS * high + 3.0 * noise:
            continue
        if low <= 0.0 or math.log(high / low) > LARGEST_CREEP_SLOPE * math.log(fast.speed / slow.speed):
            return i + 1
    return 0


def _information(columns: FloatArray, mu: FloatArray, sd: FloatArray, unknowns: int) -> tuple[float, FloatArray]:
    """Akaike's information for known noise, doubly charged for what few points can always explain; and the fit."""
    weights, residual = nnls(columns / sd[:, None], mu / sd)
    # Burnham & Anderson 2002, chapter 2: 2 k n / (n - k - 1), where that exists
    spare = max(len(mu) - unknowns - 1, 0.5)
    return float(residual**2) + 2.0 * unknowns * (1.0 + (unknowns + 1) / spare), np.asarray(weights)
