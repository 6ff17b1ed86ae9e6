"""A set force as fast as force control can follow, with its rate.

A step of the set force asks for what no robot can do, and a fast sine for what the loop follows too late. So the
set force passes a critically damped filter of second order, 1 / (1 + s tau)^2, exact for an input that is held for
a period. What a profile tells of its rate is added to its input times tau: what changes steadily passes
1 / (1 + s tau), half as late. Value and rate of the result are what the loop holds and feeds forward.
"""

import math

from palpate.errors import positive


class ReferenceForce:
    """The filter.

    Attributes:
        force: [N], now.
        rate: [N/s], now.
    """

    def __init__(self, time_constant: float, period: float) -> None:
        """Take tau and the control period [s]."""
        self._tau = positive("time_constant", time_constant, "s")
        self._period = positive("period", period, "s")
        self._fading = math.exp(-period / time_constant)
        self.reset(0.0, 0.0)

    def reset(self, force: float, rate: float) -> None:
        """Begin at a force [N] and rate [N/s]."""
        self.force, self.rate = force, rate

    def step(self, force: float, rate: float) -> None:
        """Go on by one period towards what the profile says.

        Args:
            force: [N].
            rate: [N/s].
        """
        wanted = force + self._tau * rate
        error = self.force - wanted
        slope = self.rate + error / self._tau
        self.force = wanted + (error + slope * self._period) * self._fading
        self.rate = (self.rate - slope * self._period / self._tau) * self._fading
