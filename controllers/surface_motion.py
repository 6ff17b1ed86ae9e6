"""Tracks and predicts the motion of a surface along the normal, as measured by the tip that presses on it.

With n into the object, the contact's force is F = K (n.x - s): so the surface moves with s' = n.v - F' / K, v
being the tip's measured velocity. No delay of the robot is in that; only looking ahead has to bridge the delay T
until a command acts. Value, slope and curvature of s' are tracked by a fading-memory filter of third order
(Brookner 1998, section 1.3; all three poles at exp(-period / time constant)), which follows a parabola without
lag.

A wrong K is a feedback: with the true stiffness r K the tip's own velocity passes for (1 - r) of a surface's. That
is why the filter may not be fast. `stiffness_range` computes from the sampled loop for which r it is stable.
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.controllers.gains import ForceGain
from palpate.controllers.margins import whole_delays
from palpate.errors import FloatArray, check_positive, positive

SMOOTHING_IN_DELAYS = 3.0
"""Default time constant, in delays T of force control. At the default force gain, k K T = 0.5, the loop is then
stable for true stiffnesses of 0.4 to 1.77 times the assumed one, and with half of gain and forward feed, to which
`ForceGuard` falls back, for any from 0 to 2.9 times; see the tests."""

MIN_DELAY = 0.02
"""[s] from which the default time constant is counted: an arm that is led has none, but slow servos."""

FASTEST_SURFACE = 0.05
"""Largest speed that is fed forward [m/s]: what is beyond is more likely an error."""


@dataclass(frozen=True, slots=True)
class SurfaceFilter:
    """How the surface's motion is tracked.

    Attributes:
        stiffness: K of the contact alone, without the robot's own [N/m].
        lead: How far ahead the motion is predicted [s]: from a command to the tip's velocity.
        time_constant: Of each of the three poles [s].
        fastest: Largest speed that is fed forward [m/s].
    """

    stiffness: float
    lead: float
    time_constant: float
    fastest: float = FASTEST_SURFACE

    def __post_init__(self) -> None:
        check_positive(self, stiffness="N/m", lead="s", time_constant="s", fastest="m/s")

    def coefficients(self, period: float) -> tuple[float, float, float]:
        """Return the filter's weights on value, slope and curvature of an innovation, in units of the period."""
        r = math.exp(-period / self.time_constant)
        return 1.0 - r**3, 1.5 * (1.0 - r) ** 2 * (1.0 + r), (1.0 - r) ** 3


def surface_filter(stiffness: float, gain: ForceGain, lead: float) -> SurfaceFilter:
    """Return the default filter.

    Args:
        stiffness: K of the contact alone [N/m].
        gain: Of force control.
        lead: From a command to the tip's velocity [s].
    """
    return SurfaceFilter(stiffness, lead, SMOOTHING_IN_DELAYS * max(gain.delay, lead, MIN_DELAY))


class SurfaceMotion:
    """Tracks and predicts the velocity of a surface along the normal.

    Attributes:
        settings: Of the filter.
    """

    def __init__(self, settings: SurfaceFilter, period: float) -> None:
        """Take the filter's settings and the control period [s]."""
        self.settings = settings
        self._period = positive("period", period, "s")
        self._weights = settings.coefficients(period)
        self._ahead = settings.lead / period
        self.stiffness = settings.stiffness
        self.reset()

    @property
    def stiffness(self) -> float:
        """Of the contact [N/m]: that of the settings, or as it has shown itself meanwhile."""
        return 1.0 / (self._per_force * self._period)

    @stiffness.setter
    def stiffness(self, stiffness: float) -> None:
        self._per_force = 1.0 / (stiffness * self._period)

    def reset(self) -> None:
        """Forget: the surface stands still."""
        self._value = self._slope = self._curve = 0.0
        self._force: float | None = None

    def update(self, normal_velocity: float, normal_force: float) -> None:
        """Take what was measured in this period.

        Args:
            normal_velocity: n.v of the tip, into the object [m/s].
            normal_force: [N].
        """
        if self._force is None:
            self._force = normal_force
        measured = normal_velocity - (normal_force - self._force) * self._per_force
        self._force = normal_force
        a, b, c = self._weights
        slope = self._slope + self._curve
        value = self._value + self._slope + 0.5 * self._curve
        innovation = measured - value
        self._value = value + a * innovation
        self._slope = slope + b * innovation
        self._curve += c * innovation

    @property
    def velocity(self) -> float:
        """Of the surface along the normal, away from the tip [m/s], now."""
        return self._value

    @property
    def predicted(self) -> float:
        """Likewise, `lead` seconds ahead, at most `fastest` in magnitude [m/s]."""
        ahead, fastest = self._ahead, self.settings.fastest
        velocity = self._value + ahead * (self._slope + 0.5 * ahead * self._curve)
        return min(max(velocity, -fastest), fastest)


@dataclass(frozen=True, slots=True)
class StiffnessRange:
    """True stiffnesses, per assumed one, between which a loop is stable (both excluded).

    Attributes:
        softest: 0 if there is no lower end.
        stiffest: Infinite if it lies beyond what was looked at.
    """

    softest: float
    stiffest: float


SOFTEST_LOOKED_AT, STIFFEST_LOOKED_AT = 0.01, 10.0


def stiffness_range(
    gain: ForceGain, settings: SurfaceFilter | None, period: float, share: float = 1.0
) -> StiffnessRange:
    """Return for which stiffnesses force control with a surface's motion fed forward is stable.

    From the eigenvalues of the sampled loop: a command acts after `gain.delay`, the contact is a spring, and all
    of the delay lies before the tip's velocity.

    Args:
        gain: Of force control.
        settings: Of the surface's motion; None for force control alone.
        period: Of control [s].
        share: Of gain and forward feed that acts, see `ForceGuard`.
    """

    def stable(ratio: float) -> bool:
        return _growth(gain, settings, period, share, ratio) < 1.0

    softest, stiffest = 1.0, 1.0
    if not stable(1.0):
        return StiffnessRange(1.0, 1.0)
    step = 1.05
    while softest > SOFTEST_LOOKED_AT and stable(softest / step):
        softest /= step
    while stiffest < STIFFEST_LOOKED_AT and stable(stiffest * step):
        stiffest *= step
    return StiffnessRange(
        0.0 if softest <= SOFTEST_LOOKED_AT else softest,
        math.inf if stiffest >= STIFFEST_LOOKED_AT else stiffest,
    )


def _growth(gain: ForceGain, settings: SurfaceFilter | None, period: float, share: float, ratio: float) -> float:
    """Largest factor by which a deviation of the closed loop grows in one period."""
    return float(np.abs(np.linalg.eigvals(closed_loop(gain, settings, period, share, ratio))).max())


def closed_loop(
    gain: ForceGain, settings: SurfaceFilter | None, period: float, share: float = 1.0, ratio: float = 1.0
) -> FloatArray:
    """Return the matrix that takes the loop's state from one period to the next, from a surface at rest.

    States: where the tip is and was, value, slope and curvature of the filter in units of the period, and the
    commands in transit, oldest first.

    Args:
        gain: Of force control.
        settings: Of the surface's motion; None for force control alone.
        period: Of control [s].
        share: Of gain and forward feed that acts.
        ratio: Of the true stiffnesses to those assumed, of contact and of both in series alike.
    """
    steps = whole_delays(gain.delay, period)
    a, b, c = (0.0, 0.0, 0.0) if settings is None else settings.coefficients(period)
    ahead = 0.0 if settings is None else settings.lead / period
    size = 5 + steps
    move = np.zeros((size, size))
    state = np.eye(size)
    x, before, value, slope, curve = state[:5]
    underway = state[5:]
    measured = (x - before) / period * (1.0 - ratio)
    value, slope = value + slope + 0.5 * curve, slope + curve
    innovation = measured - value
    value, slope, curve = value + a * innovation, slope + b * innovation, curve + c * innovation
    forward = value + ahead * (slope + 0.5 * ahead * curve) if settings is not None else np.zeros(size)
    command = share * (forward - gain.gain * ratio * gain.stiffness * x)
    move[0], move[1] = x + period * underway[0], x
    move[2:5] = (value, slope, curve) if settings is not None else np.zeros((3, size))
    move[5:-1], move[-1] = underway[1:], command
    return move
