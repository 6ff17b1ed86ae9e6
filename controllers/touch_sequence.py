"""Touches one place after the other: travel, feel the air, approach, press, hold still, retract.

Each touch goes up to a safe height, turns the tip and crosses there, and comes down to a standoff. There it rests
in the air, for the sensor's zero; then it approaches along a fixed direction until it feels something, presses to
each force in turn, and stands still at each, so that wrench and pose are measured at rest. What is felt along that
direction counts as the normal force: the fingertip's own shape, which may be what is sought, is not asked.

State model of pressing: dF/dt = K v(t - T) with v = k (F_set - F), see `palpate.controllers.gains`: stable for
k K T < pi/2, and `ForceGain` has the margins. A normal that deviates by a from the direction of pressing makes K
smaller, by cos(a)^2. Travel: see `palpate.controllers.pose_motion`.

A touch that finds nothing within its distance, slips, or meets something on its way is told, and the next one
follows; three in a row of which something was in the way end the run.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum, StrEnum

from palpate.controllers.bumpless_transfer import BumplessTransfer
from palpate.controllers.force_law import DirectForce
from palpate.controllers.gains import ForceGain
from palpate.controllers.guarded_approach import ContactEvent, GuardedApproach
from palpate.controllers.normal_force import NormalForce
from palpate.controllers.pose_motion import PoseMotion, PoseMotionLimits
from palpate.errors import InvalidValueError, check_positive, positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.spatial import ZERO, Matrix, Vector, dot, norm, rotate_back, scale, subtract, toward

MOST_OBSTRUCTED = 3
"""Touches in a row on whose way something was, after which the run ends: the scene is not as it is believed."""


@dataclass(frozen=True, slots=True)
class TouchStep:
    """One touch.

    Attributes:
        standoff: Where the tip frame's origin rests before the approach, base frame [m].
        rotation: Of the tip frame, base from tip.
        direction: Unit, in which it approaches and presses, base frame.
        forces: To press with, one after the other [N].
        height: z of the tip frame's origin above which nothing stands about the standoff, base frame [m].
    """

    standoff: Vector
    rotation: Matrix
    direction: Vector
    forces: tuple[float, ...]
    height: float

    def __post_init__(self) -> None:
        if not self.forces:
            raise InvalidValueError("forces: there are none; give one at least [N]")
        for force in self.forces:
            positive("forces", force, "N")


@dataclass(frozen=True, slots=True)
class TouchParameters:
    """How it touches.

    Attributes:
        gain: Force gain with its margin.
        travel: Limits of the motion from place to place.
        search_distance: How far from the standoff something is looked for [m].
        landing_speed: Of the approach [m/s].
        air_time: How long the sensor's zero is felt before each touch, for each of its forces [s].
        settle_time: Of the force, after the touch and at each force, before it stands still [s].
        rest_time: From standing still to the first sample that counts, in the air and in contact [s].
        hold_time: How long it counts [s].
        force_rate: How fast the set force goes from one to the next [N/s].
        press_distance: How far the tip may move from where it touched [m]: farther, it slides off or sinks in.
        slew: Bound on the change of commanded velocity [m/s^2].
    """

    gain: ForceGain
    travel: PoseMotionLimits
    search_distance: float
    landing_speed: float = 0.005
    air_time: float = 0.4
    settle_time: float = 0.4
    rest_time: float = 0.2
    hold_time: float = 0.4
    force_rate: float = 4.0
    press_distance: float = 0.003
    slew: float = 10.0

    def __post_init__(self) -> None:
        check_positive(self, **_UNITS)


_UNITS = {
    "search_distance": "m",
    "landing_speed": "m/s",
    "air_time": "s",
    "settle_time": "s",
    "rest_time": "s",
    "hold_time": "s",
    "force_rate": "N/s",
    "press_distance": "m",
    "slew": "m/s^2",
}


class TouchOutcome(StrEnum):
    """What became of a touch."""

    FELT = "felt"
    NOTHING = "nothing was there"
    SLID = "it slid off or sank in"
    OBSTRUCTED = "something was in the way"
    LOADED = "it felt a load in the air"


@dataclass(frozen=True, slots=True)
class HeldSpan:
    """When a touch stood still at one force, and in the air before.

    Attributes:
        touch: Which, from 0.
        force: That was asked for [N].
        air: From when to when it was in the air [s]: for each force another stretch, so that their errors are
            independent.
        held: From when to when it pressed [s].
    """

    touch: int
    force: float
    air: tuple[float, float]
    held: tuple[float, float]


class _Stage(Enum):
    """Part of a travel."""

    UP = "up"
    ACROSS = "across"
    DOWN = "down"


class TouchSequence:
    """Touches, one after the other. Uses the first finger.

    Attributes:
        contact: Where it is in a touch.
        spans: When it stood still, so far.
        outcomes: Of each touch that is over.
    """

    def __init__(self, parameters: TouchParameters, steps: Sequence[TouchStep], period: float) -> None:
        """Take how it touches, what, and the control period [s].

        Raises:
            InvalidValueError: There is nothing to touch.
        """
        if not steps:
            raise InvalidValueError("steps: there are no touches; give one at least")
        self._parameters, self._steps, self._period = parameters, tuple(steps), period
        gain = parameters.gain
        self._force = NormalForce(DirectForce(gain), gain.stiffness, gain.delay, period)
        self._transfer = BumplessTransfer(parameters.settle_time)
        self._travel = PoseMotion(parameters.travel, period)
        self.contact = GuardedApproach(
            parameters.settle_time, parameters.search_distance, contact_phase=Phase.SCAN
        )
        self._most_change = parameters.slew * period
        self._restart(0.0, ZERO)

    def _restart(self, time: float, position: Vector) -> None:
        self.spans: list[HeldSpan] = []
        self.outcomes: list[TouchOutcome] = []
        self._force.start()
        self.contact.start(time, position)
        self._command = Command()
        self._touch = self._level = 0
        self._stage = _Stage.UP
        self._set = 0.0
        self._steady = 0.0  # since when the set force has been what is wanted
        self._air = 0.0  # since when it has been in the air
        self._touched = ZERO
        self._outcome = TouchOutcome.FELT
        self._obstructed = 0

    @property
    def touch(self) -> int:
        """The touch that is being made, from 0; as many as there are once it is done."""
        return self._touch

    def start(self, first: Observation) -> None:
        """Begin at rest in free air."""
        self._restart(first.time, first.arm.position_base_tip)
        self._set_off(first)

    def step(self, now: Observation) -> Command:
        """Return velocities for the next period; a final phase only once they are zero."""
        self.contact.sense(now.time, now.arm.position_base_tip, now.fingers[0].touching)
        self._change_phase(now)
        velocity, turn = self._motion(now)
        velocity = toward(self._command.velocity_base_tip, velocity, self._most_change)
        braking = self.contact.phase.is_final and velocity != ZERO
        phase = self._command.phase if braking else self.contact.phase
        self._command = Command(velocity, phase, None, turn)
        return self._command

    # what to do when

    def _change_phase(self, now: Observation) -> None:
        contact, wanted, touching = self.contact, self._parameters, now.fingers[0].touching
        if contact.phase is Phase.TRAVEL:
            if touching or self._travel.late:
                self._give_up(now, TouchOutcome.OBSTRUCTED)
            elif self._travel.arrived:
                self._next_stage(now)
        elif contact.phase is Phase.HOLD:
            if touching:
                self._give_up(now, TouchOutcome.LOADED)
            elif contact.elapsed >= wanted.rest_time + wanted.air_time * len(self._steps[self._touch].forces):
                self._air = contact.since + wanted.rest_time
                contact.start(now.time, now.arm.position_base_tip)
        elif contact.phase is Phase.LIFT:
            if self._travel.arrived or self._travel.late:
                self._next_touch(now)
        elif not contact.phase.is_final:
            self._press_on(now)

    def _press_on(self, now: Observation) -> None:
        """Transitions from the approach to the end of the last force."""
        contact, wanted = self.contact, self._parameters
        event = contact.step()
        if event is ContactEvent.TOUCHED:
            self._force.lift()
            self._transfer.reset()
            self._touched, self._level = now.arm.position_base_tip, 0
            self._set = self._steps[self._touch].forces[0]
        elif event is ContactEvent.SETTLED:
            self._steady = now.time
        elif event is ContactEvent.LOST:
            self._give_up(now, TouchOutcome.SLID)
        elif contact.loss.is_final:
            self._give_up(now, TouchOutcome.NOTHING)
        elif contact.phase is not Phase.APPROACH and (
            norm(subtract(now.arm.position_base_tip, self._touched)) > wanted.press_distance
        ):
            self._give_up(now, TouchOutcome.SLID)
        elif contact.phase is Phase.SCAN:
            if contact.elapsed >= wanted.rest_time + wanted.hold_time:
                self._next_force(now)
        elif contact.phase is Phase.SETTLE and contact.settled:
            if self._set != self._wanted_force:
                self._steady = now.time
            elif now.time - self._steady >= wanted.settle_time:
                contact.enter(Phase.SCAN)

    @property
    def _wanted_force(self) -> float:
        return self._steps[self._touch].forces[self._level]

    def _next_force(self, now: Observation) -> None:
        wanted = self._parameters
        held = (self.contact.since + wanted.rest_time, now.time)
        begin = self._air + self._level * wanted.air_time
        self.spans.append(HeldSpan(self._touch, self._wanted_force, (begin, begin + wanted.air_time), held))
        if self._level + 1 < len(self._steps[self._touch].forces):
            self._level += 1
            self._steady = now.time
            self._force.lift()
            self.contact.enter(Phase.SETTLE)
        else:
            self._outcome, self._obstructed = TouchOutcome.FELT, 0
            self._retract(now)

    def _give_up(self, now: Observation, outcome: TouchOutcome) -> None:
        self._outcome = outcome
        in_the_way = outcome in (TouchOutcome.OBSTRUCTED, TouchOutcome.LOADED)
        self._obstructed = self._obstructed + 1 if in_the_way else 0
        self._retract(now, up=in_the_way)

    def _retract(self, now: Observation, *, up: bool = False) -> None:
        """Go back to the standoff; straight up if it is not known what is around."""
        step, (x, y, z) = self._steps[self._touch], now.arm.position_base_tip
        goal = (x, y, max(z, step.height)) if up else step.standoff
        self.contact.enter(Phase.LIFT)
        self._travel.begin(now.arm, now.time, goal, now.arm.rotation_base_tip)

    def _next_touch(self, now: Observation) -> None:
        self.outcomes.append(self._outcome)
        self._touch += 1
        if self._obstructed >= MOST_OBSTRUCTED:
            self.contact.enter(Phase.LOST)
        else:
            self._set_off(now)

    def _set_off(self, now: Observation) -> None:
        """Go up: as high as what stands here and there."""
        last = len(self._steps) - 1
        around = (self._steps[min(max(i, 0), last)].height for i in (self._touch - 1, self._touch))
        x, y, z = now.arm.position_base_tip
        self._stage, self._high = _Stage.UP, max(z, *around)
        self.contact.enter(Phase.TRAVEL)
        self._travel.begin(now.arm, now.time, (x, y, self._high), now.arm.rotation_base_tip)

    def _next_stage(self, now: Observation) -> None:
        if self._touch == len(self._steps):
            self.contact.enter(Phase.DONE)
        elif self._stage is _Stage.DOWN:
            self.contact.enter(Phase.HOLD)
        else:
            step = self._steps[self._touch]
            x, y, _ = step.standoff
            across = self._stage is _Stage.UP
            self._stage = _Stage.ACROSS if across else _Stage.DOWN
            goal = (x, y, self._high) if across else step.standoff
            self._travel.begin(now.arm, now.time, goal, step.rotation)

    # how to move

    def _motion(self, now: Observation) -> tuple[Vector, Vector]:
        phase = self.contact.phase
        if phase in (Phase.TRAVEL, Phase.LIFT):
            return self._travel.step(now.arm, now.time)
        if phase is Phase.APPROACH:
            return scale(self._parameters.landing_speed, self._steps[self._touch].direction), ZERO
        if phase is Phase.SETTLE:
            direction = self._steps[self._touch].direction
            return scale(self._push(now, direction), direction), ZERO
        return ZERO, ZERO

    def _push(self, now: Observation, direction: Vector) -> float:
        """Velocity into the object."""
        wanted = self._parameters
        felt = -dot(now.fingers[0].force, rotate_back(now.arm.rotation_base_tip, direction))
        if self.contact.settled:
            most = wanted.force_rate * self._period
            change = min(max(self._wanted_force - self._set, -most), most)
            # rounding must not keep it from arriving
            self._set = self._wanted_force if abs(change) < most else self._set + change
            force, rate = self._set, change / self._period
        else:
            force, rate = self._transfer.force(now.time, felt, self._set), 0.0
        return self._force.step(force, felt, wanted.gain.gain, wanted.landing_speed, rate)
