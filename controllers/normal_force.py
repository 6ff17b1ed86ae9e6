"""Force control along the normal, put together: a law, what the surface does, a profile's rate, and a guard."""

import math
from dataclasses import replace

from palpate.controllers.contact_stiffness import ContactStiffness
from palpate.controllers.force_guard import ForceGuard, GuardSettings
from palpate.controllers.force_law import ForceLaw
from palpate.controllers.gains import MAX_LIVE_LOOP_GAIN
from palpate.controllers.surface_motion import SurfaceFilter, SurfaceMotion

SMOOTHED_FOR = 0.15
"""Delays of force control for which velocity and force are smoothed before the surface's motion is taken from
them; it is looked ahead for in turn. A damped contact responds to fast motion with c v, which the rate of
the force would pass on without bound: a UR5e on a contact of c / K = 30 ms, taken for a third as stiff, then
swings from period to period. From 0.1 to 0.25 that settles, on the stage too; with 0.5 it does not."""


class NormalForce:
    """From a wanted and a felt normal force to a velocity into the object. Every contact experiment uses it.

    Attributes:
        law: From force error to velocity.
        surface: What the surface does; None if it is known to stand still.
        guard: Lowers gain and forward feed if the loop swings; None without forward feed, where the gain's own
            margin is enough.
        stiffness: Of the contact, as it shows itself: the surface's motion is taken from that, and the gain is
            lowered so that k K T stays within `MAX_LIVE_LOOP_GAIN`, a gain margin of 2.6. None as the guard.
    """

    def __init__(
        self,
        law: ForceLaw,
        series_stiffness: float,
        delay: float,
        period: float,
        follow: SurfaceFilter | None = None,
    ) -> None:
        """Take the pieces.

        Args:
            law: From force error to velocity.
            series_stiffness: Of contact and servo [N/m], for the rate of a changing set force.
            delay: T of force control [s].
            period: Of control [s].
            follow: How the surface's motion is tracked and fed forward; not at all if not given.
        """
        self.law = law
        smoothed = SMOOTHED_FOR * delay
        self._share = 1.0 - math.exp(-period / smoothed)
        self._velocity = self._felt = 0.0
        self._watched = False
        self.surface = (
            None if follow is None else SurfaceMotion(replace(follow, lead=follow.lead + smoothed), period)
        )
        self.guard = None if follow is None else ForceGuard(GuardSettings(delay, period))
        self.stiffness = None if follow is None else ContactStiffness(follow.stiffness, delay, period)
        self._compliance = 1.0 / series_stiffness
        # of what is in series with the contact
        self._other = 0.0 if follow is None else max(self._compliance - 1.0 / follow.stiffness, 0.0)
        self._delay, self._wanted = delay, 0.0
        self._lowered = 1.0  # share of the gain
        self._fading = period / delay

    def start(self) -> None:
        """A new run begins."""
        if self.guard is not None:
            self.guard.reset()
        if self.stiffness is not None and self.surface is not None:
            self.stiffness.reset()
            self.surface.stiffness = self.stiffness.stiffness
        self._lowered = 1.0
        self.lift()

    def lift(self) -> None:
        """The tip is off the surface: forget what that did."""
        self.law.start(0.0)
        self._watched = False
        if self.surface is not None and self.stiffness is not None:
            self.surface.reset()
            self.stiffness.lift()

    def lose(self) -> None:
        """Contact was lost that was to be kept: if the surface was followed, that may be why."""
        if self.guard is not None:
            self.guard.lower()
        self.lift()

    @property
    def surface_velocity(self) -> float:
        """Of the surface along the normal, away from the tip [m/s], as far as it is followed."""
        return 0.0 if self.surface is None else self.surface.predicted

    def watch(self, normal_velocity: float, felt: float) -> None:
        """Take what the surface did in this period; comes before `step`, once a period in contact.

        Args:
            normal_velocity: n.v of the tip, into the object [m/s].
            felt: Normal force [N].
        """
        if self.surface is None or self.stiffness is None:
            return
        contact = self.stiffness
        contact.update(normal_velocity, felt, self._wanted)
        if contact.known:
            self.surface.stiffness = contact.stiffness
        if not self._watched:
            self._velocity, self._felt, self._watched = normal_velocity, felt, True
        self._velocity += self._share * (normal_velocity - self._velocity)
        self._felt += self._share * (felt - self._felt)
        self.surface.update(self._velocity, self._felt)

    def step(
        self,
        wanted: float,
        felt: float,
        gain: float,
        fastest: float,
        rate: float = 0.0,
        retreat_speed: float = 0.0,
    ) -> float:
        """Return the velocity into the object for the next period [m/s].

        Args:
            wanted: Normal force [N].
            felt: Normal force [N].
            gain: Velocity per force error [m/s/N].
            fastest: Largest velocity that the error alone can ask for [m/s].
            rate: At which the wanted force will change when this command acts [N/s].
            retreat_speed: Largest speed away from the surface when the force is too large [m/s], if above that.
        """
        self._wanted = wanted
        error, forward = wanted - felt, rate * self._compliance
        if self.surface is not None and self.guard is not None:
            share = self.guard.step(error, wanted)
            gain *= share * self._lower(gain)
            forward += share * self.surface.predicted
        asked = self.law.step(error, gain)
        slowest = -fastest if fastest >= retreat_speed else -retreat_speed
        if slowest <= asked <= fastest:
            return asked + forward
        push = min(max(asked, slowest), fastest)
        self.law.start(push)  # a law that remembers must not go on beyond what is done
        return push + forward

    def _lower(self, gain: float) -> float:
        """Share of the gain that the contact bears, as far as it is known; gone over to within a delay."""
        contact = self.stiffness
        if contact is not None and contact.known:
            loop_gain = gain * self._delay / (1.0 / contact.stiffness + self._other)
            target = min(1.0, MAX_LIVE_LOOP_GAIN / loop_gain)
            self._lowered += self._fading * (target - self._lowered)
        return self._lowered
