"""The set force of a loop with a delay: what should be felt now, and the rate when a command acts.

A command acts one delay after it is sent. So the profile is extrapolated by one delay with its rate, and the felt
force is compared with what was extrapolated one delay ago. Steps cannot be foreseen.
"""

import math
from collections import deque

from palpate.controllers.reference_force import ReferenceForce
from palpate.errors import not_negative, positive

MIN_STEP = 0.01
"""Lower bound on a step that `stepping` reports, as a share of the force."""

STEP_TIME_CONSTANTS = 5.0
"""Duration of a step response, in time constants: 4 % of the step are left."""


class SetPointFilter:
    """Smooths the steps of the set force and passes the rest without lag.

    How far the force overshoots after a step depends on how well the contact's stiffness is known: a contact
    softer than assumed looks, at first, like a surface that recedes. Changes at a rate known beforehand need no
    smoothing. So only the part of a change that the rates do not explain counts as a step; it is subtracted as a
    remainder that decays exactly like a critically damped second-order system.

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


class SetForce:
    """The set force of a loop with a delay.

    Attributes:
        force: Desired force now [N].
        rate: Desired rate of its elastic part when a command acts [N/s]; on a damped contact it lags the force.
        ahead_rate: Desired rate of the force itself at that time [N/s].
    """

    def __init__(
        self, delay: float, lead: float, period: float, *, damping_time: float = 0.0, step_time: float = 0.0
    ) -> None:
        """Take what is known of the loop.

        Args:
            delay: T of force control [s].
            lead: From a command to the tip's velocity [s].
            period: Of control [s].
            damping_time: c / K of the contact [s].
            step_time: Time constant of the response to a step of the force [s]; 0: as fast as the loop.
        """
        self._delay = positive("delay", delay, "s")
        positive("period", period, "s")
        self._filter = SetPointFilter(step_time, period)
        self._ahead = ReferenceForce(max(delay, lead), period)
        # F = K (d + damping_time d'): the depth, whose rate is fed forward, follows the force by so much
        damping = not_negative("damping_time", damping_time, "s")
        self._per_period = 1.0 if damping == 0.0 else 1.0 - math.exp(-period / damping)
        self._delays = max(1, round(delay / period))
        self._expected = deque([0.0], self._delays)
        self.hold(0.0)

    @property
    def stepping(self) -> float:
        """Sign of the step whose response is in progress; 0 without one."""
        return self._filter.stepping

    def hold(self, force: float) -> None:
        """Hold a constant force [N]."""
        self._filter.reset(force)
        self._ahead.reset(force, 0.0)
        self.force, self.rate, self.ahead_rate = force, 0.0, 0.0
        for _ in range(self._delays):
            self._expected.append(force)

    def step(self, force: float, rate: float) -> None:
        """Go on by one period to what the profile says: force [N] and rate [N/s]."""
        smooth, ahead = self._filter, self._ahead
        smooth.step(force, rate)
        ahead.step(smooth.force + smooth.rate * self._delay, smooth.rate)
        self.force, self.ahead_rate = self._expected[0], ahead.rate
        self.rate += self._per_period * (ahead.rate - self.rate)
        self._expected.append(ahead.force)
