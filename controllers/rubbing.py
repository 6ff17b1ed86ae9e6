"""Rubs and turns a finger on a surface, as a program asks, to measure the friction limit of the contact.

The tip waits in free air for the sensor's zero, makes contact by a guarded approach, and presses with the load of
each rub while it strokes the surface back and forth, turns about the contact normal, or both. In the end it lifts
off and waits again, since zeros drift. Normal force is controlled throughout. Only the program may let what was
measured decide on what comes next.

Phases: HOLD in free air, APPROACH, SETTLE while the load changes or before a motion, SCAN in motion, SEEK after
the first loss of contact, LIFT, DONE; LOST if nothing was there, or contact was lost twice.
"""

import math

from palpate.controllers.bumpless_transfer import BumplessTransfer
from palpate.controllers.force_law import DirectForce, ForceLaw
from palpate.controllers.guarded_approach import DOWN, ContactEvent, GuardedApproach, Loss
from palpate.controllers.normal_force import NormalForce
from palpate.controllers.normal_tracker import NormalTracker
from palpate.controllers.orientation import carried_along
from palpate.controllers.rub_meter import RubMeter
from palpate.controllers.rubbing_parameters import RubbingParameters, live_rubbing
from palpate.controllers.rubs import AirSpan, Rub, RubProgram, RubSpan
from palpate.errors import positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.spatial import (
    ZERO,
    Vector,
    add,
    add_scaled,
    as_vector,
    cross,
    dot,
    norm,
    rotate,
    scale,
    subtract,
    toward,
    unit,
)

HOLD, SCAN = Phase.HOLD, Phase.SCAN
PRESSING, FINAL = (Phase.SETTLE, SCAN), (Phase.DONE, Phase.LOST)
"""Looked up once, see `palpate.controllers.guarded_approach`."""

MIN_TANGENTIAL_SHARE = 0.05
"""Lower bound on the share of `along` that is tangential to the surface: 3 degrees, several times the error of the
measured normal. Strokes steeper than that take another tangential direction, the same there and back."""

MAX_ANGULAR_ACCELERATION = 125.0
"""Bound on the change of angular velocity [rad/s^2]: half of what the supervisor takes for a bug."""


class RubbingController:
    """Does the rubs of a program. Uses the first finger.

    Attributes:
        live: What may be changed while it runs: force gain.
        program: What asks for rubs; it belongs to this controller.
        spans: Each completed motion of each rub, in order.
        air: When the tip was in free air, at rest: before, and after if it got so far.
        lost: How often settled contact was lost.
        contact: Phase and contact history.
    """

    def __init__(
        self, parameters: RubbingParameters, program: RubProgram, period: float, *, law: ForceLaw | None = None
    ) -> None:
        """Take what is wanted.

        Args:
            parameters: How.
            program: What is to be done.
            period: Of control [s].
            law: Of force control; the direct one if not given.
        """
        self._parameters, self.program = parameters, program
        self._period = positive("period", period, "s")
        self.live = live_rubbing(parameters)
        gain = parameters.gain
        self._force = NormalForce(law or DirectForce(gain), gain.stiffness, gain.delay, period)
        self._tracker = NormalTracker(period, parameters.normal_smoothing, parameters.lead)
        self._transfer = BumplessTransfer(parameters.settle_time)
        self.contact = GuardedApproach(
            parameters.settle_time, parameters.approach_distance, parameters.seek_distance, Phase.SCAN
        )
        self._lever_share = 1.0 - math.exp(-period / parameters.lever_smoothing)
        self._meter = RubMeter()
        self._most_change = parameters.slew * period
        self._most_turn = MAX_ANGULAR_ACCELERATION * period
        self._restart(ZERO, 0.0)

    def start(self, first: Observation) -> None:
        """Begin at rest in free air."""
        self.live.restart()
        self.program.start()
        self._restart(first.arm.position_base_tip, first.time)

    def _restart(self, position: Vector, time: float) -> None:
        self.spans: list[RubSpan] = []
        self.air: list[AirSpan] = []
        self.lost = 0
        self.contact.start(time, position)
        self.contact.enter(Phase.HOLD)
        self._command = Command()
        self._tracker.reset()
        self._lever: Vector | None = None  # tip frame
        self._rub: Rub | None = None
        self._along = self._parameters.along
        self._back = False
        self._began = time  # at rest at the load, before the present motion
        self._wait = self._parameters.pause
        self._set = 0.0

    def step(self, now: Observation) -> Command:
        """Return velocities for the next period; a final phase only once they are zero."""
        finger, arm = now.fingers[0], now.arm
        self.contact.sense(now.time, arm.position_base_tip, finger.touching)
        if finger.touching and self.contact.phase is not HOLD:
            self._tracker.feel(arm.rotation_base_tip, finger.contact)
            share = 1.0 if self._lever is None else self._lever_share
            before = self._lever or ZERO
            self._lever = add_scaled(before, share, subtract(as_vector(finger.contact.centroid), before))
        self._change_phase(now.time)
        velocity, turn = self._motion(now)
        velocity = toward(self._command.velocity_base_tip, velocity, self._most_change)
        turn = toward(self._command.angular_velocity_base_tip, turn, self._most_turn)
        braking = (velocity != ZERO or turn != ZERO) and self.contact.phase in FINAL
        self._command = Command(velocity, self._command.phase if braking else self.contact.phase, None, turn)
        return self._command

    # what to do when

    def _change_phase(self, time: float) -> None:
        wanted, contact = self._parameters, self.contact
        event = contact.step()
        if event is not None:
            self._take(event, time)
        elif contact.settled and contact.phase in PRESSING:
            self._go_on(time)
        elif contact.phase is Phase.HOLD:
            if contact.elapsed > wanted.tare_time:
                self.air.append(AirSpan(contact.since, time))
                contact.enter(Phase.APPROACH if contact.loss is Loss.UNMADE else Phase.DONE)
        elif contact.phase is Phase.LIFT and contact.lifted(wanted.lift_distance, wanted.lift_speed):
            contact.enter(Phase.HOLD)
        if contact.loss.is_final:
            contact.enter(Phase.LOST)

    def _take(self, event: ContactEvent, time: float) -> None:
        if event is ContactEvent.TOUCHED:
            self._touch_down()
        elif event is ContactEvent.BOUNCED:
            self._tracker.reset()
            self._lever = None
        elif event is ContactEvent.SETTLED:
            self._began = time
        elif event is ContactEvent.LOST:
            self.lost += 1
            if self._back:  # the whole rub is done again
                self.spans.pop()
            if self._rub is not None:
                self._meter.begin(self._rub)

    def _touch_down(self) -> None:
        """Start force control; the first rub is asked for at the first touch."""
        self._force.lift()
        self._transfer.reset()
        self._back, self._wait = False, self._parameters.pause
        if self._rub is None:
            self._begin(self.program.next(None))

    def _begin(self, rub: Rub | None) -> None:
        """Begin a rub, or lift off after the last one."""
        if rub is None:
            self.contact.enter(Phase.LIFT)
            return
        if self._rub is None:
            self._set = rub.normal_force
        self._rub, self._back = rub, False
        self._meter.begin(rub)
        self.contact.enter(Phase.SETTLE)

    def _go_on(self, time: float) -> None:
        wanted, rub, contact = self._parameters, self._rub, self.contact
        assert rub is not None
        if contact.phase is SCAN:
            if contact.elapsed >= rub.duration:
                self.spans.append(RubSpan(rub, self._back, contact.since - wanted.pause, time))
                self._wait, self._began = wanted.pause, time
                if self._back:
                    self._begin(self.program.next(self._meter.felt()))
                else:
                    self._back = True
                    contact.enter(Phase.SETTLE)
        elif self._set != rub.normal_force:  # ramping to it
            self._wait, self._began = wanted.settle_time, time
        elif time - self._began >= self._wait:
            if not self._back:
                self._choose_direction()
            contact.enter(Phase.SCAN)

    # how to move

    def _motion(self, now: Observation) -> tuple[Vector, Vector]:
        wanted, phase = self._parameters, self.contact.phase
        if phase not in PRESSING:
            if phase is Phase.APPROACH:
                return scale(wanted.landing_speed, DOWN), ZERO
            if phase is Phase.SEEK:
                return scale(wanted.landing_speed, self._tracker.normal), ZERO
            if phase is Phase.LIFT:
                return scale(-wanted.lift_speed, self._tracker.normal), ZERO
            return ZERO, ZERO
        normal = self._tracker.predicted
        push = self._push(now)
        along, turn = ZERO, ZERO
        rub = self._rub
        if phase is SCAN and rub is not None:
            since = self.contact.elapsed
            share = -rub.share(since) if self._back else rub.share(since)
            along = scale(share * rub.speed, _along(self._along, normal, rub.heading))
            turn = scale(share * rub.spin, normal)
            self._measure(now, since)
        lever = rotate(now.arm.rotation_base_tip, self._lever or ZERO)
        return add_scaled(add(along, carried_along(turn, lever)), push, normal), turn

    def _choose_direction(self) -> None:
        """Fix the direction of the next strokes: as wanted, or any other if that points into the surface."""
        wanted, normal = self._parameters.along, self._tracker.normal
        if norm(_projected(wanted, normal)) < MIN_TANGENTIAL_SHARE * norm(wanted):
            steepest = max(range(3), key=lambda i: abs(normal[i]))
            axis = [0.0, 0.0, 0.0]
            axis[(steepest + 1) % 3] = 1.0
            wanted = (axis[0], axis[1], axis[2])
        self._along = wanted

    def _push(self, now: Observation) -> float:
        """Velocity into the object."""
        wanted, rub = self._parameters, self._rub
        assert rub is not None
        felt = now.fingers[0].contact.normal_force
        if self.contact.settled:
            step = wanted.force_rate * self._period
            change = min(max(rub.normal_force - self._set, -step), step)
            # rounding must not keep it from arriving
            self._set = rub.normal_force if abs(change) < step else self._set + change
            force, rate = self._set, change / self._period
        else:
            force, rate = self._transfer.force(now.time, felt, self._set), 0.0
        fastest = max(wanted.landing_speed, rub.speed)
        return self._force.step(force, felt, self.live.value("force_gain"), fastest, rate)

    def _measure(self, now: Observation, since: float) -> None:
        self._meter.feel(self._back, since, now.fingers[0], now.arm.rotation_base_tip, self._tracker.normal)


def _projected(direction: Vector, normal: Vector) -> Vector:
    return add_scaled(direction, -dot(direction, normal), normal)


def _along(direction: Vector, normal: Vector, heading: float) -> Vector:
    """Unit vector along the surface, turned by `heading`; none where a direction goes straight into it."""
    along = _projected(direction, normal)
    if norm(along) == 0.0:
        return ZERO
    along = unit(along)
    return (
        add_scaled(scale(math.cos(heading), along), math.sin(heading), cross(normal, along)) if heading else along
    )
