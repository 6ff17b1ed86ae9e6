"""Hybrid force/position control that explores a surface leg by leg, as a strategy asks.

In the contact frame given by the centroid's normal, the normal direction is under force control and the tangents
under motion control (Raibert & Craig 1981). The tip makes contact by a guarded approach, slides where the leg
leads (`palpate.controllers.paths`), lifts off and travels above the object to where it lands next. Lost contact is
searched for once per leg. A slew limit bounds the change of the commanded velocity from period to period.

Force, speed and force gain may be changed while it runs: see `live_parameters`. Optional: another force control
law than the direct one, following of a moving surface, a force profile, and a tip that turns with the surface.
"""

import math
from dataclasses import replace

from palpate.controllers.explore_parameters import ExploreParameters, live_parameters
from palpate.controllers.flight import Airspace, Flight
from palpate.controllers.force_law import ForceLaw
from palpate.controllers.force_profile import ForceProfile
from palpate.controllers.guarded_approach import ContactEvent, GuardedApproach, Loss
from palpate.controllers.held_force import HeldForce
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.orientation import Orientation, carried_along
from palpate.controllers.paths.slides import Slide, prepare, slide
from palpate.controllers.paths.strategy import (
    ContactPeriod,
    Hop,
    Leg,
    LegEnd,
    LegResult,
    Point,
    SingleTouch,
    Strategy,
    Stroke,
)
from palpate.controllers.surface_motion import SurfaceFilter
from palpate.controllers.tip_state import TipState
from palpate.runtime.data import Command, Observation, Phase
from palpate.spatial import ZERO, Vector, add, add_scaled, dot, norm, rotate, scale, subtract, toward

SCAN = Phase.SCAN
PRESSING, IN_FLIGHT = (Phase.SETTLE, SCAN), (Phase.LIFT, Phase.TRAVEL)
"""Looked up once: in every period it would take as long as the control of the force."""

MIN_TOUCH_IN_FLIGHT = 0.1
"""Lower bound, as a share of the set force, on what counts as a touch in flight. A sensor's zero drifts, and a tip
that took 0.1 N of drift for an object overhead lifted off into the one below (7 N, where 2 N were set)."""


class ExploreController:
    """Does what a strategy asks for, leg by leg. Uses the first finger.

    The run ends as DONE with the strategy, or as LOST if that ended because of a loss or nothing was ever swept.
    Heights at which the tip travels and how far down it looks for the surface count from where the run begins, so
    that should be above the object.

    Attributes:
        live: What may be changed while it runs: force, speed and force gain.
        strategy: What decides where the tip goes; its marks tell what there is besides the surface.
        leg: That is being carried out; None before the start and after the end.
        contact: Phase and contact history; the history is that of the present leg.
    """

    def __init__(
        self,
        parameters: ExploreParameters,
        strategy: Strategy,
        period: float,
        *,
        law: ForceLaw | None = None,
        follow: SurfaceFilter | None = None,
        profile: ForceProfile | None = None,
        orientation: Orientation | None = None,
    ) -> None:
        """Take what is wanted.

        Args:
            parameters: Parameters of an exploration.
            strategy: Where; it belongs to this controller from now on.
            period: Of control [s].
            law: Of force control; the direct one, if not given.
            follow: How the motion of the surface is followed; taken for still, if not given.
            profile: Of the force while it sweeps, from the beginning of the first sweep on; the live parameter
                `force`, if not given.
            orientation: Turns the tip with the surface; it never turns, if not given.
        """
        self.live = live_parameters(parameters)
        self.strategy = strategy
        self.leg: Leg | None = None
        self._parameters = parameters
        self._period = period
        self._plane = strategy.plane
        self._tracker = NormalTracker(period, parameters.normal_smoothing, parameters.lead)
        self._force = HeldForce(parameters, period, law, follow, profile)
        self._orientation = orientation
        self.contact = GuardedApproach(
            parameters.settle_time, parameters.approach_distance, parameters.seek_distance, Phase.SCAN, math.inf
        )
        self._delay, self._room = parameters.gain.delay, parameters.room
        self._most_change = parameters.slew * period
        self._braking = parameters.acceleration * period
        prepare()
        self._forget()

    def _forget(self) -> None:
        self._command = Command()
        self._state = TipState(0.0, ZERO, ZERO, False, ZERO, ZERO)
        self._space = Airspace(self._parameters, self._plane, self._period, 0.0)
        self._low = 0.0  # height at which the tip travels from touch to touch
        self._begin: Point = (0.0, 0.0)  # where the present leg begins, if all went well
        self._ending: LegEnd | None = None  # of the present leg, while the tip comes to rest
        self._ended: LegEnd | None = None  # of the last leg
        self._swept = False
        self._slide: Slide | None = None
        self._along: Vector = ZERO
        self._flight: Flight | None = None
        self._outcome: Phase | None = None  # of the run, once the strategy has ended

    def start(self, first: Observation) -> None:
        """Begin with the first leg from where the tip is, from rest."""
        self._forget()
        self.contact.start(first.time, first.arm.position_base_tip)
        self.live.restart()
        self._force.start()
        if self._orientation is not None:
            self._orientation.reset()
        # what is felt before the tip has moved is no contact yet
        self._state = state = replace(self._sensed(first), touching=False)
        self._tracker.reset()
        u, v, top = self._plane.flat(state.tip)
        self._space = replace(self._space, top=top)
        self._low, self._begin = top, (u, v)
        self.strategy.start()
        self._begin_leg(self.strategy.next(None), state)

    def step(self, now: Observation) -> Command:
        """Return the velocity for the next period; a final phase only once that is zero."""
        self._state = state = self._sensed(now)
        self.contact.sense(state.time, state.position, state.touching)
        if self._ending is None:
            self._go_on(state)
        if self._ending is not None and self._rests(state):
            self._next_leg(self._ending, state)
        velocity, turn = self._velocity(now, state), ZERO
        if self._orientation is not None:
            turn, along = self._turn(now, state, self._orientation)
            velocity = add(velocity, along)
        before, phase = self._command, self.contact.phase
        velocity = toward(before.velocity_base_tip, velocity, self._most_change)
        # the run ends with the final phase: first come to rest as gently as ever
        if self._outcome is not None and phase.is_final and (velocity != ZERO or turn != ZERO):
            phase = before.phase
        self._command = command = Command(velocity, phase, None, turn)
        return command

    def _sensed(self, now: Observation) -> TipState:
        arm, finger, before = now.arm, now.fingers[0], self._state
        normal, lever, tip = before.normal, before.lever, arm.position_base_tip
        touching = finger.touching
        if touching and self.contact.phase in IN_FLIGHT:
            touching = norm(finger.force) >= MIN_TOUCH_IN_FLIGHT * self.live.value("force")
        if touching:
            normal, lever = self._tracker.feel(arm.rotation_base_tip, finger.contact)
        if self._orientation is not None:
            pivot = self._orientation.pivot
            tip = add(tip, subtract(rotate(arm.rotation_base_tip, pivot), pivot))
        return TipState(now.time, arm.position_base_tip, tip, touching, normal, lever)

    def _pressing(self, state: TipState) -> bool:
        """Whether force control acts."""
        return state.touching and self.contact.phase in PRESSING

    def _turn(self, now: Observation, state: TipState, orientation: Orientation) -> tuple[Vector, Vector]:
        """Angular velocity that keeps the tip normal, and velocity that keeps the contact in place meanwhile."""
        if not self._pressing(state):
            return orientation.rest(), ZERO
        turn = orientation.turn(now.arm.rotation_base_tip, self._tracker.predicted)
        return turn, carried_along(turn, state.lever)

    def _go_on(self, state: TipState) -> None:
        contact = self.contact
        if contact.phase in IN_FLIGHT and self._flight is not None:
            self._flight.step(state)
            self._fly(self._flight, state)
            return
        event = contact.step(self._travel(state) if contact.searching else 0.0)
        if event is None and contact.phase is SCAN:  # in most periods
            self._slide_on(state)
            return
        if event is ContactEvent.TOUCHED:
            self._force.touch(state.time)
        elif event is ContactEvent.BOUNCED:
            self._tracker.reset()
        elif event is ContactEvent.LOST:
            self._lose(state)
        elif event is ContactEvent.SETTLED and isinstance(self.leg, Hop):
            self._conclude(LegEnd.REACHED)
        elif event is ContactEvent.SETTLED:
            self._slide_on(state)
        if contact.loss.is_final:
            self._conclude(LegEnd.MISSED if contact.loss is Loss.MISSING else LegEnd.LOST)

    # from leg to leg

    def _begin_leg(self, leg: Leg | None, state: TipState) -> None:
        self.leg, self._slide, self._along = leg, None, ZERO
        self.contact.renew()
        if leg is None:
            self._finish(state)
        elif isinstance(leg, Hop):
            self._low = self._space.top
            self._fly(Flight(self._space, state, (leg.to, self._space.top)), state)
        elif isinstance(leg, SingleTouch):
            low = self._ended is LegEnd.REACHED
            self._fly(Flight(self._space, state, (leg.at, self._low if low else self._space.top)), state)
        elif self._pressing(state):
            self._slide_on(state)
        else:  # the path along the surface begins on it
            self._begin = self._place(state)
            self._approach()

    def _finish(self, state: TipState) -> None:
        self._outcome = Phase.DONE if self._swept and self._ended is not LegEnd.LOST else Phase.LOST
        # not to be left deep beside the object
        rise = self._outcome is Phase.DONE and self._ended is LegEnd.MISSED
        self._fly(Flight(self._space, state, (self._place(state), self._space.top) if rise else None), state)

    def _conclude(self, how: LegEnd) -> None:
        """The leg has ended; the next begins when the tip rests."""
        self._ending = how

    def _rests(self, state: TipState) -> bool:
        if self._pressing(state):
            return self._along == ZERO
        # what was lost is given up in the period that brings the tip to rest; otherwise it rests for one at least
        left = self._most_change if self._ending is LegEnd.LOST else 0.0
        return norm(self._command.velocity_base_tip) <= left

    def _next_leg(self, how: LegEnd, state: TipState) -> None:
        self._ending, self._ended = None, how
        leg = self.leg
        if how is LegEnd.REACHED and isinstance(leg, Hop | SingleTouch):
            self._begin = leg.to if isinstance(leg, Hop) else leg.at
        elif how is LegEnd.REACHED and isinstance(leg, Stroke):
            self._begin = leg.corners[-1]
        else:
            self._begin = self._place(state)
        self._begin_leg(self.strategy.next(LegResult(how, state.tip)), state)

    def _place(self, state: TipState) -> Point:
        u, v, _ = self._plane.flat(state.tip)
        return (u, v)

    # off the surface

    def _fly(self, flight: Flight, state: TipState) -> None:
        """Go on flying, or do what the flight was for."""
        self._flight = flight
        if flight.arrived is None:
            if flight.phase is not self.contact.phase:
                self.contact.enter(flight.phase)
        elif self._outcome is not None:
            self.contact.enter(self._outcome)
        elif not flight.arrived:
            self._conclude(LegEnd.BLOCKED)
        elif isinstance(self.leg, SingleTouch) and self._slide is not None:  # it has touched and is back
            self._low = min(self._plane.flat(state.tip)[2], self._space.top)
            self._conclude(LegEnd.REACHED)
        else:
            self._approach()

    def _approach(self) -> None:
        self._tracker.reset()
        self.contact.approach()

    def _travel(self, state: TipState) -> float:
        """How far the present approach or search has gone [m]; unbounded where the tip would leave its room."""
        if not self._in_room(state):
            return math.inf
        if self.contact.phase is Phase.APPROACH:
            return self._space.top - self._plane.flat(state.tip)[2]
        return self.contact.travel

    # on the surface

    def _lose(self, state: TipState) -> None:
        if isinstance(self.leg, SingleTouch):  # it was felt, which is all that was wanted
            self._retreat(self.leg, state)
            return
        if self._slide is not None:
            self._slide.stop()
        self._force.lose()
        self._along = ZERO

    def _slide_on(self, state: TipState) -> None:
        if self._slide is None:
            leg, acceleration = self.leg, self._parameters.acceleration
            assert leg is not None
            assert not isinstance(leg, Hop)
            self._slide = slide(leg, self._begin, self._place(state), self._plane, acceleration, self._period)
        (x, y, z), (p, q, r) = state.normal, self._tracker.predicted
        felt = ContactPeriod(state.tip, add(state.position, state.lever), (-x, -y, -z))
        along = self._slide.step(felt, (-p, -q, -r), self.live.value("speed"))
        if isinstance(along, LegEnd) and along is LegEnd.STEEP:
            self._conclude(along)
            return
        if self.contact.phase is not SCAN:
            self._force.sweep(state.time)
            self.contact.enter(SCAN)
        self._swept = True
        found = self.strategy.feel(felt)
        if isinstance(along, LegEnd):
            if isinstance(self.leg, SingleTouch):
                self._retreat(self.leg, state)
            else:
                self._conclude(along)
            return
        self._along = along
        if found:
            self._conclude(LegEnd.REACHED)
        elif not self._in_room(state):
            self._conclude(LegEnd.BLOCKED)

    def _retreat(self, leg: SingleTouch, state: TipState) -> None:
        self._along = ZERO
        self._fly(Flight(self._space, state, back=leg.retreat), state)

    def _in_room(self, state: TipState) -> bool:
        """Whether the tip can still come to rest within its room."""
        (x, y, z), (u, v, w) = state.position, self._command.velocity_base_tip
        time = self._delay + 0.5 * math.hypot(u, v, w) / self._parameters.acceleration
        return self._room.holds((x + time * u, y + time * v, z + time * w))

    # velocities

    def _velocity(self, now: Observation, state: TipState) -> Vector:
        wanted, phase = self._parameters, self.contact.phase
        if self._pressing(state):
            return self._on_surface(now, state)
        if self._ending is not None or phase.is_final:
            return ZERO
        if phase is Phase.APPROACH:
            return scale(-wanted.landing_speed, self._plane.axis)
        if phase is Phase.SEEK:
            return scale(wanted.landing_speed, self._tracker.normal)
        if self._flight is None:
            return ZERO
        normal = self._tracker.normal if phase is Phase.LIFT else ZERO  # it lifts off what it touches
        return self._flight.velocity(state, normal, self._force.surface_velocity)

    def _on_surface(self, now: Observation, state: TipState) -> Vector:
        normal, force = self._tracker.predicted, self._force
        control = force.sweeping if self.contact.phase is SCAN else force.settling
        push = control(now, self._tracker.normal, state.lever, self.live)
        if self._ending is not None:  # come to rest along the surface
            self._along = toward(self._along, ZERO, self._braking)
            self._along = add_scaled(self._along, -dot(self._along, normal), normal)
        return add_scaled(self._along, push, normal)
