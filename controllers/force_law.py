"""Laws of force control: from a force error to a velocity along the normal.

Both have one gain k, the velocity that a steady error of 1 N asks for, and one number that is to be kept small:
k K T, with K the stiffness and T the delay (see `palpate.controllers.gains`). The direct law responds at once. The
admittance lets the tip behave like a mass on a damper: it yields to noise and knocks more softly, and pays with
a lag of mass / damping, which costs phase.
"""

import math
from dataclasses import dataclass
from typing import Protocol

from palpate.controllers.gains import ForceGain
from palpate.controllers.margins import (
    ComplexArray,
    LoopMargins,
    loop_margins,
    velocity_to_displacement,
    whole_delays,
)
from palpate.errors import InvalidValueError, check_positive, positive


class ForceLaw(Protocol):
    """From a force error to a velocity along the normal, period by period."""

    def start(self, velocity: float) -> None:
        """Begin with the tip moving along the normal at this velocity [m/s], without a bump."""
        ...

    def step(self, error: float, gain: float) -> float:
        """Return the velocity into the object for the next period [m/s].

        Args:
            error: Wanted less felt normal force [N].
            gain: k [m/s/N]: the law's own, or what it was changed to meanwhile.
        """
        ...

    def margins(self, period: float) -> LoopMargins:
        """Return the margins of the sampled loop, with stiffness and delay that it was made for."""
        ...


class DirectForce:
    """v = k (F_set - F). A `ForceLaw`.

    Attributes:
        gain: With its margin.
    """

    def __init__(self, gain: ForceGain) -> None:
        """Take a gain."""
        self.gain = gain

    def start(self, velocity: float) -> None:
        """See `ForceLaw`: it remembers nothing."""

    def step(self, error: float, gain: float) -> float:
        """See `ForceLaw`."""
        return gain * error

    def margins(self, period: float) -> LoopMargins:
        """See `ForceLaw`."""
        steps = whole_delays(self.gain.delay, period)
        scale = self.gain.gain * self.gain.stiffness
        return loop_margins(lambda z: scale * velocity_to_displacement(z, steps, period))


@dataclass(frozen=True, slots=True)
class VirtualBody:
    """A mass on a damper, which the tip imitates: mass dv/dt = F_set - F - damping v.

    With the contact's stiffness K after a delay T, the loop is (K / damping) e^{-sT} / (s (1 + s mass / damping)).
    It oscillates at the frequency w where w T + atan(w mass / damping) = pi/2, if
    K / damping >= w sqrt(1 + (w mass / damping)^2): for T = 0 never, for mass = 0 from K T / damping = pi/2 on.

    Attributes:
        mass: [kg].
        damping: [N s/m].
        stiffness: K that it was made for [N/m].
        delay: T that it was made for [s].
    """

    mass: float
    damping: float
    stiffness: float
    delay: float

    def __post_init__(self) -> None:
        check_positive(self, mass="kg", damping="N s/m", stiffness="N/m", delay="s")
        if self.gain_margin <= 1.0:
            raise InvalidValueError(
                f"damping = {self.damping:g} N s/m with mass = {self.mass:g} kg: unstable at K = "
                f"{self.stiffness:g} N/m and T = {self.delay:g} s; take a damping of at least "
                f"{1.01 * least_damping(self.mass, self.stiffness, self.delay):.4g} N s/m, and three times that "
                "for a good margin"
            )

    @property
    def lag(self) -> float:
        """Mass / damping [s]."""
        return self.mass / self.damping

    @property
    def gain(self) -> ForceGain:
        """Velocity per steady force error, 1 / damping, with the margin that it would have without the mass."""
        return ForceGain(1.0 / self.damping, self.stiffness, self.delay)

    @property
    def gain_margin(self) -> float:
        """By which factor K may grow before the loop oscillates."""
        return _largest_gain(self.lag, self.delay) * self.damping / self.stiffness


class Admittance:
    """The tip moves like a virtual body. A `ForceLaw`; the body's equation is solved exactly, error held.

    Attributes:
        body: Mass and damper.
    """

    def __init__(self, body: VirtualBody, period: float) -> None:
        """Take the body and the control period [s]."""
        self.body = body
        self.gain = body.gain
        self._fading = math.exp(-positive("period", period, "s") / body.lag)
        self._velocity = 0.0

    def start(self, velocity: float) -> None:
        """See `ForceLaw`."""
        self._velocity = velocity

    def step(self, error: float, gain: float) -> float:
        """See `ForceLaw`; a changed gain is a changed damping, with the mass in proportion."""
        wanted = gain * error
        self._velocity = wanted + self._fading * (self._velocity - wanted)
        return self._velocity

    def margins(self, period: float) -> LoopMargins:
        """See `ForceLaw`."""
        steps, r = whole_delays(self.body.delay, period), math.exp(-period / self.body.lag)
        scale = self.body.stiffness / self.body.damping

        def open_loop(z: ComplexArray) -> ComplexArray:
            body: ComplexArray = (1.0 - r) * z / (z - r)
            return scale * body * velocity_to_displacement(z, steps, period)

        return loop_margins(open_loop)


def least_damping(mass: float, stiffness: float, delay: float) -> float:
    """Return the damping [N s/m] at which an admittance of this mass begins to oscillate.

    Args:
        mass: [kg].
        stiffness: K of contact and servo in series [N/m].
        delay: T [s].
    """
    low, high = 0.0, stiffness * delay + math.sqrt(mass * stiffness)  # at the upper end it is stable: T and mass
    for _ in range(60):
        middle = 0.5 * (low + high)
        if _largest_gain(mass / middle, delay) * middle > stiffness:
            high = middle
        else:
            low = middle
    return high


def _largest_gain(lag: float, delay: float) -> float:
    """K / damping at which e^{-sT} / (s (1 + s lag)) meets -1 [1/s]."""
    low, high = 0.0, math.pi / (2.0 * delay)
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle * delay + math.atan(middle * lag) < math.pi / 2.0:
            low = middle
        else:
            high = middle
    return low * math.hypot(1.0, low * lag)
