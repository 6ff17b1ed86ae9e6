"""A grasp, planned: everything that a run, or its replay, needs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from palpate.controllers.grip.dithered_grip import DitheredGrip
from palpate.controllers.grip.grasp import GraspController, GraspStage, LiftingController, SetDownParameters
from palpate.controllers.grip.grasp_solver import GraspSolver, MinimumGrip, RobustGrip
from palpate.controllers.grip.grip_plan import CommonGrip
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.need import GripNeed
from palpate.controllers.grip.nudge import NudgeAndLift, NudgeController, NudgedSurface, NudgeParameters
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.shared_grip import SHARED, SharedGrip
from palpate.controllers.grip.slip_bounded_surface import SlipBoundedSurface
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.zeros import Zeros
from palpate.errors import InvalidValueError
from palpate.experiments.grasp.belief import (
    NUDGING_GRIP,
    RIPPLE,
    belief_of,
    believed_surface,
    hearing_of,
    shares,
    slips_of,
    tip_radius,
)
from palpate.experiments.grasp.config import KNOWN_TEXT, SPREADS, GraspConfig
from palpate.experiments.grasp.felt import GraspFeltRecorder
from palpate.experiments.grasp.foreseen import announcer_of, preload_of
from palpate.experiments.grasp.grip_laws import COULOMB, GRIP_LAWS
from palpate.experiments.grasp.hand import config_on, grasp_hand
from palpate.experiments.grasp.notes import notes_on
from palpate.experiments.grasp.price import price_of_preload
from palpate.experiments.grasp.scene import PullTimes, pull_times, sensor_of, task_of
from palpate.experiments.grasp.strength import LARGEST_GRIP, cautious_surface, check_weight, taking_up_time
from palpate.experiments.grasp.surface import rubbed_by_plant, true_surface, with_surface
from palpate.experiments.grasp.truth import GraspTruthRecorder
from palpate.experiments.grasp.unit_text import MILLI
from palpate.experiments.grasp.wandering import zeros_of
from palpate.experiments.kit.experiment import DryRun, PlanDefaults
from palpate.experiments.kit.scene import scene_view
from palpate.friction.friction_file import (
    FrictionFile,
    friction_file_text,
    load_friction_file,
    read_friction_file,
)
from palpate.friction.limit_surface import LimitSurface
from palpate.kinematics.hand import HandKinematics
from palpate.reporting.data import Quantity
from palpate.robots.hand_description import HandDescription, hand_backend
from palpate.robots.hand_task import HandTask
from palpate.robots.robot import Robot
from palpate.runtime import Backend, Finger, FingerDescription, Limits
from palpate.runtime.truth import TruthSource
from palpate.sim.hand.hand_model import opening_of
from palpate.spatial import ZERO, Vector
from palpate.viewing import ViewScene

LIFT_ACCELERATION = 0.3
"""[m/s^2] Of lifting and lowering: 3 % of the weight."""

LOWERING_SPEED = 0.02
"""[m/s] From that it stops within a millisecond with 20 m/s^2, within the limits."""

CONTACT_TIME = 0.15
"""[s] From the first touch to all of them, and what servos and their bus take."""

SPARE = 0.3
"""[s] From when it should be held to when something pulls."""

FILES = ("grasp.csv",)
"""Besides report and log."""

SLACK = 20.0
"""[s] For which a run may go on longer than planned."""


@dataclass(frozen=True, slots=True)
class GraspPlan(PlanDefaults):
    """A grasp, planned.

    Attributes:
        config: What was asked for, and what the simulated surface is, in numbers.
        believed: What the contacts are believed to bear at first.
        times: When it is pulled.
        lift: How it is lifted.
        hand: That does it.
        limits: For the supervisor.
        found: What rubbing had found; None if nothing was rubbed.
    """

    config: GraspConfig
    believed: LimitSurface
    times: PullTimes
    lift: LiftParameters
    hand: HandDescription = field(compare=False)  # follows from the configuration, and a robot file
    limits: Limits
    found: FrictionFile | None = None

    @property
    def true(self) -> LimitSurface:
        """What the contacts really bear; on a real robot, what they are believed to."""
        return self.believed if self.hand.real else true_surface(self.config)

    @property
    def robot(self) -> Robot | None:
        """That has the hand; None: a simulation."""
        return self.hand.robot

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """For touch, one per finger."""
        if self.hand.real:
            return self.hand.fingers
        noise = sensor_of(self.config).model.dithering
        return tuple(
            replace(each, noise=noise) if isinstance(each, Finger) else each for each in self.hand.fingers
        )

    @property
    def hand_kinematics(self) -> HandKinematics:
        """See `Plan`."""
        return self.hand.geometry

    @property
    def period(self) -> float:
        """Of control [s]."""
        return self.hand.period

    @property
    def expected_duration(self) -> float:
        """How long it takes if nothing goes wrong [s]."""
        down = self.config.lift_height / LOWERING_SPEED + LOWERING_SPEED / LIFT_ACCELERATION
        return self.times.gone + down + 1.5

    @property
    def longest_duration(self) -> float:
        """After which it is stopped [s]."""
        return self.expected_duration + SLACK

    def task(self) -> HandTask:
        """Return what the hand is to hold; of a rig, what its file describes."""
        return task_of(self.config, self.hand, self.times)

    def backend(self) -> Backend:
        """Return the hand over the object; nothing is opened before it starts.

        Raises:
            InvalidValueError: It cannot be simulated, or not be built as its robot file describes.
        """
        config = self.config
        try:
            return hand_backend(self.hand, self.task())
        except InvalidValueError as error:
            if self.robot is not None:
                raise
            sizes = " x ".join(f"{MILLI * length:g}" for length in config.sizes)
            raise InvalidValueError(
                f"mass = {config.mass:g} kg, {config.object} of {sizes} mm: {error}; take a heavier or "
                "larger object"
            ) from None

    def controller(self) -> GraspController:
        """Return a fresh controller; its grip keeps alarms, and its belief estimates."""
        config, belief = self.config, belief_of(self.config, self.believed)
        need = GRIP_LAWS[config.controller](self.most_rubbed)
        zeros = zeros_of(config, self.hand, self.fingers)
        grip = self._grip(SlipBoundedSurface(belief), need, zeros)
        lift = LiftController(grip, self.period, self.lift)
        lifting: LiftingController = lift
        first = GraspStage.CLOSE
        if isinstance(belief, NudgedSurface):
            hand = self.hand.geometry
            nudge = NudgeController(config.fingers, self.period, _nudging(hand.center))
            lifting, first = NudgeAndLift(nudge, belief, lift), GraspStage.NUDGE
        down = SetDownParameters(height=config.lift_height, speed=LOWERING_SPEED, acceleration=LIFT_ACCELERATION)
        return GraspController(lifting, grip, self.period, down, first=first, zeros=zeros)

    def _grip(self, belief: SlipBoundedSurface, need: GripNeed, zeros: Zeros) -> SlipSafeGrip:
        config, n, period = self.config, self.config.fingers, self.period
        hearing = hearing_of(config, self.believed, belief, self.hand.geometry, period)
        told, preload = announcer_of(config, self.times), preload_of(config)
        if shares(config):
            shared = replace(SHARED, margin=config.margin, largest_grip=LARGEST_GRIP)
            plan = SharedGrip(n, belief, period, self.hand.geometry, shared, self._solver(), self.most_rubbed)
            return SlipSafeGrip(
                n, belief, period, shared, None, plan, hearing, zeros=zeros, announcer=told, preload=preload
            )
        parameters = GripParameters(margin=config.margin, largest_grip=LARGEST_GRIP)
        common = CommonGrip(n, belief, period, parameters, need)
        if config.known != "untouched":
            return SlipSafeGrip(
                n, belief, period, parameters, None, common, hearing, zeros=zeros, announcer=told, preload=preload
            )
        watch = slips_of(config, self.believed, self.hand.geometry.tips[0], period)
        return DitheredGrip(
            n,
            belief,
            period,
            RIPPLE,
            parameters,
            watch,
            common,
            hearing,
            zeros=zeros,
            announcer=told,
            preload=preload,
        )

    def _solver(self) -> GraspSolver:
        if self.config.known != "estimated":
            return MinimumGrip(self.config.fingers)
        return RobustGrip(self.config.fingers, *SPREADS["estimated"], self.config.probability)

    @property
    def most_rubbed(self) -> float:
        """Up to which normal force e was measured [N]: beyond, it is planned with as if it grew no more."""
        spun = None if self.found is None else self.found.spun_loads
        return math.inf if spun is None else spun[1]

    def companion(self) -> "GraspPlan | None":
        """Return the same, planned by Coulomb's law alone, if that is to be compared with."""
        if not self.config.against_ignoring_spin:
            return None
        return replace(self, config=replace(self.config, controller=COULOMB, against_ignoring_spin=False))

    def observer(
        self, controller: GraspController, truth: TruthSource | None
    ) -> GraspTruthRecorder | GraspFeltRecorder:
        """Return what keeps what really happened; on a robot, what was felt."""
        if truth is None or self.hand.real:
            return GraspFeltRecorder(controller, self.hand.geometry)
        rubbed = rubbed_by_plant(self.config)
        return GraspTruthRecorder(truth, controller, self.config, self.hand, self.times.begin, rubbed=rubbed)

    def attachments(self) -> dict[str, str]:
        """Return what rubbing had found, if that is planned with."""
        return {} if self.found is None else {KNOWN_TEXT: friction_file_text(self.found)}

    def dry_run(self) -> DryRun:
        """Return what it would do.

        Raises:
            InvalidValueError: It cannot be simulated.
        """
        if not self.hand.real:
            self.backend()  # what cannot be simulated is refused when it is built
        config = self.config
        twice = "and as long again beside it, without spin" if config.against_ignoring_spin else ""
        metrics = (
            Quantity("expected duration", self.expected_duration, "s", twice),
            Quantity("lift height", MILLI * config.lift_height, "mm"),
            Quantity("lift speed", MILLI * config.lift_speed, "mm/s"),
            Quantity("greatest grip asked for", LARGEST_GRIP, "N", "of each finger"),
            *self._preload_figure(),
            Quantity("friction mu, believed", self.believed.friction),
            Quantity("spin length e, believed", MILLI * self.believed.spin_length, "mm"),
            Quantity(
                "grip limit", self.limits.grip_force, "N", "of the supervisor, which then stops it, grip kept"
            ),
            Quantity("force limit", self.limits.force, "N", "likewise"),
        )
        task = f"Grasp of a {config.object} with {config.fingers} fingers"
        return DryRun(task, metrics, FILES, notes_on(self))

    def _preload_figure(self) -> tuple[Quantity, ...]:
        if not self.config.preload:
            return ()
        note = f"of every finger, for steps up to {self.config.preload:g} N that nobody announces"
        return (Quantity("preload", price_of_preload(self), "N", note, 2),)

    def view(self) -> ViewScene:
        """Return hand, object and table."""
        fingers = "two" if self.config.fingers == 2 else "three"
        return scene_view(f"A {self.config.object} in {fingers} fingers", self.task().scene().model)


def plan(config: GraspConfig, robot: Robot | None, attachments: Mapping[str, str]) -> GraspPlan:
    """Return a grasp, planned.

    Args:
        config: What was asked for.
        robot: That `config.robot` names; None: the simulated hand.
        attachments: What a log kept of friction; empty for a new run.

    Raises:
        InvalidValueError: The friction file cannot be read, something cannot be, the robot has no hand, or
            the hand cannot hold so much.
    """
    true_surface(config)  # refuses typed values: below, the message would blame the file
    hand = grasp_hand(config, robot)
    config = config_on(config, hand)
    found = None
    if KNOWN_TEXT in attachments:
        found = read_friction_file(attachments[KNOWN_TEXT])
    elif config.friction_file is not None:
        found = load_friction_file(config.friction_file)  # which names the file where it is wrong
    try:
        config = config if hand.real else with_surface(config, found)
        believed = believed_surface(config, found)
    except InvalidValueError as error:
        if found is None:
            raise
        raise InvalidValueError(f"friction_file = {config.friction_file}: {error}") from None
    true = believed if hand.real else true_surface(config)
    cautious = cautious_surface(config, believed, true)
    check_weight(config, cautious, true)
    lift = LiftParameters(height=config.lift_height, speed=config.lift_speed, acceleration=LIFT_ACCELERATION)
    gap = opening_of(hand.geometry) - max(map(tip_radius, hand.geometry.tips)) - config.half_width
    closed = max(gap, 0.0) / hand.geometry.closing_speed + CONTACT_TIME
    rise = config.lift_height / config.lift_speed + config.lift_speed / LIFT_ACCELERATION
    taken_up = taking_up_time(config, cautious, lift.first_grip)
    begin = closed + 2.0 * lift.settle_time + taken_up + rise + SPARE
    if config.known == "nudged":
        begin += nudge_time()
    times = pull_times(config, begin)
    lift = replace(lift, hold_time=times.gone - begin + 2.0 * SPARE)
    limits = hand.limits.allowing(max(config.lift_speed, LOWERING_SPEED))
    return GraspPlan(config, believed, times, lift, hand, limits, found)


def _nudging(center: Vector) -> NudgeParameters:
    return NudgeParameters(NUDGING_GRIP, center)


def nudge_time() -> float:
    """Return how long a nudge takes, from the last finger's touch [s]."""
    return _nudging(ZERO).duration
