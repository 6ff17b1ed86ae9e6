"""Lets a held object slip at a wanted speed: from how it moves to the grip.

While a contact slips its friction is mu f_n, whatever the speed: grip is not a resistance but a force. With the
grip that just balances weight, the object goes on moving as it does; a share u less accelerates it by authority u.
A slide: the weight less friction, m g u, over m: authority g. A pivot about a point at a distance l from the
centre of mass, r the radius of gyration: g l / (r^2 + l^2) at most, g / 2 r for the worst l.

So the rate answers the grip as an integrator, and a PI law with both poles at half the bandwidth holds it:

    grip = base (1 + k (rate - wanted)),    base' = base k w / 4 (rate - wanted),    k = w / authority.

The same law lets go at first: nothing moves, so that the base sinks by k w / 4 per wanted rate until it does. What
mu and e really are need not be known; what they are believed to be only shortens the way there.
"""

import math
from dataclasses import dataclass

from palpate.errors import positive

ONSET = 0.5
"""Of the speed: what moves as fast as that slips. Many times the noise of a tracked rate."""


@dataclass(frozen=True, slots=True)
class SlipServoParameters:
    """How an object is let slip.

    Attributes:
        speed: At most [rad/s or m/s].
        acceleration: To that and from it [rad/s^2 or m/s^2].
        authority: By which the object accelerates per share of grip that it is gripped less [rad/s^2 or m/s^2];
            rather too large than too small.
        bandwidth: Of the loop [rad/s]; the grip follows its command by some 15 ms, the motion is told as late.
        largest_change: Share of grip that a rate which is wrong may give or take at once.
        release: Share of grip let go per second while slip is not near yet [1/s].
    """

    speed: float
    acceleration: float
    authority: float
    bandwidth: float = 15.0
    largest_change: float = 0.3
    release: float = 0.3

    def __post_init__(self) -> None:
        for name in ("speed", "acceleration", "authority", "bandwidth", "largest_change", "release"):
            positive(name, getattr(self, name), "")


class SlipServo:
    """Holds the speed of a slip, and slows down before the end of the way. Part of a controller.

    Attributes:
        wanted: Rate that is wanted now [rad/s or m/s].
    """

    __slots__ = ("_base", "_gain", "_near", "_parameters", "_period", "wanted")

    def __init__(self, parameters: SlipServoParameters, period: float) -> None:
        """Take how, and the period of control [s]."""
        self._parameters, self._period = parameters, positive("period", period, "s")
        self._gain = parameters.bandwidth / parameters.authority
        self.start(0.0, 0.0)

    def start(self, grip: float, near: float) -> None:
        """Begin with a grip that holds [N], and one below which slip may be near [N]."""
        self._base, self._near, self.wanted = grip, near, 0.0

    def step(self, remaining: float, rate: float, least: float, most: float = math.inf) -> float:
        """Return the grip of the next period [N].

        Args:
            remaining: Way that is left [rad or m].
            rate: Along that way [rad/s or m/s].
            least: Grip below which it is not to go [N].
            most: Above which it cannot go [N]: what it would take beyond is not added up.
        """
        p, dt = self._parameters, self._period
        if self._base > self._near:
            if rate < ONSET * p.speed:
                self._base = max(self._base * (1.0 - p.release * dt), self._near, least)
                return self._base
            self._near = math.inf  # it slips already
        stoppable = math.sqrt(2.0 * p.acceleration * max(remaining, 0.0))
        self.wanted = min(p.speed, stoppable, self.wanted + p.acceleration * dt)
        change = max(-p.largest_change, min(p.largest_change, self._gain * (rate - self.wanted)))
        self._base = max(min(self._base * (1.0 + 0.25 * p.bandwidth * change * dt), most), least)
        return max(min(self._base * (1.0 + change), most), least)
