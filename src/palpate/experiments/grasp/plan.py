"""A grasp, planned: everything that a run, or its replay, needs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from palpate.controllers.grip.belief import SurfaceBelief
from palpate.controllers.grip.grasp import Carry, GraspController, GraspStage, SetDownParameters
from palpate.controllers.grip.grasp_solver import GraspSolver, LeastGrip, LikelyGrip
from palpate.controllers.grip.grip_plan import CommonGrip
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.need import GripNeed, NeedWithoutSpin
from palpate.controllers.grip.noted_watch import DeafWatch, NotedWatch, UnheededWatch
from palpate.controllers.grip.nudge import NudgeAndLift, NudgeController, NudgedSurface, NudgeParameters
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.rippled import RippledGrip
from palpate.controllers.grip.rubbed_need import NeedWithinRubbed
from palpate.controllers.grip.shared_grip import SHARED, SharedGrip
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.errors import InvalidValueError
from palpate.experiments.grasp.belief import (
    NUDGING_GRIP,
    RIPPLE,
    belief_of,
    believed_surface,
    largest_rubbed,
    shares,
    slips_of,
    tip_radius,
)
from palpate.experiments.grasp.config import SPREADS, GraspConfig
from palpate.experiments.grasp.hand import PERIOD, GraspHand, config_on, grasp_hand
from palpate.experiments.grasp.scene import PullTimes, load_of, pull_times, scene_of, sensor_of
from palpate.experiments.grasp.strength import LARGEST_GRIP, check_weight, taking_up_time
from palpate.experiments.grasp.surface import true_surface, with_surface
from palpate.experiments.grasp.text import GRASP_TEXT, KNOWN_TEXT, grasp_text, read_grasp
from palpate.experiments.grasp.unit_text import MILLI
from palpate.friction.friction_file import friction_file_text, load_friction_file
from palpate.friction.limit_surface import LimitSurface
from palpate.robots.values import load_named_robot
from palpate.runtime import FingerDescription, Limits, Touch
from palpate.runtime.robot import Robot, read_robot
from palpate.sim.hand.backend import HandBackend
from palpate.spatial import ZERO, Vector

LIFT_ACCELERATION = 0.3
"""[m/s^2] Of lifting and lowering: 3 % of the weight."""

LOWERING_SPEED = 0.02
"""[m/s] From that it stops within a millisecond with 20 m/s^2, within the limits."""

CONTACT_TIME = 0.15
"""[s] From the first touch to all of them, and what servos and their bus take."""

SPARE = 0.3
"""[s] From when it should be held to when something pulls."""

NOTHING: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class GraspPlan:
    """A grasp, planned.

    Attributes:
        config: What was asked for, and what the simulated surface is, in numbers.
        believed: What the contacts are believed to bear at first.
        times: When it is pulled.
        lift: How it is lifted.
        hand: That does it.
        limits: For the supervisor.
        known: What rubbing had found, as text; empty if nothing was rubbed.
        rubbed: Up to which normal force e was measured [N]: beyond, it is planned with as if it grew no more.
    """

    config: GraspConfig
    believed: LimitSurface
    times: PullTimes
    lift: LiftParameters
    hand: GraspHand = field(compare=False)  # follows from the configuration, and a robot file
    limits: Limits
    known: str = ""
    rubbed: float = math.inf

    @property
    def true(self) -> LimitSurface:
        """What the contacts really bear; on a real robot, where nobody knows, what they are believed to."""
        return self.believed if self.hand.real else true_surface(self.config)

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """For touch, one per finger."""
        return self.hand.fingers

    @property
    def period(self) -> float:
        """Of control [s]."""
        return self.hand.period

    @property
    def expected_duration(self) -> float:
        """How long it takes if nothing goes wrong [s]."""
        down = self.config.lift_height / LOWERING_SPEED + LOWERING_SPEED / LIFT_ACCELERATION
        return self.times.gone + down + 1.5

    def touch(self) -> Touch:
        """Return fresh touch."""
        return Touch(*self.fingers)

    def backend(self) -> HandBackend:
        """Return the simulated hand over the object.

        Raises:
            InvalidValueError: It cannot be simulated so.
        """
        config = self.config
        try:
            scene = scene_of(config)
        except InvalidValueError as error:
            sizes = " x ".join(f"{MILLI * length:g}" for length in config.sizes)
            raise InvalidValueError(
                f"mass = {config.mass:g} kg, {config.object} of {sizes} mm: {error}; take a heavier or "
                "larger object"
            ) from None
        return HandBackend(scene, PERIOD, sensor=sensor_of(config), load=load_of(config, self.times))

    def watch(self) -> NotedWatch:
        """Return a fresh listener for slip; a grip that ignores spin, or is shared, does not heed it."""
        slips = slips_of(self.config, self.believed, self.hand.hand.tip, self.period)
        if shares(self.config):
            return DeafWatch(slips)
        return UnheededWatch(slips) if self.config.ignore_spin else NotedWatch(slips)

    def belief(self) -> SurfaceBelief:
        """Return afresh what is planned with, and how that learns."""
        return belief_of(self.config, self.believed)

    def controller(self, watch: NotedWatch | None = None, belief: SurfaceBelief | None = None) -> GraspController:
        """Return a fresh controller.

        Args:
            watch: Who listens for slip; one of its own if not given.
            belief: What is planned with; one of its own if not given.
        """
        config, belief = self.config, belief or self.belief()
        need: GripNeed = NeedWithoutSpin() if config.ignore_spin else NeedWithinRubbed(self.rubbed)
        grip = self._grip(belief, watch or self.watch(), need)
        lift = LiftController(grip, self.period, self.lift)
        carry: Carry = lift
        first = GraspStage.CLOSE
        if isinstance(belief, NudgedSurface):
            hand = self.hand.hand
            center = (0.0, 0.0, -(hand.depth + hand.tip_along))
            nudge = NudgeController(config.fingers, self.period, _nudging(center))
            carry, first = NudgeAndLift(nudge, belief, lift), GraspStage.NUDGE
        down = SetDownParameters(height=config.lift_height, speed=LOWERING_SPEED, acceleration=LIFT_ACCELERATION)
        return GraspController(carry, grip, self.period, down, first=first)

    def _grip(self, belief: SurfaceBelief, watch: NotedWatch, need: GripNeed) -> SlipSafeGrip:
        config, n, period = self.config, self.config.fingers, self.period
        if shares(config):
            shared = replace(SHARED, margin=config.margin, largest_grip=LARGEST_GRIP)
            plan = SharedGrip(n, belief, period, self.hand.hand, shared, self._solver(), self.rubbed)
            return SlipSafeGrip(n, belief, period, shared, watch, plan)
        parameters = GripParameters(margin=config.margin, largest_grip=LARGEST_GRIP)
        common = CommonGrip(n, belief, period, parameters, need)
        if config.known == "untouched":
            return RippledGrip(n, belief, period, RIPPLE, parameters, watch, common)
        return SlipSafeGrip(n, belief, period, parameters, watch, common)

    def _solver(self) -> GraspSolver:
        if self.config.known != "estimated":
            return LeastGrip(self.config.fingers)
        return LikelyGrip(self.config.fingers, *SPREADS["estimated"], self.config.probability)

    def ignoring_spin(self) -> "GraspPlan":
        """Return the same, planned by Coulomb's law alone."""
        config = replace(self.config, ignore_spin=True, against_ignoring_spin=False)
        return replace(self, config=config)

    def texts(self) -> dict[str, str]:
        """Everything from which the very same is planned again, by file name."""
        texts = {GRASP_TEXT: grasp_text(self.config)}
        if self.hand.robot is not None:
            texts |= self.hand.robot.texts
        return {**texts, KNOWN_TEXT: self.known} if self.known else texts


def plan(config: GraspConfig) -> GraspPlan:
    """Return a grasp, planned.

    Raises:
        InvalidValueError: The friction file cannot be read, something cannot be, the robot has no hand, or
            the hand cannot hold so much.
    """
    true_surface(config)  # refuses what was typed: below, it would be the file's fault
    robot = None if config.robot is None else load_named_robot(config.robot)
    config = config_on(config, grasp_hand(config, robot))
    if config.friction_file is None:
        planned = plan_with(config, NOTHING, robot)
    else:
        found = load_friction_file(config.friction_file)  # which names the file where it is wrong
        try:
            planned = plan_with(config, {KNOWN_TEXT: friction_file_text(found)}, robot)
        except InvalidValueError as error:
            raise InvalidValueError(f"friction_file = {config.friction_file}: {error}") from None
    check_weight(planned.config, planned.believed)
    return planned


def plan_with(config: GraspConfig, texts: Mapping[str, str], robot: Robot | None = None) -> GraspPlan:
    """Return a grasp, planned with what a log's texts say of friction.

    Args:
        config: What was asked for.
        texts: See there.
        robot: That `config.robot` names; the one of the texts if not given.

    Raises:
        InvalidValueError: Something in the texts is wrong.
    """
    config = with_surface(config, texts)
    believed = believed_surface(config, texts)
    if config.robot is not None and robot is None:
        robot = read_robot(texts)
    by = grasp_hand(config, robot)
    hand = by.hand
    gap = hand.opening - tip_radius(hand.tip) - config.half_width
    closed = max(gap, 0.0) / hand.closing_speed + CONTACT_TIME
    rise = config.lift_height / config.lift_speed + config.lift_speed / LIFT_ACCELERATION
    lift = LiftParameters(height=config.lift_height, speed=config.lift_speed, acceleration=LIFT_ACCELERATION)
    taken_up = taking_up_time(config, believed, lift.first_grip)
    begin = closed + 2.0 * lift.settle_time + taken_up + rise + SPARE
    if config.known == "nudged":
        begin += nudge_time()
    times = pull_times(config, begin)
    lift = replace(lift, hold_time=times.gone - begin + 2.0 * SPARE)
    return GraspPlan(
        config, believed, times, lift, by, by.limits, texts.get(KNOWN_TEXT, ""), largest_rubbed(texts)
    )


def _nudging(center: Vector) -> NudgeParameters:
    return NudgeParameters(NUDGING_GRIP, center)


def nudge_time() -> float:
    """Return how long a nudge takes, from the last finger's touch [s]."""
    return _nudging(ZERO).duration


def plan_from_texts(texts: Mapping[str, str]) -> GraspPlan:
    """Return the plan of a recorded grasp.

    Raises:
        InvalidValueError: Something in the texts is wrong.
    """
    return plan_with(read_grasp(texts[GRASP_TEXT]), texts)
