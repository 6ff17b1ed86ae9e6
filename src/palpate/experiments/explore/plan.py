"""From a configuration to an exploration, checked and built."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Self

import msgspec
import numpy as np

from palpate.controllers import (
    ExploreController,
    ExploreParameters,
    ForceProfile,
    LandingModel,
    Room,
    SineForce,
    live_parameters,
)
from palpate.controllers.explore_parameters import ACCELERATION
from palpate.controllers.paths import Circuit, Hop, Leg, Mark, PathPlane, Point, SingleTouch, Stroke
from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import FASTEST, FROM_FILE, SLOWEST, ExploreConfig
from palpate.experiments.explore.experiment import FILE_NAMES
from palpate.experiments.explore.explored_object import object_notes, object_of, object_texts
from palpate.experiments.explore.scan import PathTiming, Scan, scan_on
from palpate.experiments.kit.checks import (
    MIN_FORCE_PER_TOUCH_FORCE,
    check_acceleration,
    check_changes,
    check_compression,
    check_force,
    check_least_force,
    check_speed,
    max_set_force,
)
from palpate.experiments.kit.one_finger import (
    CLEARANCE,
    IDENTIFIED_TEXT,
    MAX_LANDING_SPEED,
    MAX_LIFT_SPEED,
    Identified,
    PressingPlan,
    Setup,
    check_workspace,
    workspace_around,
)
from palpate.kinematics import follow_path
from palpate.mapping import Knowledge
from palpate.mapping.primitives.fit import TIP_SIZE_SD
from palpate.reporting.data import Quantity
from palpate.robots.finger_sensor import sensor_for
from palpate.robots.fingertip import fingertip, only_finger
from palpate.robots.known_truth import scene_of
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.robots.values import on_robot
from palpate.runtime import Limits
from palpate.runtime.shown_plan import PlanDiary, ShownMark, ShownPlan
from palpate.runtime.stopping import Stopping
from palpate.runtime.truth import TruthSource
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty
from palpate.sim import PairParameters, SceneObject, Target
from palpate.sim.objects.target import as_target
from palpate.sim.presets import EXPLORE
from palpate.spatial import Vector
from palpate.viewing import SurfaceView, ViewScene

_MIN_GRID = 2e-3
"""Smallest distance between places whose height is looked up [m]."""

_MAX_PLACES = 5000
"""Largest number of places whose height is looked up; a height field takes some microseconds for each."""

_ROOM = 0.02
"""Distance beyond the path that the supervisor allows [m]. The controller takes half of it, and marks places
beyond instead of being stopped."""

_CONTOUR_BEND = 2.0
"""Largest curvature of a contour times the tip's radius: the tip's centre goes round a corner at a radius."""

_SPARE_TIME = 10.0
"""Time that a run may take beyond the longest duration of its scan [s]."""

_LOOK_EVERY = 10
"""Periods between two looks at the marks: ten milliseconds, three times as often as figures are drawn."""


@dataclass(frozen=True, slots=True)
class WallBound:
    """Bound on the force with which a sweeping tip hits an unexpected vertical wall or step.

    One contact does not show what lies ahead, so the wall is met at full speed, as in a landing, while the tip
    presses on the floor: at most F + v max(K T, 2 sqrt(K m)) (see `palpate.controllers.landing`), and friction
    makes that sqrt(1 + mu^2) longer. No control makes it smaller, since the
    damping force of an inelastic contact is present at the first sample; a lower speed does.

    Attributes:
        force: Largest force with which a wall is hit at the speed of the sweep [N].
        speed: Fastest sweep that keeps the force below the limit [m/s].
        limit: Force limit of the robot [N].
    """

    force: float
    speed: float
    limit: float

    @classmethod
    def of(cls, landing: LandingModel, force: float, speed: float, friction: float, limit: float) -> "WallBound":
        """Return the bound for a set force [N], a speed [m/s], friction and the robot's force limit [N]."""
        per_speed, longer = landing.force_per_speed, math.hypot(1.0, friction)
        return cls(longer * (force + per_speed * speed), max(limit / longer - force, 0.0) / per_speed, limit)

    def __str__(self) -> str:
        """The bound as text for a report."""
        return (
            f"hit with up to {self.force:.3g} N at this speed; up to {1e3 * self.speed:.3g} mm/s it stays below "
            f"the robot's limit of {self.limit:g} N"
        )


class PlanWatch:
    """Source of the path that a view shows of an exploring controller. A `PlanSource`."""

    def __init__(self, controller: ExploreController) -> None:
        """Watch a controller."""
        self._controller = controller
        self._leg: Leg | None = None
        self._marks, self._periods = 0, 0

    def news(self) -> ShownPlan | None:
        """Return the path if it has changed: a fraction of a microsecond where nothing is new."""
        controller, leg = self._controller, self._controller.leg
        self._periods -= 1
        if leg is self._leg and self._periods > 0:
            return None
        self._periods = _LOOK_EVERY
        marks = controller.strategy.marks
        if leg is self._leg and len(marks) == self._marks:
            return None
        self._leg, self._marks = leg, len(marks)
        return _shown_plan(leg, controller.strategy.plane, marks)


def _shown_plan(leg: Leg | None, plane: PathPlane, marks: Sequence[Mark]) -> ShownPlan:
    shown = tuple(ShownMark(mark.event.value, mark.position) for mark in marks)
    name: str = ""
    points: tuple[Point, ...] = ()
    match leg:
        case Hop():
            name, points = "hop", (leg.to,)
        case Stroke():
            name, points = "stroke", leg.corners
        case SingleTouch():
            name, points = "touch", (leg.at,)
        case Circuit():
            name = "circuit"  # its points are known only while it is felt
        case None:
            pass
    return ShownPlan(name, tuple(plane.base(point) for point in points), plane.axis, shown)


@dataclass(frozen=True, eq=False, kw_only=True)
class ExplorationPlan(PressingPlan):
    """An exploration that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        config: Configuration, completed from the robot file.
        scan: Path of the centre of the tip.
        plane: Plane in which coordinates of the tip frame's origin are those of the centre of the tip.
        parameters: Parameters of the controller.
        timing: Durations of paths.
        wall: Bound on the force of hitting a wall during the sweep.
    """

    config: ExploreConfig
    scan: Scan
    plane: PathPlane
    parameters: ExploreParameters
    timing: PathTiming
    wall: WallBound

    @property
    def target(self) -> SceneObject:
        """Surface that is touched; `setup.task.target` may have surroundings."""
        return as_target(self.setup.task.target).shape

    @property
    def half_compliance(self) -> float:
        """Half of the compression of tip and object together per force [m/N]."""
        return 0.5 / self.config.stiffness

    @property
    def tip_uncertainty(self) -> TipUncertainty:
        """Uncertainty of the fingertip from the robot file; without one, a simulated tip is known exactly."""
        stated = self.robot.file.fingers[0].surface_sd
        if stated is not None:
            return stated.uncertainty
        simulated = scene_of(self.ready.backend) is not None
        return EXACT if simulated else TipUncertainty.independent(size=TIP_SIZE_SD)

    @property
    def profile(self) -> ForceProfile | None:
        """Profile of the force while the tip sweeps; None: the live parameter `force`."""
        config = self.config
        return (
            SineForce(config.force, config.force_swing, 1.0 / config.force_period) if config.force_swing else None
        )

    def controller(self) -> ExploreController:
        """Return a fresh controller with a fresh strategy."""
        found, strategy = self.identified, self.scan.strategy(self.plane, self.timing)
        law = None if found is None else found.law(self.period)
        return ExploreController(self.parameters, strategy, self.period, law=law, profile=self.profile)

    def observer(self, controller: ExploreController, truth: TruthSource | None) -> PlanDiary:
        """Return an observer that keeps the path of the controller."""
        return PlanDiary(PlanWatch(controller))

    def shown_plan(self, controller: ExploreController) -> PlanWatch:
        """Return the source of the path that a view shows."""
        return PlanWatch(controller)

    def attachments(self) -> dict[str, str]:
        """Return the result of pressing, and the geometry of an object from a file."""
        return super().attachments() | object_texts(self.setup.task.target, self.config)

    @property
    def virtual_mass(self) -> bool:
        """True: an admittance may be the better law."""
        return True

    def with_identified(self, found: Identified) -> Self:
        """Return the plan with the identified law.

        Raises:
            InvalidValueError: If a requested change of a live parameter is out of its new bounds.
        """
        parameters = replace(self.parameters, gain=found.gain)
        check_changes(self.config.change, live_parameters(parameters))
        timing = replace(self.timing, parameters=parameters)
        return replace(self, parameters=parameters, timing=timing, identified=found)

    def view(self) -> ViewScene:
        """Return scene, map and the surface that the map becomes."""
        config = self.config
        growing = SurfaceView(
            rows=self.scan.row_gap,
            voxel=config.map_spacing,
            half_compliance=self.half_compliance,
            sensed_force=config.force,
            # beside a single line nothing is surrounded by contacts: its ribbon is all there is
            worst=Knowledge.EXTRAPOLATED if self.scan.kind == "contour" else Knowledge.OBSERVED,
        )
        return replace(super().view(), map_spacing=config.map_spacing, surface=growing)


def plan(config: ExploreConfig, robot: Robot, attachments: Mapping[str, str]) -> ExplorationPlan:
    """Check and build everything that an exploration needs.

    Args:
        config: Configuration; the robot file supplies fingertip, noise and period where left out.
        robot: Robot that carries the fingertip.
        attachments: Texts of a log, by file name; empty for a new run, for which the object's file is read.

    Raises:
        InvalidValueError: If the exploration cannot be carried out; the message names the remedy.
    """
    config = on_robot(config, robot)
    planned = plan_on(object_of(config, attachments), config, robot)
    found = attachments.get(IDENTIFIED_TEXT)
    return planned if found is None else planned.with_identified(Identified.read(found))


def plan_on(touched: SceneObject | Target, config: ExploreConfig, robot: Robot) -> ExplorationPlan:
    """Return the plan of an exploration of a given object; the object options of `config` are not read.

    Raises:
        InvalidValueError: If the exploration cannot be carried out.
    """
    target = as_target(touched).shape
    scan = scan_on(target, config)
    # a scan is of the centre of the tip; the robot moves the tip frame, which never turns
    x, y, z = only_finger(robot).surface.center
    plane = PathPlane((-x, -y, -z))
    top, descent = (
        target.top + max(config.tip) + CLEARANCE,
        target.top - target.bottom + max(config.tip) + CLEARANCE,
    )
    task = _task(touched, scan.begin, top, config, robot)
    speed, acceleration = _fastest(config), _acceleration(config, scan)
    limits, room = _limits(robot.file.limits, scan, plane, top, descent, speed, acceleration)
    check_force(config.force, config.greatest_force, limits)
    setup = Setup.build(robot, task, config.stiffness, limits)
    ready, landing = setup.ready, setup.landing
    _check_push(config, ready)
    check_speed("speed", config.speed, limits)
    bend = "go more slowly, or take a larger fingertip" if scan.kind == "contour" else "raise the limit"
    check_acceleration(f"speed = {speed:g} m/s: the acceleration", acceleration, limits, bend)
    fastest = max(speed, limits.commanded_speed - MAX_LANDING_SPEED)
    setup = setup.allowing(f"speed = {speed:g} m/s", speed + MAX_LANDING_SPEED)
    limits = setup.limits
    scene = scene_of(ready.backend)
    if scene is not None:
        _check_sliding(config, scene.pair)
    swings = f" and force_swing = {config.force_swing:g} N: the force" if config.force_swing else ":"
    option = f"force = {config.force:g} N{swings}"
    check_least_force(option, config.least_force, ready.touch_force, "press more, or lower its touch_force_N")
    swing = (config.force, config.force)
    least = MIN_FORCE_PER_TOUCH_FORCE * ready.touch_force
    parameters = ExploreParameters(
        force=config.force,
        speed=config.speed,
        acceleration=acceleration,
        gain=setup.gain,
        lead=setup.lead,
        landing_speed=min(MAX_LANDING_SPEED, landing.speed(config.force, ready.touch_force)),
        approach_distance=descent,
        force_range=swing if config.force_swing else (least, max_set_force(limits)),
        speed_range=(SLOWEST, min(FASTEST, fastest)),
        room=room,
        lift_speed=min(MAX_LIFT_SPEED, limits.commanded_speed),
        travel_speed=min(MAX_LIFT_SPEED, limits.commanded_speed),
    )
    check_changes(config.change, live_parameters(parameters))
    below = float(target.height(*map(np.array, scan.begin)))
    below = target.bottom if math.isnan(below) else below  # beside its rim a tip touches a ball, too
    timing = PathTiming(parameters, max(top - below - config.tip[-1], CLEARANCE), descent)
    wall = WallBound.of(landing, config.force, config.speed, config.friction, limits.force)
    path = _tip_path(scan, target, plane, config.tip[-1])
    unsafe = config.speed > wall.speed and (config.beyond or config.object in FROM_FILE)
    return ExplorationPlan(
        setup=setup,
        config=config,
        title=f"Exploration of {config.thing} by touch",
        quantities=_quantities(config, scan, timing),
        expected_duration=scan.duration(timing),
        longest_duration=scan.longest(timing) + _SPARE_TIME,
        files=FILE_NAMES,
        # the object may not be as described
        notes=(*((f"A wall or step in the path would be {wall}.",) if unsafe else ()), *object_notes(touched)),
        followed=None if ready.arm is None else follow_path(ready.arm, path, config.speed),
        scan=scan,
        plane=plane,
        parameters=parameters,
        timing=timing,
        wall=wall,
    )


def _task(touched: SceneObject | Target, begin: Point, top: float, config: ExploreConfig, robot: Robot) -> Task:
    """Return the task of a tip whose centre begins at a point, at the height `top` [m]."""
    check_compression(config.tip, config.force, config.stiffness)
    x, y, z = only_finger(robot).surface.center
    return Task(
        tip=fingertip(robot, config.tip),
        compression=config.force * (0.5 / config.stiffness),
        target=touched,
        law=replace(
            EXPLORE.law,
            stiffness=config.stiffness,
            friction=config.friction,
            spin_length=config.spin_length,
            smallest_force=config.touch_force,
        ),
        start=(begin[0] - x, begin[1] - y, top - z),
        period=config.period or robot.file.period,
        sensor=sensor_for(robot, config),
        touch_force=config.touch_force,
    )


def _fastest(config: ExploreConfig) -> float:
    """Return the largest requested speed along the surface [m/s]."""
    return max([config.speed, *(value for _, name, value in config.change if name == "speed")])


def _acceleration(config: ExploreConfig, scan: Scan) -> float:
    """Return the bound on tangential acceleration [m/s^2]: a contour may bend round the fingertip."""
    if scan.kind != "contour":
        return ACCELERATION
    return max(ACCELERATION, _CONTOUR_BEND * config.speed**2 / min(config.tip))


def _limits(
    robot: Limits, scan: Scan, plane: PathPlane, top: float, descent: float, speed: float, acceleration: float
) -> tuple[Limits, Room]:
    """Return the robot's limits with as much of its workspace as the path needs, and the controller's room within.

    Args:
        robot: Limits of the robot.
        scan: Path of the tip's centre.
        plane: Plane of the scan.
        top: Height of the tip's centre at the start [m].
        descent: Largest distance down to the surface [m].
        speed: Largest speed along the surface [m/s].
        acceleration: Deceleration from it [m/s^2].

    Raises:
        InvalidValueError: If the path leaves the robot's workspace.
    """
    (x0, y0), (x1, y1) = scan.box
    lower, upper = plane.base((x0, y0), top - descent), plane.base((x1, y1), top)
    remedy = "take a smaller region or object, or a robot with more room"
    check_workspace(robot, lower, upper, remedy, down_to_object=True)
    stopping = 0.5 * speed**2 / acceleration
    # nearer to the robot's own workspace the supervisor stops a tip that moves on
    braking = speed * (robot.sample_age + Stopping().delay)
    workspace_lower, workspace_upper = workspace_around(robot, lower, upper, _ROOM + stopping)
    limits = msgspec.structs.replace(robot, workspace_lower=workspace_lower, workspace_upper=workspace_upper)
    return limits, Room(*workspace_around(robot, lower, upper, 0.5 * _ROOM + stopping, braking))


def _check_push(config: ExploreConfig, ready: RobotInScene) -> None:
    """Refuse a force that the servos do not reach within the limit of their following error."""
    push = ready.stiffness * ready.following_error_limit
    if config.greatest_force > push:
        raise InvalidValueError(
            f"force = {config.force:g} N: the robot pushes with at most {push:.2g} N, its servos' "
            f"{ready.stiffness:.3g} N/m over a following error of {ready.following_error_limit:g} m "
            "(following_error_m, bandwidth_rad_per_s in the robot file); press with less, or allow more of either"
        )


def _check_sliding(config: ExploreConfig, pair: PairParameters) -> None:
    """Refuse speeds at which the simulated friction is not Coulomb's, or the tip lifts off."""
    creep = pair.creep_speed * config.greatest_force / config.touch_force  # grows with the force
    if not creep < config.speed < pair.lift_speed / 2.0:
        raise InvalidValueError(
            f"speed = {config.speed:g} m/s: must lie between {creep:.2g} m/s, below which the simulated friction "
            f"creeps, and {pair.lift_speed / 2.0:.2g} m/s, from which it may lift the tip"
        )


def _tip_path(scan: Scan, target: SceneObject, plane: PathPlane, tip_height: float) -> list[Vector]:
    """Return points of the tip frame's path on the described object, base frame [m].

    Args:
        scan: Path of the tip's centre.
        target: Object; beside it the tip comes down to its bottom.
        plane: Plane of the scan.
        tip_height: Distance from the tip's centre to its lowest point [m].
    """
    corners = scan.corners
    grid = max(_MIN_GRID, sum(math.dist(*ends) for ends in pairwise(corners)) / _MAX_PLACES)
    places = np.array(corners[:1])
    for a, b in pairwise(corners):
        count = max(1, math.ceil(math.dist(a, b) / grid))
        places = np.vstack([places, np.linspace(a, b, count + 1)[1:]])
    heights = target.height(*places.T)
    lowest = np.where(np.isnan(heights), target.bottom, heights) + tip_height
    return [plane.base((x, y), z) for (x, y), z in zip(places.tolist(), lowest.tolist(), strict=True)]


def _quantities(config: ExploreConfig, scan: Scan, timing: PathTiming) -> tuple[Quantity, ...]:
    """Return the quantities of a dry run."""
    (x0, y0), (x1, y1) = ((1e3 * x, 1e3 * y) for x, y in scan.box)
    length_note = "what is felt decides" if math.isnan(scan.length) else "seen from above"
    return (
        Quantity("path", scan.line),
        Quantity("expected duration", scan.duration(timing), "s", "without pressing first"),
        Quantity("longest duration", scan.longest(timing) + _SPARE_TIME, "s", "then it is stopped"),
        Quantity("path length", 1e3 * scan.length, "mm", length_note),
        Quantity("path along x", x1 - x0, "mm", f"from {x0:.4g} to {x1:.4g} mm"),
        Quantity("path along y", y1 - y0, "mm", f"from {y0:.4g} to {y1:.4g} mm"),
        Quantity("force", config.force, "N", "to hold"),
        Quantity("greatest force asked for", config.greatest_force, "N"),
        Quantity("speed", 1e3 * config.speed, "mm/s", "along the surface"),
        Quantity("landing speed", 1e3 * timing.parameters.landing_speed, "mm/s"),
    )
