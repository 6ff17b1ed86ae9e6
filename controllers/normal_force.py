"""Force control along the normal, put together: a law, what the surface does, a profile's rate, and a guard."""

from palpate.controllers.force_guard import ForceGuard, GuardSettings
from palpate.controllers.force_law import ForceLaw
from palpate.controllers.surface_motion import SurfaceFilter, SurfaceMotion


class NormalForce:
    """From a wanted and a felt normal force to a velocity into the object. Every contact experiment uses it.

    Attributes:
        law: From force error to velocity.
        surface: What the surface does; None if it is known to stand still.
        guard: Lowers gain and forward feed if the loop swings; None without forward feed, where the gain's own
            margin is enough.
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
        self.surface = None if follow is None else SurfaceMotion(follow, period)
        self.guard = None if follow is None else ForceGuard(GuardSettings(delay, period))
        self._compliance = 1.0 / series_stiffness

    def start(self) -> None:
        """A new run begins."""
        if self.guard is not None:
            self.guard.reset()
        self.lift()

    def lift(self) -> None:
        """The tip is off the surface: forget what that did."""
        self.law.start(0.0)
        if self.surface is not None:
            self.surface.reset()

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
        if self.surface is not None:
            self.surface.update(normal_velocity, felt)

    def step(self, wanted: float, felt: float, gain: float, fastest: float, rate: float = 0.0) -> float:
        """Return the velocity into the object for the next period [m/s].

        Args:
            wanted: Normal force [N].
            felt: Normal force [N].
            gain: Velocity per force error [m/s/N].
            fastest: Largest velocity that the error alone can ask for [m/s].
            rate: At which the wanted force will change when this command acts [N/s].
        """
        error, forward = wanted - felt, rate * self._compliance
        if self.surface is not None and self.guard is not None:
            share = self.guard.step(error, wanted)
            gain *= share
            forward += share * self.surface.predicted
        return min(max(self.law.step(error, gain), -fastest), fastest) + forward
