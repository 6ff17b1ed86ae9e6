"""What force is to be felt now, and how fast it is to change when a command acts.

A profile says what is wanted now. A command acts a delay later: what it is to bring about is looked ahead to as
far as the profile's rate tells, and what is felt now is compared with what was looked ahead to a delay ago. A step
comes unawares.
"""

import math
from collections import deque

from palpate.controllers.gentle_steps import GentleSteps
from palpate.controllers.reference_force import ReferenceForce
from palpate.errors import not_negative, positive


class SetForce:
    """The set force of a loop with a delay.

    Attributes:
        force: To be felt now [N].
        rate: At which it is to have its depth changed when a command acts [N/s]: with a damped contact later than
            the force itself.
        ahead_rate: At which the force is to change then [N/s].
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
            step_time: Time constant of going over to a force that jumps [s]; 0: as fast as the loop.
        """
        self._delay = positive("delay", delay, "s")
        positive("period", period, "s")
        self._gentle = GentleSteps(step_time, period)
        self._ahead = ReferenceForce(max(delay, lead), period)
        # F = K (d + damping_time d'): the depth, whose rate is fed forward, follows the force by so much
        damping = not_negative("damping_time", damping_time, "s")
        self._per_period = 1.0 if damping == 0.0 else 1.0 - math.exp(-period / damping)
        self._delays = max(1, round(delay / period))
        self._expected = deque([0.0], self._delays)
        self.hold(0.0)

    @property
    def stepping(self) -> float:
        """Which way it goes to a force that it jumped to: 1 up, -1 down, 0 if it is not on its way."""
        return self._gentle.going

    def hold(self, force: float) -> None:
        """Nothing changes: this force [N] is to be felt."""
        self._gentle.reset(force)
        self._ahead.reset(force, 0.0)
        self.force, self.rate, self.ahead_rate = force, 0.0, 0.0
        for _ in range(self._delays):
            self._expected.append(force)

    def step(self, force: float, rate: float) -> None:
        """Go on by one period to what the profile says: force [N] and rate [N/s]."""
        gentle, ahead = self._gentle, self._ahead
        gentle.step(force, rate)
        ahead.step(gentle.force + gentle.rate * self._delay, gentle.rate)
        self.force, self.ahead_rate = self._expected[0], ahead.rate
        self.rate += self._per_period * (ahead.rate - self.rate)
        self._expected.append(ahead.force)
