"""A set-point filter that smooths the steps of the set force and passes the rest without lag.

How far the force overshoots after a step depends on how well the contact's stiffness is known: a contact softer
than assumed looks, at first, like a surface that recedes. Changes at a rate known beforehand need no smoothing. So
only the part of a change that the rates do not explain counts as a step; it is subtracted as a remainder that
decays exactly like a critically damped second-order system.
"""

import math

from palpate.errors import not_negative, positive

MIN_STEP = 0.01
"""Lower bound on a step that `stepping` reports, as a share of the force."""

STEP_TIME_CONSTANTS = 5.0
"""Duration of a step response, in time constants: 4 % of the step are left."""


class SetPointFilter:
    """Smooths steps of the set force.

    Attributes:
        force: Filtered set force [N].
        rate: Its rate [N/s].
        stepping: Sign of the step whose response is in progress; 0 without one, and for at least half of the time,
            however often the force steps.
    """

    def __init__(self, time_constant: float, period: float) -> None:
        """Take the time constant of a step response [s], 0 to pass steps on, and the control period [s]."""
        self._tau = not_negative("time_constant", time_constant, "s")
        self._period = positive("period", period, "s")
        self._fading = math.exp(-period / time_constant) if time_constant else 0.0
        self._periods = round(STEP_TIME_CONSTANTS * time_constant / period)
        self.reset(0.0)

    def reset(self, force: float) -> None:
        """Begin at a force [N] that stands still."""
        self.force, self.rate = force, 0.0
        self._remainder = self._slope = 0.0
        self._last = (force, 0.0)
        self.stepping, self._left = 0.0, 0

    def step(self, force: float, rate: float) -> None:
        """Go on by one period to what a profile says.

        Args:
            force: [N].
            rate: [N/s].
        """
        if self._tau == 0.0:
            self.force, self.rate = force, rate
            return
        last, last_rate = self._last
        self._last = (force, rate)
        period, tau = self._period, self._tau
        # r = (a + b t) e^{-t/tau}
        a, b = self._remainder, self._slope + self._remainder / tau
        self._remainder = (a + b * period) * self._fading
        self._slope = b * self._fading - self._remainder / tau
        # the part that neither rate explains; a step of the rate alone is no step of the force
        change, one, other = force - last, rate * period, last_rate * period
        step = change - min(max(change, min(one, other)), max(one, other))
        self._remainder += step
        if self._left > 0:
            self._left -= 1
            if self._left <= self._periods:
                self.stepping = 0.0
        elif abs(step) > MIN_STEP * abs(force):
            self.stepping, self._left = math.copysign(1.0, step), 2 * self._periods
        self.force, self.rate = force - self._remainder, rate - self._slope
