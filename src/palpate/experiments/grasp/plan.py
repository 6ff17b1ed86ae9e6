"""The plan of a grasp: all that a run, or its replay, needs."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace

from palpate.controllers.grip.announced_loads import LoadAnnouncedBefore
from palpate.controllers.grip.belief import SurfaceBelief
from palpate.controllers.grip.dithered_grip import DitheredGrip
from palpate.controllers.grip.expected_load import ExpectedLoad
from palpate.controllers.grip.grasp import GraspController, GraspStage, LiftingController, SetDownParameters
from palpate.controllers.grip.grasp_solver import MinimumGrip, RobustGrip
from palpate.controllers.grip.grip_plan import CommonGrip, GripPlan
from palpate.controllers.grip.lift import LiftController, LiftParameters
from palpate.controllers.grip.need import NeedWithoutSpin
from palpate.controllers.grip.nudge import NudgeAndLift, NudgeController, NudgedSurface, NudgeParameters
from palpate.controllers.grip.parameters import GripParameters
from palpate.controllers.grip.preload import Preload
from palpate.controllers.grip.rubbed_need import NeedWithinRubbed
from palpate.controllers.grip.shared_grip import SHARED, SharedGrip
from palpate.controllers.grip.slip_bounded_surface import SlipBoundedSurface
from palpate.controllers.grip.slip_safe import SlipSafeGrip
from palpate.controllers.grip.zeros import Zeros
from palpate.errors import InvalidValueError
from palpate.experiments.grasp.account import plan_notes
from palpate.experiments.grasp.config import KNOWN_TEXT, SPREADS, THREE, GraspConfig
from palpate.experiments.grasp.friction_belief import (
    GRIP_RIPPLE,
    NUDGE_GRIP,
    USUAL_SURFACE,
    belief_of,
    believed_surface,
    likely_surface,
    load_watch,
    slips_of,
    tip_radius,
    true_surface,
    worst_surface,
)
from palpate.experiments.grasp.metrics import MAX_GRIP
from palpate.experiments.grasp.minimum_grip import (
    check_weight,
    grip_for,
    largest_load,
    load_under,
    taking_up_time,
)
from palpate.experiments.grasp.scene import (
    PullTimes,
    config_on,
    grasp_hand,
    sensor_of,
    task_of,
    wander_of,
    zeros_of,
)
from palpate.experiments.grasp.truth import GraspFeltRecorder, GraspTruthRecorder
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
from palpate.spatial import ZERO
from palpate.viewing import ViewScene

_LIFT_ACCELERATION = 0.3
"""Acceleration of lifting and lowering [m/s^2]: 3 % of the weight."""

_LOWERING_SPEED = 0.02
"""Speed of lowering [m/s]; it stops within a millisecond with 20 m/s^2, within the limits."""

_CONTACT_TIME = 0.15
"""Time from the first touch to all of them, with the delay of servos and their bus [s]."""

_SPARE_TIME = 0.3
"""Time from the planned end of the lift to the pull [s]."""

_FELT_DELAY = 0.05
"""Time after which an announced load is felt in full [s]: bus, smoothing, and the swing of the rotors."""

_MAX_DELAY = 20.0
"""Time by which a run may exceed its plan [s]."""

NUDGE_PARAMETERS = NudgeParameters(NUDGE_GRIP, ZERO)
"""Parameters of a nudge about the middle of the fingertips."""


@dataclass(frozen=True, slots=True)
class GraspPlan(PlanDefaults):
    """The plan of a grasp.

    Attributes:
        config: Options of the grasp, with the simulated surface in numbers.
        believed: First estimate of the limit surface.
        times: Times of the pull.
        lift: Parameters of the lift.
        hand: Hand that holds the object.
        limits: Limits of the supervisor.
        found: Result of rubbing; None without.
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
        """True limit surface of the contacts; on a real robot, its first estimate."""
        return self.believed if self.hand.real else true_surface(self.config)

    @property
    def robot(self) -> Robot | None:
        """Robot that has the hand; None for a simulation."""
        return self.hand.robot

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """Descriptions of the fingers for touch."""
        if self.hand.real:
            return self.hand.fingers
        noise = sensor_of(self.config).model.dithering
        return tuple(
            replace(each, noise=noise) if isinstance(each, Finger) else each for each in self.hand.fingers
        )

    @property
    def hand_kinematics(self) -> HandKinematics:
        """Geometry of the hand."""
        return self.hand.geometry

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.hand.period

    @property
    def expected_duration(self) -> float:
        """Expected duration of the run [s]."""
        down = self.config.lift_height / _LOWERING_SPEED + _LOWERING_SPEED / _LIFT_ACCELERATION
        return self.times.gone + down + 1.5

    @property
    def longest_duration(self) -> float:
        """Duration after which the run is stopped [s]."""
        return self.expected_duration + _MAX_DELAY

    @property
    def most_rubbed(self) -> float:
        """Largest normal force at which e was measured [N]; beyond, the grip is planned with a constant e."""
        spun = None if self.found is None else self.found.spun_loads
        return math.inf if spun is None else spun[1]

    @property
    def planned_grip(self) -> float:
        """Grip of the largest load by the first estimate of friction, with the margin [N]."""
        return (1.0 + self.config.margin) * grip_for(self.config, self.believed, largest_load(self.config))

    @property
    def needed_grip(self) -> float:
        """Minimum grip of the largest load by the true surface [N]; infinite if nothing holds it."""
        return grip_for(self.config, self.true, largest_load(self.config))

    @property
    def resting_grip(self) -> float:
        """Grip before the load grows, with margin and reserve [N]."""
        config = self.config
        load = load_under(config, 0.0 if config.load == "none" else config.pull_before)
        return (1.0 + config.margin) * grip_for(config, self.believed, load) + GripParameters().reserve

    @property
    def _preload(self) -> Preload:
        return Preload(self.config.preload, self.config.offset * self.config.preload)

    @property
    def preload_cost(self) -> float:
        """Grip that every finger adds for unannounced steps of the load [N]."""
        config, p = self.config, GripParameters()
        return self._preload.grip(self.believed, config.fingers, config.margin, p.lead, p.grip_rate)

    @property
    def hold_growth(self) -> float:
        """Factor by which the grip may grow in a hold: as if the wander of each zero were load."""
        config, times = self.config, self.times
        wandered = wander_of(config, self.hand).force * (times.end - times.begin)
        load = load_under(config, 0.0 if config.load == "none" else config.pull_before)
        return 1.0 + wandered * config.fingers / -load[2]

    def task(self) -> HandTask:
        """Return the task of the hand: scene, sensors and pull."""
        return task_of(self.config, self.hand, self.times)

    def backend(self) -> Backend:
        """Return the hand over the object; nothing is opened before it starts.

        Raises:
            InvalidValueError: If it cannot be simulated, or not be built as its robot file describes.
        """
        config = self.config
        try:
            return hand_backend(self.hand, self.task())
        except InvalidValueError as error:
            if self.robot is not None:
                raise
            sizes = " x ".join(f"{1e3 * length:g}" for length in config.sizes)
            raise InvalidValueError(
                f"mass = {config.mass:g} kg, {config.object} of {sizes} mm: {error}; take a heavier or "
                "larger object"
            ) from None

    def controller(self) -> GraspController:
        """Return a fresh controller; its grip keeps alarms, and its belief estimates."""
        config, belief = self.config, belief_of(self.config, self.believed)
        zeros = zeros_of(config, self.hand, self.fingers)
        grip = self._grip(belief, zeros)
        lift = LiftController(grip, self.period, self.lift)
        lifting: LiftingController = lift
        first = GraspStage.CLOSE
        if isinstance(belief, NudgedSurface):
            parameters = replace(NUDGE_PARAMETERS, center=self.hand.geometry.center)
            nudge = NudgeController(config.fingers, self.period, parameters)
            lifting, first = NudgeAndLift(nudge, belief, lift), GraspStage.NUDGE
        down = SetDownParameters(height=config.lift_height, speed=_LOWERING_SPEED, acceleration=_LIFT_ACCELERATION)
        return GraspController(lifting, grip, self.period, down, first=first, zeros=zeros)

    def _grip(self, friction: SurfaceBelief, zeros: Zeros) -> SlipSafeGrip:
        config, n, period, hand = self.config, self.config.fingers, self.period, self.hand.geometry
        belief = SlipBoundedSurface(friction)
        watch = load_watch(config, self.believed, belief, hand, period)
        # two opposed fingers whose friction is known share alike, which is the minimum already
        shared = not config.ignores_spin and (
            config.known == "estimated" or (config.fingers == THREE and config.known == "touched")
        )
        parameters = replace(SHARED if shared else GripParameters(), margin=config.margin, largest_grip=MAX_GRIP)
        plan: GripPlan
        if shared:
            robust = config.known == "estimated"
            solver = RobustGrip(n, *SPREADS["estimated"], config.probability) if robust else MinimumGrip(n)
            plan = SharedGrip(n, belief, period, hand, parameters, solver, self.most_rubbed)
        else:
            law = NeedWithoutSpin() if config.ignores_spin else NeedWithinRubbed(self.most_rubbed)
            plan = CommonGrip(n, belief, period, parameters, law)
        announcer = self._announcer()
        if config.known != "untouched":
            return SlipSafeGrip(
                n,
                belief,
                period,
                parameters,
                None,
                plan,
                watch,
                zeros=zeros,
                announcer=announcer,
                preload=self._preload,
            )
        return DitheredGrip(
            n,
            belief,
            period,
            GRIP_RIPPLE,
            parameters,
            slips_of(config, self.believed, hand.tips[0], period),
            plan,
            watch,
            zeros=zeros,
            announcer=announcer,
            preload=self._preload,
        )

    def _announcer(self) -> LoadAnnouncedBefore | None:
        """Return the announcement of the pull before it grows; None without one."""
        config, times = self.config, self.times
        if config.announced is None:
            return None
        # a shake pulls vertically and sideways at once
        shakes = config.load == "shake"
        more = 2.0**0.5 * config.largest_pull if shakes else max(config.largest_pull - config.pull_before, 0.0)
        load = ExpectedLoad(times.grows, times.grows + config.rising + _FELT_DELAY, more, config.offset * more)
        return LoadAnnouncedBefore(load, config.announced)

    def companion(self) -> "GraspPlan | None":
        """Return the same plan by Coulomb's law alone; None without a comparison."""
        if not self.config.against_ignoring_spin:
            return None
        return replace(self, config=replace(self.config, controller="coulomb", against_ignoring_spin=False))

    def observer(
        self, controller: GraspController, truth: TruthSource | None
    ) -> GraspTruthRecorder | GraspFeltRecorder:
        """Return the recorder of true motion and loads; on a real robot, of felt contacts."""
        if truth is None or self.hand.real:
            return GraspFeltRecorder(controller, self.hand.geometry)
        return GraspTruthRecorder(truth, controller, self.config, self.hand, self.times.begin)

    def attachments(self) -> dict[str, str]:
        """Return the result of rubbing, if the grasp is planned with one."""
        return {} if self.found is None else {KNOWN_TEXT: friction_file_text(self.found)}

    def dry_run(self) -> DryRun:
        """Return durations, grips and friction known beforehand.

        Raises:
            InvalidValueError: If it cannot be simulated.
        """
        if not self.hand.real:
            self.backend()  # refuses a scene that cannot be simulated
        config = self.config
        twice = "and as long again beside it, without spin" if config.against_ignoring_spin else ""
        step = f"of every finger, for unannounced steps up to {config.preload:g} N"
        preload = (Quantity("preload", self.preload_cost, "N", step, 2),) if config.preload else ()
        metrics = (
            Quantity("expected duration", self.expected_duration, "s", twice),
            Quantity("lift height", 1e3 * config.lift_height, "mm"),
            Quantity("lift speed", 1e3 * config.lift_speed, "mm/s"),
            Quantity("largest commanded grip", MAX_GRIP, "N", "of each finger"),
            *preload,
            Quantity("friction mu, believed", self.believed.friction),
            Quantity("spin length e, believed", 1e3 * self.believed.spin_length, "mm"),
            Quantity(
                "grip limit", self.limits.grip_force, "N", "of the supervisor, which then stops it, grip kept"
            ),
            Quantity("force limit", self.limits.force, "N", "of the supervisor"),
        )
        task = f"Grasp of a {config.object} with {config.fingers} fingers"
        return DryRun(task, metrics, ("grasp.csv",), plan_notes(self))

    def view(self) -> ViewScene:
        """Return hand, object and table."""
        fingers = "two" if self.config.fingers == 2 else "three"
        return scene_view(f"A {self.config.object} in {fingers} fingers", self.task().scene().model)


def plan(config: GraspConfig, robot: Robot | None, attachments: Mapping[str, str]) -> GraspPlan:
    """Return the plan of a grasp.

    Args:
        config: Options of the grasp.
        robot: Robot that `config.robot` names; None for the simulated hand.
        attachments: Result of rubbing, as a log keeps it; empty for a new run.

    Raises:
        InvalidValueError: If the friction file cannot be read, options contradict each other, the robot has no
            hand, or the hand cannot hold so much.
    """
    true_surface(config)  # refuses typed values: below, the message would blame the file
    hand = grasp_hand(config, robot)
    config = config_on(config, hand)
    found = None
    if KNOWN_TEXT in attachments:
        found = read_friction_file(attachments[KNOWN_TEXT])
    elif config.friction_file is not None:
        found = load_friction_file(config.friction_file)
    try:
        if not hand.real:
            usual = USUAL_SURFACE if found is None else likely_surface(found)
            config = replace(config, **asdict(true_surface(config, usual)))
        believed = believed_surface(config, found)
    except InvalidValueError as error:
        if found is None:
            raise
        raise InvalidValueError(f"friction_file = {config.friction_file}: {error}") from None
    true = believed if hand.real else true_surface(config)
    cautious = believed if config.known == "touched" else worst_surface(config, believed)
    if config.known == "nudged":
        cautious = true  # a nudge measures it
    check_weight(config, cautious, true)
    lift = LiftParameters(height=config.lift_height, speed=config.lift_speed, acceleration=_LIFT_ACCELERATION)
    gap = opening_of(hand.geometry) - max(map(tip_radius, hand.geometry.tips)) - config.half_width
    closed = max(gap, 0.0) / hand.geometry.closing_speed + _CONTACT_TIME
    rise = config.lift_height / config.lift_speed + config.lift_speed / _LIFT_ACCELERATION
    taken_up = taking_up_time(config, cautious, lift.first_grip)
    begin = closed + 2.0 * lift.settle_time + taken_up + rise + _SPARE_TIME
    if config.known == "nudged":
        begin += NUDGE_PARAMETERS.duration
    times = PullTimes.of(config, begin)
    lift = replace(lift, hold_time=times.gone - begin + 2.0 * _SPARE_TIME)
    limits = hand.limits.allowing(max(config.lift_speed, _LOWERING_SPEED))
    return GraspPlan(config, believed, times, lift, hand, limits, found)
