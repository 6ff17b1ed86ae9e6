"""Normal force control from touch to loss: bumpless transfer, then set point or profile; follows the surface."""

from palpate.controllers.bumpless_transfer import BumplessTransfer
from palpate.controllers.explore_parameters import ExploreParameters
from palpate.controllers.force_law import DirectForce, ForceLaw
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.landing import FASTEST_SETTLING_PUSH, IMPACT_DELAYS
from palpate.controllers.normal_force import NormalForce
from palpate.controllers.surface_motion import FASTEST_SURFACE, SurfaceFilter
from palpate.runtime.data import ArmSample, Observation
from palpate.runtime.live import LiveParameters
from palpate.spatial import Vector, add, cross, dot


class HeldForce:
    """From what is felt to a velocity along the normal, over all touches of an exploration."""

    def __init__(
        self,
        parameters: ExploreParameters,
        period: float,
        law: ForceLaw | None,
        follow: SurfaceFilter | None,
        profile: ForceProfile | None,
    ) -> None:
        """Take what `ExploreController` takes."""
        gain = parameters.gain
        self._parameters = parameters
        self._force = NormalForce(law or DirectForce(gain), gain.stiffness, gain.delay, period, follow)
        self._transfer = BumplessTransfer(parameters.settle_time)
        self._follows, self._impact_time = follow is not None, IMPACT_DELAYS * gain.delay
        self._profile = profile
        self.start()

    def start(self) -> None:
        """A new run begins."""
        self._force.start()
        self._touched = 0.0
        self._sweeping_since: float | None = None

    def touch(self, time: float) -> None:
        """The tip has touched [s]: bumpless transfer begins."""
        self._transfer.reset()
        self._force.lift()
        self._touched = time

    def sweep(self, time: float) -> None:
        """It sweeps [s]: a profile of the force begins with the first sweep of a run."""
        if self._sweeping_since is None:
            self._sweeping_since = time

    def lose(self) -> None:
        """Contact was lost that was to be kept."""
        self._force.lose()

    @property
    def surface_velocity(self) -> float:
        """Of the surface along the normal, away from the tip [m/s], as far as it is followed."""
        return self._force.surface_velocity

    def settling(self, now: Observation, normal: Vector, lever: Vector, live: LiveParameters) -> float:
        """Return the velocity into the object while the force settles [m/s]; arguments as for `sweeping`."""
        felt = now.fingers[0].contact.normal_force
        wanted, _ = self._wanted(now.time, live)
        if self._follows and now.time - self._touched >= self._impact_time:
            self._watch(felt, normal, now.arm, lever)
        wanted = self._transfer.force(now.time, felt, wanted)
        # after a slow landing on a moving surface the tip must be able to follow it, and must yield to too large a
        # force as fast as any surface approaches
        fastest = max(self._parameters.landing_speed, FASTEST_SETTLING_PUSH if self._follows else 0.0)
        push = self._force.step(wanted, felt, live.value("force_gain"), fastest, retreat_speed=FASTEST_SURFACE)
        # a contact softer than assumed seems to approach while the tip retreats; where the force is too small
        # already, following that would break contact
        return max(push, 0.0) if felt < wanted else push

    def sweeping(self, now: Observation, normal: Vector, lever: Vector, live: LiveParameters) -> float:
        """Return the velocity into the object while the tip sweeps [m/s].

        Args:
            now: What is known; the first finger touches.
            normal: Into the object, smoothed, base frame.
            lever: From the tip frame's origin to the contact, base frame [m].
            live: What may have been changed: force, speed and force gain.
        """
        felt = now.fingers[0].contact.normal_force
        wanted, rate = self._wanted(now.time, live)
        if self._follows:
            self._watch(felt, normal, now.arm, lever)
        landing_speed, speed = self._parameters.landing_speed, live.value("speed")
        fastest = speed if speed > landing_speed else landing_speed
        return self._force.step(wanted, felt, live.value("force_gain"), fastest, rate)

    def _wanted(self, time: float, live: LiveParameters) -> tuple[float, float]:
        """The force wanted now [N], and its rate when a command of now acts [N/s]."""
        if self._profile is None:
            return live.value("force"), 0.0
        since = 0.0 if self._sweeping_since is None else time - self._sweeping_since
        return self._profile.at(since)[0], self._profile.at(since + self._parameters.gain.delay)[1]

    def _watch(self, felt: float, normal: Vector, arm: ArmSample, lever: Vector) -> None:
        contact = add(arm.velocity_base_tip, cross(arm.angular_velocity_base_tip, lever))
        self._force.watch(dot(normal, contact), felt)
