"""Hybrid force/position control that explores a surface along a path.

In the contact frame given by the centroid's normal, the normal direction is under force control and the tangents
under motion control (Raibert & Craig 1981). The tip lands slowly, lets the force settle, sweeps the path, and
lifts off; if it loses the surface it seeks it once, slowly and not far, and otherwise gives up. Whatever it does,
the commanded velocity changes from one period to the next by no more than a slew limit allows.

Force, speed and force gain may be changed while it runs: see `live_parameters`. What else can be had, each of it
only if asked for: another law of force control than the direct one, a surface that moves (followed), a force that
follows a profile, and a tip that turns with the surface.
"""

import math
from dataclasses import dataclass

from palpate.controllers.force_law import DirectForce, ForceLaw
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.gains import ForceGain
from palpate.controllers.landing import Handover
from palpate.controllers.normal_force import NormalForce
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.orientation import Orientation, carried_along
from palpate.controllers.raster import PathFollower, Raster
from palpate.controllers.surface_motion import SurfaceFilter
from palpate.errors import positive
from palpate.runtime.data import ArmSample, Command, Observation, Phase
from palpate.runtime.live import LiveParameter, LiveParameters
from palpate.spatial import ZERO, Vector, add, add_scaled, cross, dot, norm, rotate, scale, subtract, toward

DOWN: Vector = (0.0, 0.0, -1.0)

STEEPEST = math.radians(70.0)
"""Steepest slope that is swept [rad]: beyond it the path, given from above, makes no progress, and a tip that
came over an edge would slide down the side for ever."""

FORCE_RATE = 1.0 / 3.0
"""How far the set force moves in one delay of force control, in least forces. With dF/dt = k K (F_set - F)(t - T)
the force trails a ramp r by r T / (k K T); where the ramp ends it overshoots by about 0.2 r T at k K T = 0.6, the
largest live gain, and by 0.09 r T at the default 0.5: less than 5 % of where a ramp upwards can end."""


HANDOVER = 0.5
"""Of the settling time, in which the set force goes from what is felt at the touch to what is wanted: half of it
is left to settle."""

WATCH_AFTER = 3.0
"""Delays of force control after a touch, until which what the contact does is not taken for the surface's motion:
by then the knock of landing has died down."""


@dataclass(frozen=True, slots=True)
class ExploreParameters:
    """What the exploration is to be like.

    Attributes:
        force: Normal force to hold [N].
        speed: Along the surface [m/s].
        gain: Force gain with its margin.
        lead: How far ahead the normal is predicted [s]: the lag between a command and its effect.
        normal_smoothing: Time constant of the normal's filter [s].
        acceleration: Bound on tangential acceleration [m/s^2].
        landing_speed: Of approach and seek [m/s]. The landing peak grows with it: about 2 N at 5 mm/s and
            20 kN/m.
        approach_distance: How far down the surface is looked for at first [m].
        settle_time: From touching to sweeping [s].
        seek_distance: How far a lost surface is sought [m].
        lift_distance: How far the tip is lifted at the end [m].
        lift_speed: Of lifting [m/s].
        slew: Bound on the change of commanded velocity [m/s^2]. By default 10 mm/s in a millisecond: twice the
            landing speed, so that landing never waits for it, and far below what the supervisor stops at.
        force_range: Least and largest force that may be asked for while it runs [N]. By default from one and a
            half times the touch threshold of a `Finger` to three quarters of the supervisor's limit.
        speed_range: Likewise for the speed [m/s].
    """

    force: float
    speed: float
    gain: ForceGain
    lead: float
    normal_smoothing: float = 0.01
    acceleration: float = 0.5
    landing_speed: float = 0.005
    approach_distance: float = 0.05
    settle_time: float = 0.3
    seek_distance: float = 0.005
    lift_distance: float = 0.005
    lift_speed: float = 0.02
    slew: float = 10.0
    force_range: tuple[float, float] = (0.3, 15.0)
    speed_range: tuple[float, float] = (0.001, 0.1)

    def __post_init__(self) -> None:
        for name, unit in _UNITS.items():
            positive(name, getattr(self, name), unit)
        for name, unit in (("force_range", "N"), ("speed_range", "m/s")):
            for end in getattr(self, name):
                positive(name, end, unit)


_UNITS = {
    "force": "N",
    "speed": "m/s",
    "lead": "s",
    "normal_smoothing": "s",
    "acceleration": "m/s^2",
    "landing_speed": "m/s",
    "approach_distance": "m",
    "settle_time": "s",
    "seek_distance": "m",
    "lift_distance": "m",
    "lift_speed": "m/s",
    "slew": "m/s^2",
}


def live_parameters(parameters: ExploreParameters) -> LiveParameters:
    """Return what may be changed while an exploration runs. What was asked for at the start is always in bounds.

    `force` moves at `FORCE_RATE`; `speed` at the path's bound on acceleration, which the tip can keep to downwards
    too; `force_gain` within and at the rate that `ForceGain` states.
    """
    force, speed, gain = parameters.force, parameters.speed, parameters.gain
    (least, most), (slowest, fastest) = parameters.force_range, parameters.speed_range
    weakest, strongest = gain.live_range
    force_rate = FORCE_RATE * min(least, force) / gain.delay
    return LiveParameters(
        LiveParameter(
            "force", force, min(least, force), max(most, force), force_rate, "N", "normal force to hold"
        ),
        LiveParameter(
            "speed",
            speed,
            min(slowest, speed),
            max(fastest, speed),
            parameters.acceleration,
            "m/s",
            "speed along the surface",
        ),
        LiveParameter(
            "force_gain",
            gain.gain,
            weakest,
            strongest,
            gain.live_rate,
            "m/s/N",
            "normal velocity per force error",
        ),
    )


class ExploreController:
    """Lands, settles, sweeps a raster, lifts off. Uses the first finger.

    Attributes:
        live: What may be changed while it runs: force, speed and force gain.
    """

    def __init__(
        self,
        parameters: ExploreParameters,
        raster: Raster,
        period: float,
        *,
        law: ForceLaw | None = None,
        follow: SurfaceFilter | None = None,
        profile: ForceProfile | None = None,
        orientation: Orientation | None = None,
    ) -> None:
        """Take what is wanted.

        Args:
            parameters: What the exploration is to be like.
            raster: Where.
            period: Of control [s].
            law: Of force control; the direct one, if not given.
            follow: How the motion of the surface is followed; taken for still, if not given.
            profile: Of the force while it sweeps, from the beginning of the sweep on; the live parameter `force`,
                if not given.
            orientation: Turns the tip with the surface; it never turns, if not given.
        """
        self.live = live_parameters(parameters)
        self._parameters = parameters
        self._raster = raster
        self._period = period
        self._tracker = NormalTracker(period, parameters.normal_smoothing, parameters.lead)
        self._follower = PathFollower(raster.corners(), parameters.acceleration)
        self._phase = Phase.APPROACH
        self._since = 0.0
        self._from: Vector = ZERO
        self._sought = False
        self._landed = False
        self._outcome = Phase.DONE
        self._start: Vector = ZERO
        self._most_change = parameters.slew * period
        self._command = Command()
        gain = parameters.gain
        self._force = NormalForce(law or DirectForce(gain), gain.stiffness, gain.delay, period, follow)
        self._handover = Handover(HANDOVER * parameters.settle_time)
        self._follows, self._watch_after = follow is not None, WATCH_AFTER * gain.delay
        self._profile = profile
        self._scanning_since = 0.0
        self._orientation = orientation

    def start(self, first: Observation) -> None:
        """Begin the approach from where the tip is, from rest."""
        self.live.restart()
        self._command = Command()
        self._tracker.reset()
        self._follower = PathFollower(self._raster.corners(), self._parameters.acceleration)
        self._sought = False
        self._landed = False
        self._outcome = Phase.DONE
        self._start = first.arm.position_base_tip
        self._force.start()
        if self._orientation is not None:
            self._orientation.reset()
        self._enter(Phase.APPROACH, first)

    def step(self, now: Observation) -> Command:
        """Return the velocity for the next period; a final phase only once that is zero."""
        finger = now.fingers[0]
        if finger.touching:
            x, y, z = finger.contact.normal.tolist()
            self._tracker.update(rotate(now.arm.rotation_base_tip, (x, y, z)))
        self._change_phase(now, finger.touching)
        velocity, turn = self._velocity(now), ZERO
        if self._orientation is not None:
            turn, along = self._turn(now, self._orientation)
            velocity = add(velocity, along)
        velocity = toward(self._command.velocity_base_tip, velocity, self._most_change)
        # the run ends with the final phase: first come to rest as gently as ever
        braking = self._phase.is_final and (velocity != ZERO or turn != ZERO)
        self._command = Command(velocity, self._command.phase if braking else self._phase, None, turn)
        return self._command

    def _turn(self, now: Observation, orientation: Orientation) -> tuple[Vector, Vector]:
        """Angular velocity that keeps the tip normal, and velocity that keeps the contact in place meanwhile."""
        if not (now.fingers[0].touching and self._phase in (Phase.SETTLE, Phase.SCAN)):
            return orientation.rest(), ZERO
        turn = orientation.turn(now.arm.rotation_base_tip, self._tracker.predicted)
        return turn, carried_along(turn, self._lever(now))

    def _lever(self, now: Observation) -> Vector:
        """From the tip frame's origin to the contact, base coordinates [m]."""
        x, y, z = now.fingers[0].contact.centroid.tolist()
        return rotate(now.arm.rotation_base_tip, (x, y, z))

    def _enter(self, phase: Phase, now: Observation) -> None:
        self._phase, self._since, self._from = phase, now.time, now.arm.position_base_tip

    def _change_phase(self, now: Observation, touching: bool) -> None:
        wanted, phase = self._parameters, self._phase
        gone = norm(subtract(now.arm.position_base_tip, self._from))
        if phase in (Phase.APPROACH, Phase.SEEK):
            if touching:
                self._handover.reset()
                self._force.lift()
                self._enter(Phase.SETTLE, now)
            elif gone > (wanted.seek_distance if phase is Phase.SEEK else wanted.approach_distance):
                self._enter(Phase.LOST, now)
        elif phase is Phase.SETTLE:
            if not touching:
                self._lose(now)
            elif now.time - self._since > wanted.settle_time:
                if not self._landed:
                    self._landed, self._scanning_since = True, now.time
                self._enter(Phase.SCAN, now)
                self._leave_if_steep(now)
        elif phase is Phase.SCAN:
            if not touching:
                self._lose(now)
            elif self._follower.finished:
                self._enter(Phase.LIFT, now)
            else:
                self._leave_if_steep(now)
        elif phase is Phase.LIFT and gone > wanted.lift_distance:
            self._enter(self._outcome, now)

    def _leave_if_steep(self, now: Observation) -> None:
        if -self._tracker.predicted[2] < math.cos(STEEPEST):  # beside the object, or over its edge
            self._outcome = Phase.LOST
            self._enter(Phase.LIFT, now)

    def _lose(self, now: Observation) -> None:
        if not self._landed:  # a knock, noise or a bounce: the approach goes on, from where it began
            self._tracker.reset()
            self._enter(Phase.APPROACH, now)
            self._from = self._start
            return
        self._follower.stop()
        self._force.lose()
        self._enter(Phase.LOST if self._sought else Phase.SEEK, now)
        self._sought = True

    def _velocity(self, now: Observation) -> Vector:
        wanted, live, phase = self._parameters, self.live.value, self._phase
        if phase is Phase.APPROACH:
            return scale(wanted.landing_speed, DOWN)
        if phase is Phase.SEEK:
            return scale(wanted.landing_speed, self._tracker.normal)
        if phase is Phase.LIFT:
            # away from a surface that comes after it, too
            return scale(min(self._force.surface_velocity, 0.0) - wanted.lift_speed, self._tracker.normal)
        if phase in (Phase.DONE, Phase.LOST):
            return ZERO
        normal, speed = self._tracker.predicted, live("speed")
        fastest = wanted.landing_speed if phase is Phase.SETTLE else max(wanted.landing_speed, speed)
        push = self._push(now, fastest, live("force"), live("force_gain"))
        along = self._along_surface(now, normal, speed) if phase is Phase.SCAN else ZERO
        return add_scaled(along, push, normal)

    def _on_path(self, arm: ArmSample) -> Vector:
        """Where that point is which follows the path [m], as if the tip had not turned."""
        if self._orientation is None:
            return arm.position_base_tip
        pivot = self._orientation.pivot
        return add(arm.position_base_tip, subtract(rotate(arm.rotation_base_tip, pivot), pivot))

    def _push(self, now: Observation, fastest: float, wanted: float, gain: float) -> float:
        """Velocity into the object that force control asks for; `fastest` bounds what an error alone can."""
        felt, rate = now.fingers[0].contact.normal_force, 0.0
        settling = self._phase is Phase.SETTLE
        if self._profile is not None:
            since = now.time - self._scanning_since if self._landed else 0.0
            wanted, _ = self._profile.at(since)
            if not settling:
                _, rate = self._profile.at(since + self._parameters.gain.delay)
        if settling:
            wanted = self._handover.force(now.time, felt, wanted)
        if self._follows and not (settling and now.time - self._since < self._watch_after):
            arm, normal = now.arm, self._tracker.normal
            contact = add(arm.velocity_base_tip, cross(arm.angular_velocity_base_tip, self._lever(now)))
            self._force.watch(dot(normal, contact), felt)
        return self._force.step(wanted, felt, gain, fastest, rate)

    def _along_surface(self, now: Observation, normal: Vector, speed: float) -> Vector:
        """The path's horizontal velocity, raised or lowered so that it lies in the tangent plane."""
        nx, ny, nz = normal
        x, y, _ = self._on_path(now.arm)
        ux, uy = self._follower.heading
        climb = -(nx * ux + ny * uy) / nz
        slope = 1.0 / (1.0 + climb * climb) ** 0.5
        vx, vy = self._follower.velocity((x, y), slope, speed, self._period)
        return (vx, vy, -(nx * vx + ny * vy) / nz)
