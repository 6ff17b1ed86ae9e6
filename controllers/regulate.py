"""Regulates the contact force while something else moves the arm along the surface.

The tip makes contact by a guarded approach, transfers to force control without a bump, tracks the force profile,
and lifts off. Force is regulated along the measured contact normal, or along a given axis.

On a moving surface, speeds and masses alone decide the first impact peak; control decides what follows. From the
first sample on, the tip yields to too large a force at up to `retreat_speed`, but until the force has settled it
presses slowly. The surface's motion is tracked once the impact has died down.
"""

import math

from palpate.controllers.bumpless_transfer import BumplessTransfer
from palpate.controllers.force_guard import ForceGuard, GuardSettings
from palpate.controllers.force_law import DirectForce, ForceLaw
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.gated_surface_motion import GatedSurfaceMotion
from palpate.controllers.guarded_approach import DOWN, ContactEvent, GuardedApproach
from palpate.controllers.landing import FASTEST_SETTLING_PUSH, IMPACT_DELAYS
from palpate.controllers.normal_force import NormalForce
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.regulate_parameters import RegulateParameters, live_regulation
from palpate.controllers.set_force import SetForce
from palpate.controllers.surface_motion import SurfaceFilter
from palpate.controllers.tangent_motion import Still, TangentMotion
from palpate.errors import positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.spatial import ZERO, Vector, add_scaled, as_vector, dot, limit_norm, rotate, scale, subtract, toward

HOLD = Phase.HOLD
PRESSING, FINAL = (Phase.SETTLE, HOLD), (Phase.DONE, Phase.LOST)
"""Looked up once, see `palpate.controllers.guarded_approach`."""

GUARD_RATE_ALLOWANCE = 5.0
"""Raises the guard's threshold, a fifth of the force, as if the force were larger by this multiple of its change
in one delay. The tracking error of a changing force then stays within half of the threshold."""

LATE = 1.5
"""Periods between two steps, above which the time that passed counts, and not the period."""

GUARD_ALLOWANCE_DECAY = 10.0
"""Time constant with which that allowance decays, in delays."""


class RegulateController:
    """Makes contact, tracks a force profile, lifts off. Uses the first finger.

    Attributes:
        live: What may be changed while it runs: force and force gain.
        contact: Phase and contact history.
        guard: Lowers gain and forward feed if the loop swings or contact is lost.
        held_since: When the profile began [s]; None before that.
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
        self.guard = ForceGuard(GuardSettings(gain.delay, period))
        self._tracker = NormalTracker(period, parameters.normal_smoothing, parameters.lead)
        self._transfer = BumplessTransfer(parameters.settle_time)
        self.contact = GuardedApproach(
            parameters.settle_time, parameters.approach_distance, parameters.seek_distance, Phase.HOLD
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
        self.held_since: float | None = None
        self._tracker.reset()
        self._allowed = self._moved = 0.0
        self._touch()
        self.guard.reset()

    def _touch(self) -> None:
        """Start force control afresh."""
        self._transfer.reset()
        self._last_set_point: float | None = None  # of the transfer
        self._set_at = 0.0  # [s]
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
            self._tracker.feel(now.arm.rotation_base_tip, finger.contact)
        self.contact.sense(now.time, now.arm.position_base_tip, finger.touching)
        self._change_phase(now.time)
        velocity = toward(self._command.velocity_base_tip, self._velocity(now), self._most_change)
        braking = velocity != ZERO and self.contact.phase in FINAL
        self._command = Command(velocity, self._command.phase if braking else self.contact.phase)
        return self._command

    def _change_phase(self, time: float) -> None:
        wanted, contact = self._parameters, self.contact
        event = contact.step()
        if event is not None:
            self._take(event, time)
        elif contact.phase is HOLD:
            if self.held_since is not None and time - self.held_since > wanted.duration:
                contact.enter(Phase.LIFT)
        elif contact.phase is Phase.LIFT and contact.lifted(wanted.lift_distance, wanted.lift_speed):
            contact.enter(Phase.DONE)
        if contact.loss.is_final:
            contact.enter(Phase.LOST)

    def _take(self, event: ContactEvent, time: float) -> None:
        if event is ContactEvent.TOUCHED:
            self._touch()
        elif event is ContactEvent.BOUNCED:
            self._tracker.reset()
        elif event is ContactEvent.SETTLED:
            if self.held_since is None:
                self.held_since = time
            self.contact.enter(HOLD)
        elif event is ContactEvent.LOST:
            self._along = ZERO
            self.guard.lower()  # surface following may be the cause

    def _felt(self, now: Observation) -> float:
        """The force along the direction in which it is regulated [N]."""
        contact, axis = now.fingers[0].contact, self._parameters.axis
        if axis is None:
            return contact.normal_force
        return -dot(axis, rotate(now.arm.rotation_base_tip, as_vector(contact.force)))

    def _velocity(self, now: Observation) -> Vector:
        wanted, phase = self._parameters, self.contact.phase
        if phase in PRESSING:
            direction = wanted.axis or self._tracker.predicted
            return add_scaled(self._tangential(now, direction), self._push(now), direction)
        if phase is Phase.APPROACH:
            return scale(wanted.landing_speed, wanted.axis or DOWN)
        if phase is Phase.SEEK:
            return scale(wanted.landing_speed, wanted.axis or self._tracker.normal)
        if phase is Phase.LIFT:
            # away from a surface that comes after it, too
            back = wanted.lift_speed - min(self._surface_velocity, 0.0)
            return scale(-min(back, wanted.fastest_push), wanted.axis or self._tracker.normal)
        return ZERO

    def _tangential(self, now: Observation, direction: Vector) -> Vector:
        """Velocity along the surface, with bounded acceleration and no component in the force's direction."""
        moved = ZERO
        if self.contact.phase is HOLD and self.held_since is not None:
            moved = self._motion.velocity(now.time - self.held_since)
        change = limit_norm(subtract(moved, self._along), self._most_along)
        self._along = add_scaled(self._along, 1.0, change)
        return add_scaled(self._along, -dot(self._along, direction), direction)

    def _profiled(self, since: float) -> tuple[float, float]:
        """Force and rate of the profile [N, N/s], offset by the change of the live force."""
        force, rate = self._profile.at(since)
        moved = self.live.value("force") - self._parameters.force
        rate += (moved - self._moved) / self._period
        self._moved = moved
        return force + moved, rate

    def _push(self, now: Observation) -> float:
        """Velocity into the object [m/s]."""
        wanted, set_force, felt = self._parameters, self._wanted, self._felt(now)
        delay, settling = wanted.gain.delay, self.contact.phase is not HOLD
        force, rate = self._profiled(0.0 if self.held_since is None else now.time - self.held_since)
        if settling:
            set_force.hold(force)
            force = self._transfer.force(now.time, felt, force)
            passed = now.time - self._set_at
            passed = passed if passed > LATE * self._period else self._period
            rate = 0.0 if self._last_set_point is None else (force - self._last_set_point) / passed
            self._last_set_point, self._set_at = force, now.time
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
        share = self.guard.step(force - felt, force + GUARD_RATE_ALLOWANCE * self._allowed * delay)
        followed = share * self._surface_velocity
        most = max(wanted.landing_speed, FASTEST_SETTLING_PUSH) if settling else wanted.fastest_push
        gain = share * self.live.value("force_gain")
        push = self._force.step(force, felt, gain, wanted.retreat_speed, rate) + followed
        return min(push, most + max(followed, 0.0) + abs(rate) / wanted.gain.stiffness, wanted.fastest_push)
