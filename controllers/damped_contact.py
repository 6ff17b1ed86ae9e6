"""Force gains for a contact that is damped, on what yields, pressed by a servo that yields.

The model of `palpate.controllers.gains` takes the contact for a spring. A damped one, K + c s, responds to what is
fast with more force than a spring, c / K times its frequency as much, until the servo's own stiffness K_s, in
series with it, is all that is left. What yields on a mount of its own, K_m + c_m s + m s^2, is in series too: soft
at rest, and as stiff as its contact to what is fast. With Z the stiffness of all in series,

    L(s) = k Z(s) e^{-sT} / s,    1 / Z(s) = 1 / (K + c s) + 1 / (K_m + c_m s + m s^2) + 1 / K_s.

A gain that is made for a spring of the same stiffness at rest leaves little of its margin: on a contact of 1 kN/m
with c / K = 0.14 s it is beyond stability. Here the gain is the largest one that keeps the gain margin which the
default loop gain has on a spring, and a distance from instability.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.controllers.gains import LOOP_GAIN, ForceGain
from palpate.controllers.margins import FREQUENCIES, ComplexArray, LoopMargins
from palpate.errors import InvalidValueError, check_positive, not_negative, positive

MIN_GAIN_MARGIN = 0.5 * math.pi / LOOP_GAIN
"""That of the default loop gain on a spring: 3.14."""

MIN_MODULUS_MARGIN = 0.6
"""Least distance of the loop from -1; that of the default loop gain on a spring is 0.63."""

GAIN_STEP = 0.95
"""By which a gain is lowered, again and again, that is too near to instability."""


@dataclass(frozen=True, slots=True)
class SpringMounting:
    """A mass on a spring and a damper, which carries the surface.

    Attributes:
        stiffness: K_m [N/m].
        damping: c_m [N s/m].
        mass: m [kg].
    """

    stiffness: float
    damping: float
    mass: float

    def __post_init__(self) -> None:
        check_positive(self, stiffness="N/m", damping="N s/m", mass="kg")


@dataclass(frozen=True, slots=True)
class DampedContact:
    """A contact, what yields behind it, and the servo that presses.

    Attributes:
        stiffness: K of the contact alone [N/m].
        damping_time: c / K of the contact alone [s].
        servo_stiffness: K_s, with which the robot holds its tip [N/m]; infinite for one that does not yield.
        mounting: Of the surface; None if it is fixed.
    """

    stiffness: float
    damping_time: float = 0.0
    servo_stiffness: float = math.inf
    mounting: SpringMounting | None = None

    def __post_init__(self) -> None:
        positive("stiffness", self.stiffness, "N/m")
        not_negative("damping_time", self.damping_time, "s")
        positive("servo_stiffness", self.servo_stiffness, "N/m", infinite_allowed=True)

    @property
    def surface_stiffness(self) -> float:
        """At rest, of the contact and what yields behind it, without the servo [N/m]."""
        return 1.0 / (1.0 / self.stiffness + (0.0 if self.mounting is None else 1.0 / self.mounting.stiffness))

    @property
    def surface_damping_time(self) -> float:
        """By which the force leads the depth of both, where that changes slowly [s].

        From 1 / Z = 1 / (K + c s) + 1 / (K_m + c_m s) to first order in s.
        """
        if self.mounting is None:
            return self.damping_time
        own, other = 1.0 / self.stiffness, 1.0 / self.mounting.stiffness
        return (own * self.damping_time + other * self.mounting.damping * other) / (own + other)

    @property
    def series(self) -> float:
        """At rest, of all of it [N/m]."""
        return 1.0 / (1.0 / self.surface_stiffness + 1.0 / self.servo_stiffness)

    def gain(self, delay: float) -> ForceGain:
        """Return the largest force gain that keeps the least margins.

        Args:
            delay: T, all delays plus the lag of the servo [s].
        """
        loop = self._loop(positive("delay", delay, "s"))
        gain = 1.0 / (_oscillating(loop) * MIN_GAIN_MARGIN)
        while float(np.abs(1.0 + gain * loop).min()) < MIN_MODULUS_MARGIN:
            gain *= GAIN_STEP
        return ForceGain(gain, self.series, delay)

    def margins(self, gain: ForceGain) -> LoopMargins:
        """Return the margins of a loop with this contact.

        Raises:
            InvalidValueError: It is unstable.
        """
        loop = gain.gain * self._loop(gain.delay)
        largest = _oscillating(loop)
        if largest >= 1.0:
            raise InvalidValueError(
                f"force gain = {gain.gain:g} m/s/N: unstable on this contact; take at most "
                f"{gain.gain / largest / MIN_GAIN_MARGIN:.2g} m/s/N"
            )
        size, phase = np.abs(loop), np.unwrap(np.angle(loop))
        falls = np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))
        phases = [abs(math.remainder(float(phase[i]) - math.pi, 2.0 * math.pi)) for i in falls]
        return LoopMargins(
            1.0 / largest, math.degrees(min(phases, default=math.pi)), float(np.abs(1.0 + loop).min())
        )

    def _loop(self, delay: float) -> ComplexArray:
        """L per gain from far below to far beyond where it could oscillate, shape (FREQUENCIES,)."""
        s = 1j * np.geomspace(1e-3, 1e2, FREQUENCIES) / delay
        contact, mount = self.stiffness * (1.0 + self.damping_time * s), self.mounting
        yielding = 0.0 * s if mount is None else 1.0 / (mount.stiffness + mount.damping * s + mount.mass * s * s)
        series = 1.0 / contact + yielding + 1.0 / self.servo_stiffness
        return np.asarray(np.exp(-s * delay) / (s * series), dtype=np.complex128)


def _oscillating(loop: npt.NDArray[np.complex128]) -> float:
    """The largest size that a loop has on the negative real axis, between neighbours in proportion."""
    across = np.flatnonzero((loop.imag[:-1] >= 0.0) != (loop.imag[1:] >= 0.0))
    share = loop.imag[across] / (loop.imag[across] - loop.imag[across + 1])
    real = loop.real[across] + share * (loop.real[across + 1] - loop.real[across])
    return -float(real.min())
