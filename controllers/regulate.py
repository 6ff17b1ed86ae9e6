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
from collections import deque
from dataclasses import dataclass
from enum import Enum

from palpate.controllers.force_guard import ForceGuard, GuardSettings
from palpate.controllers.force_law import DirectForce, ForceLaw
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.gains import ForceGain
from palpate.controllers.landing import Handover
from palpate.controllers.normal_force import NormalForce
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.reference_force import ReferenceForce
from palpate.controllers.surface_motion import FASTEST_SURFACE, SurfaceFilter, SurfaceMotion
from palpate.controllers.tangent_motion import Still, TangentMotion
from palpate.errors import not_negative, positive, vector
from palpate.runtime.data import Command, Observation, Phase
from palpate.spatial import ZERO, Vector, add_scaled, dot, limit_norm, norm, rotate, scale, subtract, toward

DOWN: Vector = (0.0, 0.0, -1.0)

HANDOVER = 0.5
"""Of the settling time, in which the set force goes from what is felt at the touch to where the profile begins."""

WATCH_AFTER = 3.0
"""Delays of force control after a touch, until which what the contact does is not taken for the surface's motion:
by then the knock of landing has died down."""

SETTLING_PUSH = 0.005
"""How fast it may press until it has settled, if it landed more slowly [m/s]: what is met near its turning point
goes away faster than a slow landing comes after it."""

MOST_BOUNCES = 20
"""So often it may lose contact again before it has settled; then it gives up: what it touches moves too fast."""

RATE_ALLOWANCE = 5.0
"""What the guard's threshold, a fifth of the force, is raised by: as if the force were larger by so many times
what it changes by in a delay. The error of a force that changes is then within half of the threshold."""

CALMING = 10.0
"""Delays in which that is forgotten again."""


@dataclass(frozen=True, slots=True)
class RegulateParameters:
    """How force is to be regulated.

    Attributes:
        gain: Force gain with its margin.
        lead: How far ahead the normal is predicted [s]: the lag between a command and its effect.
        duration: How long the profile is held [s].
        axis: Along which force is regulated and the surface approached, into the object, base frame; None: down
            onto it, then along the contact's normal.
        damping_time: c / K of the contact [s], by which its force leads its depth; 0 if nobody knows.
        landing_speed: Of approach and seek [m/s].
        approach_distance: How far the surface is looked for at first [m].
        settle_time: From touching to the profile's beginning [s].
        seek_distance: How far a lost surface is sought [m].
        lift_distance: How far the tip is lifted at the end [m].
        lift_speed: Of lifting [m/s].
        give_way: How fast the tip goes back from too large a force [m/s].
        fastest_push: How fast a force error alone can make it press, once it has settled [m/s].
        tangential_acceleration: Bound on the change of what moves it along the surface [m/s^2].
        normal_smoothing: Time constant of the normal's filter [s].
        slew: Bound on the change of commanded velocity [m/s^2].
    """

    gain: ForceGain
    lead: float
    duration: float
    axis: Vector | None = None
    damping_time: float = 0.0
    landing_speed: float = 0.004
    approach_distance: float = 0.05
    settle_time: float = 0.5
    seek_distance: float = 0.005
    lift_distance: float = 0.005
    lift_speed: float = 0.02
    give_way: float = FASTEST_SURFACE
    fastest_push: float = FASTEST_SURFACE
    tangential_acceleration: float = 0.5
    normal_smoothing: float = 0.01
    slew: float = 10.0

    def __post_init__(self) -> None:
        for name, unit in _UNITS.items():
            positive(name, getattr(self, name), unit)
        not_negative("damping_time", self.damping_time, "s")
        if self.axis is not None:
            vector("axis", self.axis, 3, "")
            length = positive("length of axis", norm(self.axis), "")
            object.__setattr__(self, "axis", scale(1.0 / length, self.axis))


_UNITS = {
    "lead": "s",
    "duration": "s",
    "landing_speed": "m/s",
    "approach_distance": "m",
    "settle_time": "s",
    "seek_distance": "m",
    "lift_distance": "m",
    "lift_speed": "m/s",
    "give_way": "m/s",
    "fastest_push": "m/s",
    "tangential_acceleration": "m/s^2",
    "normal_smoothing": "s",
    "slew": "m/s^2",
}


class Loss(Enum):
    """What became of the contact."""

    NEVER = "never lost"
    FOUND = "lost once and found again"
    MISSING = "nothing was there"
    GONE = "lost for good"
    BOUNCING = "never settled"


class RegulateController:
    """Lands, settles, holds a force profile, lifts off. Uses the first finger.

    Attributes:
        loss: What became of the contact so far.
        bounces: How often the tip lost contact again before it had settled.
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
        gain = parameters.gain
        self._force = NormalForce(law or DirectForce(gain), gain.stiffness, gain.delay, period)
        # its own here, for the guard has to know what the profile does; and what stands still is misjudged, too
        self._surface = None if follow is None else SurfaceMotion(follow, period)
        self._guard = ForceGuard(GuardSettings(gain.delay, period))
        self._tracker = NormalTracker(period, parameters.normal_smoothing, parameters.lead)
        self._handover = Handover(HANDOVER * parameters.settle_time)
        self._watch_after = WATCH_AFTER * gain.delay
        self._calming = math.exp(-period / (CALMING * gain.delay))
        # what a command will bring about that acts a delay from now, and what is to be felt until then
        self._ahead = ReferenceForce(max(gain.delay, parameters.lead), period)
        # F = K (d + damping_time d'): the depth, whose rate is fed forward, follows the force by so much
        damping = parameters.damping_time
        self._per_period = 1.0 if damping == 0.0 else 1.0 - math.exp(-period / damping)
        self._delays = max(1, round(gain.delay / period))
        self._expected = deque([0.0], self._delays)
        self._most_change = parameters.slew * period
        self._most_along = parameters.tangential_acceleration * period
        self._restart(ZERO, 0.0)

    def start(self, first: Observation) -> None:
        """Begin the approach from where the tip is, from rest."""
        self._restart(first.arm.position_base_tip, first.time)

    def _restart(self, position: Vector, time: float) -> None:
        self._phase, self._outcome = Phase.APPROACH, Phase.DONE
        self._since, self._from, self._start = time, position, position
        self._command, self._along = Command(), ZERO
        self._held_since: float | None = None
        self.loss, self.bounces = Loss.NEVER, 0
        self._tracker.reset()
        self._handover.reset()
        self._allowed = self._rate = 0.0
        self._forget()
        self._guard.reset()
        self._lowered = 0

    def _forget(self) -> None:
        """The tip is off the surface: forget what that did."""
        self._force.lift()
        self._spring = 0.0  # what of the felt force the contact's stiffness holds, without its damping
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
        self._change_phase(now, finger.touching)
        velocity = toward(self._command.velocity_base_tip, self._velocity(now), self._most_change)
        braking = self._phase.is_final and velocity != ZERO
        self._command = Command(velocity, self._command.phase if braking else self._phase)
        return self._command

    def wanted(self, time: float) -> float | None:
        """Return the force that the profile asked for at a time on the observations' clock [N]; None before it."""
        return None if self._held_since is None else self._profile.at(time - self._held_since)[0]

    @property
    def held_since(self) -> float | None:
        """When the profile began, on the observations' clock [s]; None before it."""
        return self._held_since

    @property
    def guard_trips(self) -> int:
        """How often gain and forward feed were halved because the loop swung, with contact kept."""
        return self._guard.trips - self._lowered

    def _enter(self, phase: Phase, now: Observation) -> None:
        self._phase, self._since, self._from = phase, now.time, now.arm.position_base_tip

    def _change_phase(self, now: Observation, touching: bool) -> None:
        wanted, phase = self._parameters, self._phase
        gone = norm(subtract(now.arm.position_base_tip, self._from))
        if phase in (Phase.APPROACH, Phase.SEEK):
            if touching:
                self._handover.reset()
                self._forget()
                self._enter(Phase.SETTLE, now)
            elif gone > (wanted.seek_distance if phase is Phase.SEEK else wanted.approach_distance):
                self.loss = Loss.GONE if phase is Phase.SEEK else Loss.MISSING
                self._enter(Phase.LOST, now)
        elif phase is Phase.SETTLE:
            if not touching:
                self._lose(now)
            elif now.time - self._since > wanted.settle_time:
                if self._held_since is None:
                    self._held_since = now.time
                self._enter(Phase.HOLD, now)
        elif phase is Phase.HOLD:
            if not touching:
                self._lose(now)
            elif self._held_since is not None and now.time - self._held_since > wanted.duration:
                self._enter(Phase.LIFT, now)
        elif phase is Phase.LIFT and gone > wanted.lift_distance:  # however a drifted sensor feels
            self._enter(self._outcome, now)

    def _lose(self, now: Observation) -> None:
        self._along = ZERO
        if self._held_since is None:  # a knock or a bounce: the approach goes on, from where it began
            self.bounces += 1
            self._tracker.reset()
            self._forget()
            if self.bounces > MOST_BOUNCES:
                self.loss = Loss.BOUNCING
                self._enter(Phase.LOST, now)
                return
            self._enter(Phase.APPROACH, now)
            self._from = self._start
            return
        trips = self._guard.trips
        self._guard.lower()  # following may be why
        self._lowered += self._guard.trips - trips
        self._forget()
        again = self.loss is Loss.NEVER
        self.loss = Loss.FOUND if again else Loss.GONE
        self._enter(Phase.SEEK if again else Phase.LOST, now)

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
        wanted, phase = self._parameters, self._phase
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
        if self._phase is Phase.HOLD and self._held_since is not None:
            moved = self._motion.velocity(now.time - self._held_since)
        change = limit_norm(subtract(moved, self._along), self._most_along)
        self._along = add_scaled(self._along, 1.0, change)
        return add_scaled(self._along, -dot(self._along, direction), direction)

    def _expect(self, force: float) -> None:
        """Nothing changes: this force [N] is to be felt."""
        self._ahead.reset(force, 0.0)
        self._rate = 0.0
        for _ in range(self._delays):
            self._expected.append(force)

    def _push(self, now: Observation) -> float:
        """Velocity into the object."""
        wanted, felt = self._parameters, self._felt(now)
        settling = self._phase is Phase.SETTLE
        since = 0.0 if self._held_since is None else now.time - self._held_since
        force, rate = self._profile.at(since)
        if settling:
            self._expect(force)
            force, rate = self._handover.force(now.time, felt, force), 0.0
        else:
            # as far ahead as its rate tells: a step comes unawares
            self._ahead.step(force + rate * wanted.gain.delay, rate)
            force = self._expected[0]
            self._rate += self._per_period * (self._ahead.rate - self._rate)
            rate = self._rate
            self._expected.append(self._ahead.force)
        self._spring += self._per_period * (felt - self._spring)
        if self._surface is not None and not (settling and now.time - self._since < self._watch_after):
            into = dot(wanted.axis or self._tracker.normal, now.arm.velocity_base_tip)
            self._surface.update(into, self._spring)
        # a force that is to change is off by about its rate times the delay: that is no oscillation
        self._allowed = max(abs(self._ahead.rate), self._allowed * self._calming)
        share = self._guard.step(force - felt, force + RATE_ALLOWANCE * self._allowed * wanted.gain.delay)
        followed = share * self._surface_velocity
        most = max(wanted.landing_speed, SETTLING_PUSH) if settling else wanted.fastest_push
        push = self._force.step(force, felt, share * wanted.gain.gain, wanted.give_way, rate) + followed
        return min(push, most + max(followed, 0.0) + abs(rate) / wanted.gain.stiffness)
