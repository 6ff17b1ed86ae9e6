"""A set force without its steps: where it jumps, it goes over gently; all else of it stays as it is.

What a robot does when the set force jumps, depends on how well the contact's stiffness is known: a contact that is
softer than it was taken for passes, at first, for a surface that gives way, and the force overshoots. What changes
at a rate that is known beforehand is not to pay for that. So a jump alone, whatever of a change its rates do not
explain, is made up for by a remainder that dies away like a critically damped spring, exactly, over a time of its
own.
"""

import math

from palpate.errors import not_negative, positive

LEAST_JUMP = 0.01
"""Of the force: a smaller jump is none worth telling."""

GOING = 5.0
"""Time constants after which a jump is made up for: 4 % of it are left."""


class GentleSteps:
    """The remainder, and what is left without it.

    Attributes:
        force: [N], now, without jumps.
        rate: [N/s], now.
        going: Which way it goes after a jump, 1 up, -1 down; 0 if it has arrived, and at least half of the time,
            jump as it may.
    """

    def __init__(self, time_constant: float, period: float) -> None:
        """Take the time constant of going over [s], 0 to let jumps through, and the control period [s]."""
        self._tau = not_negative("time_constant", time_constant, "s")
        self._period = positive("period", period, "s")
        self._fading = math.exp(-period / time_constant) if time_constant else 0.0
        self._periods = round(GOING * time_constant / period)
        self.reset(0.0)

    def reset(self, force: float) -> None:
        """Begin at a force [N] that stands still."""
        self.force, self.rate = force, 0.0
        self._remainder = self._slope = 0.0
        self._last = (force, 0.0)
        self.going, self._left = 0.0, 0

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
        # what neither rate explains; a rate that jumps is no jump
        change, one, other = force - last, rate * period, last_rate * period
        jump = change - min(max(change, min(one, other)), max(one, other))
        self._remainder += jump
        if self._left > 0:
            self._left -= 1
            if self._left <= self._periods:
                self.going = 0.0
        elif abs(jump) > LEAST_JUMP * abs(force):
            self.going, self._left = math.copysign(1.0, jump), 2 * self._periods
        self.force, self.rate = force - self._remainder, rate - self._slope
