"""The contact normal, smoothed and led over the known lags."""

import math

from palpate.errors import positive
from palpate.spatial import ZERO, Vector, add_scaled, dot, scale, subtract, unit


class NormalTracker:
    """A critically damped alpha-beta filter on the contact normal.

    It follows a normal that turns at a constant rate without lag, and predicts it `lead` seconds ahead: that is
    the normal that the commanded motion will meet. Both poles lie at r = exp(-period/time_constant), so
    alpha = 1 - r^2, beta = (1 - r)^2: the fading-memory filter (Brookner 1998, section 1.3).
    """

    def __init__(self, period: float, time_constant: float, lead: float) -> None:
        """Set up the filter.

        Args:
            period: Sampling period [s].
            time_constant: Of the smoothing [s]: longer smooths more noise and reacts later to a bend.
            lead: How far ahead `predicted` looks [s].
        """
        r = math.exp(-positive("period", period, "s") / positive("time_constant", time_constant, "s"))
        self._period = period
        self._alpha = 1.0 - r * r
        self._beta = (1.0 - r) ** 2
        self._lead = lead
        self._normal: Vector | None = None
        self._rate: Vector = ZERO
        self._predicted: Vector | None = None

    def reset(self) -> None:
        """Forget everything: the next normal is taken as it is."""
        self._normal, self._rate, self._predicted = None, ZERO, None

    def update(self, measured: Vector) -> None:
        """Take a measured unit normal."""
        self._predicted = None
        if self._normal is None:
            self._normal = measured
            return
        expected = add_scaled(self._normal, self._period, self._rate)
        innovation = subtract(measured, expected)
        normal = unit(add_scaled(expected, self._alpha, innovation))
        rate = add_scaled(self._rate, self._beta / self._period, innovation)
        self._normal = normal
        self._rate = add_scaled(rate, -dot(rate, normal), normal)  # a unit vector turns, it does not grow

    @property
    def normal(self) -> Vector:
        """The smoothed unit normal.

        Raises:
            ValueError: No normal was measured yet.
        """
        if self._normal is None:
            raise ValueError("no normal was measured yet: call update() first")
        return self._normal

    @property
    def predicted(self) -> Vector:
        """The unit normal expected `lead` seconds from now."""
        if self._predicted is None:  # asked for more than once a period
            turn = scale(self._lead, self._rate)
            self._predicted = unit(add_scaled(turn, 1.0, self.normal))
        return self._predicted
