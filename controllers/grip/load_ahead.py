"""A contact's load now and a little later, from noisy samples."""

import math

from palpate.errors import positive
from palpate.friction.contact_load import ContactLoad

ODD_FORCE, ODD_TORQUE = 0.3, 2e-3
"""[N, N m] By which one sample may be off what was foretold for it: fifteen times the noise of one, and 300 N/s in
a period of 1 ms. What is further off is taken if the next sample is, too: one period late, but a single glitch,
with the rate that it seems to tell, would raise a grip many times over."""


class LoadAhead:
    """Tracks tangential force and spin torque with their rates, and looks ahead along them.

    A fading-memory filter of first order (Morrison 1969; a critically damped alpha-beta filter): it follows a ramp
    without lag. Of white noise sd it leaves sd sqrt(5 dt / 4 T) in the value and sd sqrt(dt / 4 T^3) in the rate,
    T the smoothing time. The components are looked ahead with, not the length of the force: the noise of a length
    would not average out near zero.
    """

    __slots__ = ("_keep", "_odd", "_period", "_rate", "_started", "_value")

    def __init__(self, smoothing: float, period: float) -> None:
        """Take the time constant of the memory [s] and the period of the samples [s]."""
        self._period = positive("period", period, "s")
        self._keep = math.exp(-period / positive("smoothing", smoothing, "s"))
        self.restart()

    def restart(self) -> None:
        """Forget all samples: the next one is taken for what has been there for ever."""
        self._value = self._rate = (0.0, 0.0, 0.0, 0.0)
        self._started = self._odd = False

    def step(self, load: ContactLoad) -> None:
        """Take a sample of this period."""
        x, y, z = load.tangential_force
        if not self._started:
            self._value, self._rate, self._started = (x, y, z, load.spin_torque), (0.0, 0.0, 0.0, 0.0), True
            return
        keep, dt = self._keep, self._period
        to_value, to_rate = 1.0 - keep * keep, (1.0 - keep) ** 2 / dt
        a, b, c, d = self._value
        p, q, r, s = self._rate
        a, b, c, d = a + dt * p, b + dt * q, c + dt * r, d + dt * s
        ea, eb, ec, ed = x - a, y - b, z - c, load.spin_torque - d
        far = ea * ea + eb * eb + ec * ec > ODD_FORCE * ODD_FORCE or abs(ed) > ODD_TORQUE
        if far and not self._odd:
            self._value, self._odd = (a, b, c, d), True
            return
        self._odd = far
        self._value = (a + to_value * ea, b + to_value * eb, c + to_value * ec, d + to_value * ed)
        self._rate = (p + to_rate * ea, q + to_rate * eb, r + to_rate * ec, s + to_rate * ed)

    def ahead(self, time: float) -> tuple[float, float]:
        """Return length of the tangential force [N] and spin torque [N m], so long after the last sample [s]."""
        a, b, c, d = self._value
        p, q, r, s = self._rate
        return math.hypot(a + time * p, b + time * q, c + time * r), d + time * s
