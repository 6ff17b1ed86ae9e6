"""How far the zero of a finger's sensor may have wandered, and what grip that is worth."""

import math
from dataclasses import dataclass

from palpate.errors import check_not_negative, positive
from palpate.friction.limit_surface import LimitSurface
from palpate.spatial import Vector, Wrench


@dataclass(frozen=True, slots=True)
class TipOnSensor:
    """A round fingertip on its sensor, which presses along x of the sensor frame.

    Attributes:
        radius: [m]
        center: In the sensor frame [m].
    """

    radius: float
    center: Vector

    def __post_init__(self) -> None:
        positive("radius", self.radius, "m")

    def felt(self, wrench: Wrench) -> tuple[float, float, float]:
        """Return by how much what is felt is off at most: normal and tangential force [N], spin torque [N m].

        A moment about the tip's centre tilts the normal that is found, by itself over radius times normal force;
        so the normal force shows as a tangential one of that moment over the radius.

        Args:
            wrench: By how much each axis is off, at most, up or down [N, N m].
        """
        a, b, c, d, e, f = wrench
        x, y, z = (abs(each) for each in self.center)
        # of m - c x f
        spin, second, third = d + y * c + z * b, e + z * a + x * c, f + x * b + y * a
        return a, math.hypot(b, c) + math.hypot(second, third) / self.radius, spin


@dataclass(frozen=True, slots=True)
class ZeroWander:
    """How fast the zero of a sensor may wander, each axis up or down.

    Attributes:
        force: [N/s]
        moment: [N m/s]
    """

    force: float
    moment: float

    def __post_init__(self) -> None:
        check_not_negative(self, force="N/s", moment="N m/s")

    def within(self, time: float) -> Wrench:
        """Return how far each axis may have wandered in that time [N, N m]."""
        force, moment = self.force * time, self.moment * time
        return (force, force, force, moment, moment, moment)

    def reserve(self, surface: LimitSurface, tip: TipOnSensor, time: float) -> float:
        """Return by how much more a contact is to press for what its zero may have wandered in that time [N].

        The least normal force is subadditive in (f_t, tau), for p >= 1 and gamma >= 0: what holds the felt load,
        and what holds the error, together hold the true one.
        """
        if not time > 0.0:
            return 0.0
        normal, tangential, spin = tip.felt(self.within(time))
        return normal + surface.least_normal_force(tangential, spin)
