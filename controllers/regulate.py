"""Regulates the force along a contact's normal while something else moves the arm along the surface.

The tip comes down slowly, takes the surface's motion into account from the touch on, leads the force to where the
profile begins, holds the profile, and lifts off. Force is regulated along the contact's normal as touch finds it,
or along an axis that is given. If contact is lost it is sought once, slowly and not far; after a second loss, or
if nothing is there, the tip stops where it is.

Landing on what moves: how hard the first knock is, speed and masses decide, and no control can take it back. What
control decides is what comes after. So a force above the wanted one is given way to at up to `give_way`, from the
first sample on, while pressing stays as slow as landing until it has settled; and what the surface does is watched
from then on, when the knock has died down.
"""

import math

from palpate.controllers.bumpless_transfer import BumplessTransfer
from palpate.controllers.force_guard import ForceGuard, GuardSettings
from palpate.controllers.force_law import DirectForce, ForceLaw
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.gated_surface_motion import GatedSurfaceMotion
from palpate.controllers.guarded_approach import DOWN, MOST_BOUNCES, ContactEvent, GuardedApproach
from palpate.controllers.landing import FASTEST_SETTLING_PUSH, IMPACT_DELAYS
from palpate.controllers.normal_force import NormalForce
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.regulate_parameters import RegulateParameters, live_regulation
from palpate.controllers.set_force import SetForce
from palpate.controllers.surface_motion import SurfaceFilter
from palpate.controllers.tangent_motion import Still, TangentMotion
from palpate.errors import positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.spatial import ZERO, Vector, add_scaled, dot, limit_norm, rotate, scale, subtract, toward

GUARD_RATE_ALLOWANCE = 5.0
"""Raises the guard's threshold, a fifth of the force, as if the force were larger by this multiple of its change
in one delay. The tracking error of a changing force then stays within half of the threshold."""

GUARD_ALLOWANCE_DECAY = 10.0
"""Time constant with which that allowance decays, in delays."""


class RegulateController:
    """Lands, settles, holds a force profile, lifts off. Uses the first finger.

    Attributes:
        live: What may be changed while it runs: force and force gain.
        contact: Phase and contact history.
    """

    def __init__(
        self,
        parameters: RegulateParameters,
        profile: ForceProfile,
        period: float,
        *,
        motion: TangentMotion | None = None,
        law: ForceLaw | None = None,
        follow: SurfaceFilter | None = None,
    ) -> None:
        """Take what is wanted.

        Args:
            parameters: How.
            profile: Of the force, from when it has settled on.
            period: Of control [s].
            motion: Of the tip along the surface, by something else, from then on; it stays if not given.
            law: Of force control; the direct one if not given.
            follow: How the motion of the surface is followed; taken for still if not given.
        """
        self._parameters, self._profile = parameters, profile
        self._period = positive("period", period, "s")
        self._motion: TangentMotion = motion or Still()
        self.live = live_regulation(parameters)
        gain = parameters.gain
        self._force = NormalForce(law or DirectForce(gain), gain.stiffness, gain.delay, period)
        # not those of NormalForce: the guard has to know the profile's rate, even on a surface at rest
        self._surface = None if follow is None else GatedSurfaceMotion(follow, period)
        self._guard = ForceGuard(GuardSettings(gain.delay, period))
        self._tracker = NormalTracker(period, parameters.normal_smoothing, parameters.lead)
        self._transfer = BumplessTransfer(parameters.settle_time)
        self.contact = GuardedApproach(
            parameters.settle_time,
            parameters.approach_distance,
            seek_distance=parameters.seek_distance,
            contact_phase=Phase.HOLD,
            most_bounces=MOST_BOUNCES,
        )
        self._impact_time = IMPACT_DELAYS * gain.delay
        self._allowance_decay = math.exp(-period / (GUARD_ALLOWANCE_DECAY * gain.delay))
        damping = parameters.damping_time
        self._wanted = SetForce(
            gain.delay, parameters.lead, period, damping_time=damping, step_time=parameters.step_time
        )
        self._per_period = 1.0 if damping == 0.0 else 1.0 - math.exp(-period / damping)
        self._most_change = parameters.slew * period
        self._most_along = parameters.tangential_acceleration * period
        self._restart(ZERO, 0.0)

    def start(self, first: Observation) -> None:
        """Begin the approach from where the tip is, from rest."""
        self.live.restart()
        self._restart(first.arm.position_base_tip, first.time)

    def _restart(self, position: Vector, time: float) -> None:
        self.contact.start(time, position)
        self._command, self._along = Command(), ZERO
        self._held_since: float | None = None
        self._tracker.reset()
        self._allowed = self._moved = 0.0
        self._touch()
        self._guard.reset()
        self._lowered = 0

    def _touch(self) -> None:
        """Start force control afresh."""
        self._transfer.reset()
        self._last_set_point: float | None = None  # of the transfer
        self._force.lift()
        self._spring = 0.0  # elastic part of the felt force, without the contact's damping
        if self._surface is not None:
            self._surface.reset()

    @property
    def _surface_velocity(self) -> float:
        """Of the surface along the normal, away from the tip, when a command acts [m/s]."""
        return 0.0 if self._surface is None else self._surface.predicted

    def step(self, now: Observation) -> Command:
        """Return the velocity for the next period; a final phase only once that is zero."""
        finger = now.fingers[0]
        if finger.touching:
            x, y, z = finger.contact.normal.tolist()
            self._tracker.update(rotate(now.arm.rotation_base_tip, (x, y, z)))
        self.contact.sense(now.time, now.arm.position_base_tip, finger.touching)
        self._change_phase(now.time)
        velocity = toward(self._command.velocity_base_tip, self._velocity(now), self._most_change)
        braking = self.contact.phase.is_final and velocity != ZERO
        self._command = Command(velocity, self._command.phase if braking else self.contact.phase)
        return self._command

    @property
    def held_since(self) -> float | None:
        """When the profile began, on the observations' clock [s]; None before it."""
        return self._held_since

    @property
    def guard_trips(self) -> int:
        """How often gain and forward feed were halved because the loop swung, with contact kept."""
        return self._guard.trips - self._lowered

    def _change_phase(self, time: float) -> None:
        wanted, contact = self._parameters, self.contact
        event = contact.step()
        if event is ContactEvent.TOUCHED:
            self._touch()
        elif event is ContactEvent.BOUNCED:
            self._tracker.reset()
        elif event is ContactEvent.SETTLED:
            if self._held_since is None:
                self._held_since = time
            contact.enter(Phase.HOLD)
        elif event is ContactEvent.LOST:
            self._along = ZERO
            trips = self._guard.trips
            self._guard.lower()  # surface following may be the cause
            self._lowered += self._guard.trips - trips
        elif contact.phase is Phase.HOLD:
            if self._held_since is not None and time - self._held_since > wanted.duration:
                contact.enter(Phase.LIFT)
        elif contact.phase is Phase.LIFT and contact.lifted(wanted.lift_distance, wanted.lift_speed):
            contact.enter(Phase.DONE)
        if contact.loss.is_final:
            contact.enter(Phase.LOST)

    def _direction(self) -> Vector:
        """Into the object, base frame, for the command that acts a lag from now."""
        return self._parameters.axis or self._tracker.predicted

    def _felt(self, now: Observation) -> float:
        """The force along the direction in which it is regulated [N]."""
        contact, axis = now.fingers[0].contact, self._parameters.axis
        if axis is None:
            return contact.normal_force
        x, y, z = contact.force.tolist()
        return -dot(axis, rotate(now.arm.rotation_base_tip, (x, y, z)))

    def _velocity(self, now: Observation) -> Vector:
        wanted, phase = self._parameters, self.contact.phase
        if phase is Phase.APPROACH:
            return scale(wanted.landing_speed, wanted.axis or DOWN)
        if phase is Phase.SEEK:
            return scale(wanted.landing_speed, wanted.axis or self._tracker.normal)
        if phase is Phase.LIFT:
            # away from a surface that comes after it, too
            back = min(self._surface_velocity, 0.0) - wanted.lift_speed
            return scale(back, wanted.axis or self._tracker.normal)
        if phase in (Phase.DONE, Phase.LOST):
            return ZERO
        direction = self._direction()
        return add_scaled(self._tangential(now, direction), self._push(now), direction)

    def _tangential(self, now: Observation, direction: Vector) -> Vector:
        """What moves it along the surface, brought up gently, without its part in the force's direction."""
        moved = ZERO
        if self.contact.phase is Phase.HOLD and self._held_since is not None:
            moved = self._motion.velocity(now.time - self._held_since)
        change = limit_norm(subtract(moved, self._along), self._most_along)
        self._along = add_scaled(self._along, 1.0, change)
        return add_scaled(self._along, -dot(self._along, direction), direction)

    def _profiled(self, since: float) -> tuple[float, float]:
        """What the profile asks for [N, N/s], moved by as much as the live force was."""
        force, rate = self._profile.at(since)
        moved = self.live.value("force") - self._parameters.force
        rate += (moved - self._moved) / self._period
        self._moved = moved
        return force + moved, rate

    def _push(self, now: Observation) -> float:
        """Velocity into the object."""
        wanted, set_force, felt = self._parameters, self._wanted, self._felt(now)
        delay, settling = wanted.gain.delay, self.contact.phase is Phase.SETTLE
        force, rate = self._profiled(0.0 if self._held_since is None else now.time - self._held_since)
        if settling:
            set_force.hold(force)
            force = self._transfer.force(now.time, felt, force)
            rate = 0.0 if self._last_set_point is None else (force - self._last_set_point) / self._period
            self._last_set_point = force
        else:
            set_force.step(force, rate)
            force, rate = set_force.force, set_force.rate
        self._spring += self._per_period * (felt - self._spring)
        # the impact of landing must not be taken for motion of the surface
        impact = settling and self.contact.elapsed < self._impact_time
        if self._surface is not None and not impact:
            into = dot(wanted.axis or self._tracker.normal, now.arm.velocity_base_tip)
            if set_force.stepping == 0.0:
                self._surface.update(into, self._spring)
            else:
                self._surface.update_in_step(into, self._spring, set_force.stepping)
        # a changing force is off by about its rate times the delay, which is no oscillation
        self._allowed = max(abs(set_force.ahead_rate), self._allowed * self._allowance_decay)
        share = self._guard.step(force - felt, force + GUARD_RATE_ALLOWANCE * self._allowed * delay)
        followed = share * self._surface_velocity
        most = max(wanted.landing_speed, FASTEST_SETTLING_PUSH) if settling else wanted.fastest_push
        gain = share * self.live.value("force_gain")
        push = self._force.step(force, felt, gain, wanted.give_way, rate) + followed
        return min(push, most + max(followed, 0.0) + abs(rate) / wanted.gain.stiffness)
