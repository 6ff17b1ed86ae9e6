"""The set force of a loop with a delay: what should be felt now, and the rate when a command acts.

A command acts one delay after it is sent. So the profile is extrapolated by one delay with its rate, and the felt
force is compared with what was extrapolated one delay ago. Steps cannot be foreseen.
"""

import math
from collections import deque

from palpate.controllers.reference_force import ReferenceForce
from palpate.controllers.set_point_filter import SetPointFilter
from palpate.errors import not_negative, positive


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
