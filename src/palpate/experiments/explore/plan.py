"""From a configuration to an exploration that can be carried out: everything is checked and built here."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise

import msgspec
import numpy as np

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    ForceProfile,
    IdentifyController,
    IdentifyParameters,
    LandingModel,
    Room,
    SineForce,
    force_gain,
    live_parameters,
    tracking_delay,
)
from palpate.controllers.explore_parameters import ACCELERATION
from palpate.controllers.paths import PathPlane
from palpate.errors import InvalidValueError
from palpate.experiments.explore.checks import check_least_force, check_push, check_sliding
from palpate.experiments.explore.config import FASTEST, SLOWEST, ExploreConfig
from palpate.experiments.explore.experiment import FILE_NAMES
from palpate.experiments.explore.explored_object import object_of, object_texts
from palpate.experiments.explore.identified import IdentifiedForce
from palpate.experiments.explore.objects import FROM_FILE
from palpate.experiments.explore.plan_watch import PlanWatch
from palpate.experiments.explore.scan import PathTiming, Scan, scan_on
from palpate.experiments.explore.wall_bound import WallBound
from palpate.experiments.kit.allowed_speed import limits_allowing
from palpate.experiments.kit.change_names import check_changes
from palpate.experiments.kit.contact_checks import LEAST_FORCE, MOST_FORCE, check_compression
from palpate.experiments.kit.experiment import DryRun, PlanDefaults
from palpate.experiments.kit.joint_quantities import joint_notes, joint_quantities
from palpate.experiments.kit.limit_quantities import limit_quantities
from palpate.experiments.kit.pressing import IDENTIFIED_TEXT, identified_text, pressed, pressing, read_identified
from palpate.experiments.kit.run_checks import CLEARANCE, LANDING_SHARE, check_force, check_speed
from palpate.kinematics import FollowedPath, follow_path
from palpate.mapping import Knowledge
from palpate.mapping.primitives.fit import TIP_SIZE_SD
from palpate.reporting.data import Quantity
from palpate.robots.finger_sensor import sensor_for
from palpate.robots.fingertip import fingertip, only_finger
from palpate.robots.in_scene import build
from palpate.robots.known_truth import known_scene, scene_of
from palpate.robots.robot import Robot
from palpate.robots.task import Task
from palpate.robots.values import on_robot
from palpate.runtime import Backend, FingerDescription, Limits
from palpate.runtime.following import FollowingMaker
from palpate.runtime.live import Change
from palpate.runtime.servo_following import PositionServo
from palpate.runtime.shown_plan import PlanDiary
from palpate.runtime.stopping import Stopping
from palpate.runtime.supervision.guard import Guard
from palpate.runtime.truth import TruthSource
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty
from palpate.sim import Scene, SceneObject, Target
from palpate.sim.objects.target import as_target
from palpate.sim.presets import EXPLORE
from palpate.spatial import Vector
from palpate.viewing import SurfaceView, ViewScene

GRID = 2e-3
"""Between places whose height is looked up [m]."""

MOST_PLACES = 5000
"""Of those; a height field of a scan takes some microseconds for each."""


def tip_path(scan: Scan, target: SceneObject, plane: PathPlane, tip_height: float) -> list[Vector]:
    """Return points of the tip frame's path, as far as the object is as described, base frame [m].

    Args:
        scan: Of the middle of the tip.
        target: What is explored; where it has no height the tip comes down beside it.
        plane: In whose coordinates the scan is.
        tip_height: From the middle of the tip to its lowest point [m].
    """
    corners = scan.corners
    grid = max(GRID, sum(math.dist(*ends) for ends in pairwise(corners)) / MOST_PLACES)
    places = np.array(corners[:1])
    for a, b in pairwise(corners):
        count = max(1, math.ceil(math.dist(a, b) / grid))
        places = np.vstack([places, np.linspace(a, b, count + 1)[1:]])
    heights = target.height(*places.T)
    lowest = np.where(np.isnan(heights), target.bottom, heights) + tip_height
    return [plane.base((x, y), z) for (x, y), z in zip(places.tolist(), lowest.tolist(), strict=True)]


ROOM = 0.02
"""How far beyond its path the supervisor lets the tip go [m]; half of it the controller, which marks what is
beyond instead of being stopped."""

BENDS = 2.0
"""A contour bends no more sharply than so many times the fingertip: its middle goes round a corner at a radius."""

SPARE_TIME = 10.0
"""That a run may always take longer [s]."""

LIFT_SPEED = 0.02
"""Of lifting, and from place to place above the object, at most [m/s]."""

FASTEST_LANDING = 0.005
"""[m/s], where what lands and what it lands on would allow more."""

PRESSING = 60.0
"""[s] It takes about 30 once it has landed."""

MILLI = 1e3
"""mm per m."""


@dataclass(frozen=True, slots=True, eq=False)
class ExplorationPlan(PlanDefaults):
    """An exploration that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        config: What is asked for, completed from the robot file.
        robot: What carries it out.
        target: The surface that is touched; `task.target` may have surroundings.
        scan: Where it goes, for the middle of the tip.
        plane: In it the coordinates of the tip frame's origin are those of the middle of the tip.
        parameters: For the controller.
        timing: Durations of paths.
        finger: For touch.
        limits: For the supervisor.
        scene: What is simulated; None on a robot.
        half_compliance: Of tip and object together, half their compression per force [m/N].
        task: What the robot is built for.
        touch_force: Force that counts as a touch [N].
        landing: How hard it presses.
        servo: How the arm follows commands and gives way.
        wall: Bound on the force of hitting a wall during the sweep.
        followed: What the path asks of the arm's joints; None: palpate does not move them.
        holding: Fingers that hold the object, if any do.
        robot_guards: Returns fresh ones of the robot's own.
        identified: Result of pressing; None: the gain is made for the assumed stiffness.
    """

    config: ExploreConfig
    robot: Robot
    target: SceneObject
    scan: Scan
    plane: PathPlane
    parameters: ExploreParameters
    timing: PathTiming
    finger: FingerDescription
    limits: Limits
    scene: Scene | None
    half_compliance: float
    task: Task
    touch_force: float
    landing: LandingModel
    servo: PositionServo
    wall: WallBound
    followed: FollowedPath | None
    holding: tuple[FingerDescription, ...] = ()
    robot_guards: Callable[[], tuple[Guard, ...]] = tuple
    identified: IdentifiedForce | None = None

    @property
    def fingers(self) -> tuple[FingerDescription, ...]:
        """See `Plan`: the one that explores, then those that hold the object."""
        return (self.finger, *self.holding)

    @property
    def tip_uncertainty(self) -> TipUncertainty:
        """How well the fingertip is known: as the robot file says, else exactly if it is simulated."""
        said = self.robot.file.fingers[0].surface_sd
        if said is not None:
            return said.uncertainty
        return EXACT if self.scene is not None else TipUncertainty.independent(size=TIP_SIZE_SD)

    @property
    def period(self) -> float:
        """Of control [s]."""
        return self.task.period

    @property
    def expected_duration(self) -> float:
        """See `Plan`; without pressing first."""
        return self.scan.duration(self.timing)

    @property
    def longest_duration(self) -> float:
        """See `Plan`."""
        return self.scan.longest(self.timing) + SPARE_TIME

    @property
    def following(self) -> FollowingMaker:
        """See `Plan`."""
        return self.servo.following(self.limits.force)

    @property
    def profile(self) -> ForceProfile | None:
        """Of the force while the tip sweeps; None: the live parameter `force`."""
        config = self.config
        if not config.force_swing:
            return None
        return SineForce(config.force, config.force_swing, 1.0 / config.force_period)

    def backend(self) -> Backend:
        """See `Plan`."""
        return build(self.robot, self.task).backend

    def controller(self) -> ExploreController:
        """See `Plan`; with a fresh strategy."""
        found, strategy = self.identified, self.scan.strategy(self.plane, self.timing)
        law = None if found is None else found.law(self.period)
        return ExploreController(self.parameters, strategy, self.period, law=law, profile=self.profile)

    def changes(self) -> tuple[Change, ...]:
        """See `Plan`."""
        return tuple(Change(*change) for change in self.config.change)

    def guards(self) -> tuple[Guard, ...]:
        """See `Plan`."""
        return self.robot_guards()

    def observer(self, controller: ExploreController, truth: TruthSource | None) -> PlanDiary:
        """See `Plan`: keeps where the tip was going."""
        return PlanDiary(PlanWatch(controller))

    def shown_plan(self, controller: ExploreController) -> PlanWatch:
        """See `Plan`."""
        return PlanWatch(controller)

    def texts(self) -> dict[str, str]:
        """See `Plan`: the geometry of an object from a file, and what pressing has found."""
        found = self.identified
        pressed_text = {} if found is None else {IDENTIFIED_TEXT: identified_text(found)}
        return pressed_text | object_texts(self.task.target, self.config)

    @property
    def preparation(self) -> str:
        """See `Plan`."""
        return "pressing, to find stiffness and delay" if self._must_press else ""

    def prepared(self) -> "ExplorationPlan":
        """See `Plan`: press where it begins, if that was asked for, and take the force law that follows."""
        return self.with_identified(self._pressed()) if self._must_press else self

    @property
    def _must_press(self) -> bool:
        return self.config.identify and self.identified is None

    def with_identified(self, found: IdentifiedForce) -> "ExplorationPlan":
        """Return the plan with the force law that pressing has found.

        Raises:
            InvalidValueError: A change that was asked for is out of its bounds.
        """
        parameters = replace(self.parameters, gain=found.gain)
        check_changes(self.config.change, live_parameters(parameters))
        return replace(
            self, parameters=parameters, timing=replace(self.timing, parameters=parameters), identified=found
        )

    def pressing(self) -> IdentifyParameters:
        """Return how it presses first."""
        return pressing(
            self.config.force,
            limits=self.limits,
            touch_force=self.touch_force,
            sensing_delay=self.finger.pipeline().delay,
            approach_distance=self.parameters.approach_distance,
        )

    def _pressed(self) -> IdentifiedForce:
        wanted = self.pressing()
        return pressed(
            self.backend(),
            self.fingers,
            self.limits,
            IdentifyController(wanted, self.period),
            IdentifiedForce.of,
            longest=wanted.approach_distance / wanted.landing_speed + PRESSING,
        )

    def dry_run(self) -> DryRun:
        """See `Plan`."""
        config, scan = self.config, self.scan
        (x0, y0), (x1, y1) = ((MILLI * x, MILLI * y) for x, y in scan.box)
        unknown = "what is felt decides" if math.isnan(scan.length) else "seen from above"
        # the object may not be as described
        unsafe = config.speed > self.wall.speed and (config.beyond or config.object in FROM_FILE)
        walls = (f"A wall or step in the path would be {self.wall}.",) if unsafe else ()
        return DryRun(
            f"Exploration of {config.thing} by touch",
            (
                Quantity("path", scan.line),
                Quantity("expected duration", self.expected_duration, "s", "without pressing first"),
                Quantity("longest duration", self.longest_duration, "s", "then it is stopped"),
                Quantity("path length", MILLI * scan.length, "mm", unknown),
                Quantity("path along x", x1 - x0, "mm", f"from {x0:.4g} to {x1:.4g} mm"),
                Quantity("path along y", y1 - y0, "mm", f"from {y0:.4g} to {y1:.4g} mm"),
                Quantity("force", config.force, "N", "to hold"),
                Quantity("greatest force asked for", config.greatest_force, "N"),
                Quantity("speed", MILLI * config.speed, "mm/s", "along the surface"),
                Quantity("landing speed", MILLI * self.parameters.landing_speed, "mm/s"),
                *joint_quantities(self.followed),
                *limit_quantities(self.limits, self.landing),
            ),
            FILE_NAMES,
            (*joint_notes(self.followed), *walls),
        )

    def view(self) -> ViewScene:
        """See `Plan`: scene, map and the surface that it becomes."""
        from palpate.experiments.kit.scene_view import scene_view  # with what draws

        config, scan, scene = self.config, self.scan, known_scene(self.backend())
        title = f"Exploration of {config.thing}, {config.robot}"
        growing = SurfaceView(
            rows=scan.row_gap,
            voxel=config.map_spacing,
            half_compliance=self.half_compliance,
            sensed_force=config.force,
            # beside a single line nothing is surrounded by contacts: its ribbon is all there is
            worst=Knowledge.EXTRAPOLATED if scan.kind == "contour" else Knowledge.OBSERVED,
        )
        return replace(scene_view(title, scene.model, config.map_spacing), surface=growing)


def plan(config: ExploreConfig, robot: Robot, texts: Mapping[str, str]) -> ExplorationPlan:
    """Check and build everything that an exploration needs; see `Experiment.plan`.

    Args:
        config: What to do. Fingertip, noise and period that it leaves out are the robot file's.
        robot: What carries it out.
        texts: What the log of an earlier run kept; empty for a new run, for which the object's file is read.

    Raises:
        InvalidValueError: It cannot be carried out; the message names the remedy.
    """
    config = on_robot(config, robot)
    planned = plan_on(object_of(config, texts), config, robot)
    found = texts.get(IDENTIFIED_TEXT)
    return planned if found is None else planned.with_identified(read_identified(found, IdentifiedForce))


def plan_on(touched: SceneObject | Target, config: ExploreConfig, robot: Robot) -> ExplorationPlan:
    """Return the plan of an exploration of a given object; the object options of `config` are not read.

    Raises:
        InvalidValueError: It cannot be realised.
    """
    target = as_target(touched).shape
    scan = scan_on(target, config)
    half_compliance = 0.5 / config.stiffness
    check_compression(config.tip, config.force, config.stiffness)
    law = replace(
        EXPLORE.law,
        stiffness=config.stiffness,
        friction=config.friction,
        spin_length=config.spin_length,
        smallest_force=config.touch_force,
    )
    top = target.top + max(config.tip) + CLEARANCE
    first_x, first_y = scan.begin
    # a scan speaks of the middle of the tip; what is moved is the tip frame, which never turns
    x, y, z = only_finger(robot).surface.center
    task = Task(
        tip=fingertip(robot, config.tip),
        compression=config.force * half_compliance,
        target=touched,
        law=law,
        start=(first_x - x, first_y - y, top - z),
        period=config.period or robot.file.period,
        sensor=sensor_for(robot, config),
        touch_force=config.touch_force,
    )
    descent = (target.top - target.bottom) + max(config.tip) + CLEARANCE
    plane = PathPlane((-x, -y, -z))
    braking = _fastest(config) * (robot.file.limits.sample_age + Stopping().delay)
    limits, room = _limits(robot.file.limits, scan, plane, top, descent, _stopping(config, scan), braking)
    fastest = max(_fastest(config), limits.commanded_speed - FASTEST_LANDING)
    check_force(config.force, config.greatest_force, limits)
    ready = build(robot, task)
    check_push(config, ready.stiffness, ready.following_error_limit)
    check_speed("speed", config.speed, limits)
    landing = ready.landing_model(config.stiffness)
    most = _fastest(config) + FASTEST_LANDING
    limits = limits_allowing(limits, f"speed = {_fastest(config):g} m/s", most, landing)
    scene = scene_of(ready.backend)
    if scene is not None:
        check_sliding(config, scene.pair)
    least = LEAST_FORCE * ready.touch_force
    check_least_force(config, least)
    sensing_delay = ready.finger.pipeline().delay
    acceleration = _acceleration(config, scan)
    parameters = ExploreParameters(
        force=config.force,
        speed=config.speed,
        acceleration=acceleration,
        gain=force_gain(landing.stiffness, landing.delay),
        lead=tracking_delay(task.period, ready.lag, sensing_delay),
        landing_speed=min(FASTEST_LANDING, landing.speed(config.force, ready.touch_force)),
        approach_distance=descent,
        force_range=_force_range(config, least, limits),
        speed_range=(SLOWEST, min(FASTEST, fastest)),
        room=room,
        lift_speed=min(LIFT_SPEED, limits.commanded_speed),
        travel_speed=min(LIFT_SPEED, limits.commanded_speed),
    )
    check_changes(config.change, live_parameters(parameters))
    below = float(target.height(np.array(first_x), np.array(first_y)))
    below = target.bottom if math.isnan(below) else below  # beside its rim a tip touches a ball, too
    gap = max(top - below - config.tip[-1], CLEARANCE)
    path = tip_path(scan, target, plane, config.tip[-1])
    return ExplorationPlan(
        config,
        robot,
        target,
        scan,
        plane,
        parameters,
        PathTiming(parameters, gap, descent),
        ready.finger,
        limits,
        scene,
        half_compliance,
        task,
        ready.touch_force,
        landing,
        ready.servo,
        WallBound.of(landing, config.force, config.speed, config.friction, limits.force),
        None if ready.arm is None else follow_path(ready.arm, path, config.speed),
        ready.holding,
        ready.guards,
    )


def _acceleration(config: ExploreConfig, scan: Scan) -> float:
    """Bound on tangential acceleration [m/s^2]: on a contour enough for a circle of the fingertip's size."""
    if scan.kind != "contour":
        return ACCELERATION
    return max(ACCELERATION, BENDS * config.speed**2 / min(config.tip))


def _stopping(config: ExploreConfig, scan: Scan) -> float:
    """Stopping distance from the largest speed that is asked for [m]."""
    return 0.5 * _fastest(config) ** 2 / _acceleration(config, scan)


def _fastest(config: ExploreConfig) -> float:
    """The largest speed along the surface that is asked for [m/s]."""
    return max([config.speed, *(value for _, name, value in config.change if name == "speed")])


def _limits(
    robot: Limits, scan: Scan, plane: PathPlane, top: float, descent: float, stopping: float, braking: float
) -> tuple[Limits, Room]:
    """The robot's limits, with as much of its workspace as the path needs, and the controller's room within.

    The room ends `braking` [m] before the robot's workspace: nearer to that, the supervisor stops what moves on.
    """
    (x0, y0), (x1, y1) = scan.box
    lower, upper = plane.base((x0, y0), top - descent), plane.base((x1, y1), top)
    for axis, low, high, least, most in zip(
        "xyz", lower, upper, robot.workspace_lower, robot.workspace_upper, strict=True
    ):
        if high > most or (low < least and axis != "z"):  # the object decides how far down it comes
            raise InvalidValueError(
                f"the path reaches from {low:g} to {high:g} m along {axis}: it leaves the robot's workspace, "
                f"{least:g} to {most:g} m (limits.workspace_lower_m, workspace_upper_m in the robot file); take a "
                "smaller region or object, or a robot with more room"
            )

    def around(room: float, inset: float = 0.0) -> tuple[Vector, Vector]:
        low = (max(a - room, least + inset) for a, least in zip(lower, robot.workspace_lower, strict=True))
        high = (min(a + room, most - inset) for a, most in zip(upper, robot.workspace_upper, strict=True))
        return (next(low), next(low), next(low)), (next(high), next(high), next(high))

    workspace_lower, workspace_upper = around(ROOM + stopping)
    limits = msgspec.structs.replace(robot, workspace_lower=workspace_lower, workspace_upper=workspace_upper)
    return limits, Room(*around(0.5 * ROOM + stopping, braking))


def _force_range(config: ExploreConfig, least: float, limits: Limits) -> tuple[float, float]:
    """Bounds of the live parameter `force` [N]; with a profile it is fixed."""
    if config.force_swing:
        return config.force, config.force
    return least, min(MOST_FORCE, LANDING_SHARE * limits.force)
