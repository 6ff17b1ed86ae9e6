"""How stiff a contact is, from force and motion of the tip while force control acts: nothing is moved for it.

On a surface that is at rest, F = K d + c d' with d the depth of the tip. Of force, depth and its rate only what is
fast counts, the innovations of fading-memory filters (Brookner 1998, section 1.3): slow is what a surface does of
its own. K and c are their least squares, older ones counted less and less.

A surface that moves fast is no excitation but a disturbance, and the reaction of control to it is not the contact:
a loop v = k (F_set - F) that follows a sine of w shows K = w sin(w T) / k and a negative c, its own inverse. So a
result counts only where the force swings clearly, hardly anything of it is left unexplained, and K and c are those
of a passive contact; and not while the filters are still taking up how fast the surface went when it was met.
"""

import math

from palpate.controllers.surface_motion import MIN_DELAY
from palpate.errors import positive

MEMORY = 1.0
"""Time constant of the filters, in delays of force control: swings of a loop that is too strong take three to four
delays, and pass; what surfaces do that can be followed takes ten times as long, and does not."""

SETTLING_DELAYS = 10.0
"""Delays after a touch in which nothing counts: a surface that was met at 25 mm/s has had it take 20 kN/m for 6,
after 6 delays still."""

FORGETTING = 15.0
"""Time constant of the least squares, in delays: four swings of a loop that is too strong."""

MIN_SWING = 0.03
"""RMS of the force's fast part, per set force, that tells anything: 20 times a Nano17's noise at 2 N."""

MIN_EXPLAINED = 0.97
"""Share of the force's fast part that depth and its rate must explain."""

MIN_DAMPING = -1.0
"""c / K, in periods of control: what is less is no passive contact. Sampling alone makes half a period of it."""

STEADY_WITHIN, STEADY_FOR = 0.1, 5
"""A result counts that has changed by less than this share in so many looks at the sums: as long as half a swing.
What a surface's speed does to the sums, as it changes, goes on changing."""

MAX_RATIO = 10.0
"""By which factor the stiffness may differ from what it was taken for; what is farther off is cut off there."""

UPDATE_INTERVAL = 8
"""Periods from one look at the sums to the next: they change slowly, and this costs most."""


class _Fast:
    """What a fading-memory filter of third order does not foresee of a signal."""

    __slots__ = ("_curve", "_slope", "_value", "_weights")

    def __init__(self, fading: float) -> None:
        self._weights = (1.0 - fading**3, 1.5 * (1.0 - fading) ** 2 * (1.0 + fading), (1.0 - fading) ** 3)
        self.begin(0.0)

    def begin(self, value: float) -> None:
        self._value, self._slope, self._curve = value, 0.0, 0.0

    def step(self, value: float) -> float:
        a, b, c = self._weights
        slope = self._slope + self._curve
        foreseen = self._value + self._slope + 0.5 * self._curve
        rest = value - foreseen
        self._value, self._slope = foreseen + a * rest, slope + b * rest
        self._curve += c * rest
        return rest


class ContactStiffness:
    """Estimates stiffness and damping of the contact that force control acts on.

    Attributes:
        stiffness: K [N/m]; what it was taken for until a result counts.
        damping_time: c / K [s]; 0 until then.
        known: Whether a result has counted since the last `reset`.
    """

    def __init__(self, assumed: float, delay: float, period: float) -> None:
        """Take what the contact's stiffness is taken for [N/m], T of force control and its period [s]."""
        self._assumed = positive("assumed", assumed, "N/m")
        self._period = positive("period", period, "s")
        # what surfaces do is no faster where the robot has less delay
        delay = max(positive("delay", delay, "s"), MIN_DELAY)
        fading = math.exp(-period / (MEMORY * delay))
        self._fast = _Fast(fading), _Fast(fading), _Fast(fading)
        self._taking_up = round(SETTLING_DELAYS * delay / period)
        self._forgetting = math.exp(-period / (FORGETTING * delay))
        self._per_sample = 1.0 - self._forgetting  # of a mean over what is remembered
        self.reset()

    def reset(self) -> None:
        """A new run begins: the contact is what it was taken for."""
        self.stiffness, self.damping_time, self.known = self._assumed, 0.0, False
        self._ff = self._fd = self._fv = self._dd = self._dv = self._vv = 0.0
        self._depth, self._count, self._touching = 0.0, 0, False
        self._before, self._looks = 0.0, 0

    def lift(self) -> None:
        """The tip is off the surface: what it has shown stays known."""
        self._touching = False

    def update(self, normal_velocity: float, normal_force: float, set_force: float) -> None:
        """Take what was measured in this period.

        Args:
            normal_velocity: n.v of the contact, into the object [m/s].
            normal_force: [N].
            set_force: [N].
        """
        force, depth, rate = self._fast
        if not self._touching:
            self._touching, self._depth, self._count = True, 0.0, 0
            force.begin(normal_force)
            depth.begin(0.0)
            rate.begin(normal_velocity)
        self._depth += self._period * normal_velocity
        f, d, v = force.step(normal_force), depth.step(self._depth), rate.step(normal_velocity)
        self._count += 1
        if self._count <= self._taking_up:
            return
        keep = self._forgetting
        self._ff = keep * self._ff + f * f
        self._fd = keep * self._fd + f * d
        self._fv = keep * self._fv + f * v
        self._dd = keep * self._dd + d * d
        self._dv = keep * self._dv + d * v
        self._vv = keep * self._vv + v * v
        if self._count % UPDATE_INTERVAL == 0:
            self._weigh(MIN_SWING * set_force)

    def _weigh(self, least: float) -> None:
        """Take the sums' result over, if it counts; `least` is the swing that it takes [N]."""
        if self._ff * self._per_sample < least * least:
            return
        determinant = self._dd * self._vv - self._dv * self._dv
        if determinant <= 1e-12 * self._dd * self._vv:
            return
        stiffness = (self._fd * self._vv - self._fv * self._dv) / determinant
        damping = (self._fv * self._dd - self._fd * self._dv) / determinant
        explained = stiffness * self._fd + damping * self._fv
        passive = stiffness > 0.0 and damping >= MIN_DAMPING * self._period * stiffness
        if not passive or explained < MIN_EXPLAINED * self._ff:
            self._looks = 0
            return
        if abs(stiffness - self._before) > STEADY_WITHIN * self._before:
            self._before, self._looks = stiffness, 0
        self._looks += 1
        if self._looks < STEADY_FOR:
            return
        low, high = self._assumed / MAX_RATIO, MAX_RATIO * self._assumed
        self.stiffness = min(max(stiffness, low), high)
        self.damping_time, self.known = max(damping, 0.0) / stiffness, True
