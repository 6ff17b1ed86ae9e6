"""From a configuration to a rubbing run that can be carried out: everything is checked and built here."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from palpate.controllers import force_gain, tracking_delay
from palpate.controllers.rub_program import Survey, SurveyWanted
from palpate.controllers.rubbing import RubbingController
from palpate.controllers.rubbing_parameters import RubbingParameters
from palpate.errors import InvalidValueError
from palpate.experiments.friction.built import built, friction_law, sensor_of
from palpate.experiments.friction.config import EXPONENT_SLIPS, LIBRARY_TEXT, FrictionConfig
from palpate.experiments.friction.recognition import library_text
from palpate.experiments.friction.strokes import RubRecorder
from palpate.experiments.kit import DryRun
from palpate.experiments.kit.allowed_speed import limits_allowing
from palpate.experiments.kit.contact_checks import LEAST_FORCE
from palpate.experiments.kit.limit_quantities import limit_quantities
from palpate.experiments.kit.one_finger import ReadyPlan
from palpate.experiments.kit.run_checks import CLEARANCE, check_force, check_speed
from palpate.experiments.kit.scene_view import scene_view
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.materials.library import MaterialLibrary, read_materials
from palpate.reporting.data import Quantity
from palpate.robots.known_truth import known_scene, scene_of
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene
from palpate.runtime import Backend, Limits
from palpate.runtime.truth import TruthSource
from palpate.sim.friction.law import FrictionLaw
from palpate.viewing import ViewScene

FILE_NAME = "friction.yaml"
"""Of what was found, in the output folder."""

MILLI = 1e3

SIMULATED, AS_DELIVERED = 0.001, 0.01
"""Standard deviations of ratios of loads: what the finger's own motion leaves where the sensor is exact, and with
the cross-talk that data sheets allow."""

FASTEST_LANDING, LIFT_SPEED = 0.005, 0.02
"""At most [m/s]."""

BEYOND = 0.005
"""How far below where the surface may be it is looked for [m]."""

MAX_TRAVEL = 0.025
"""How far strokes may go on what is large and flat [m]."""

FROM_EDGE = 0.005
"""How far from an edge they end at least [m]."""

BENT = 0.15
"""Longest stroke on a sphere, over its radius: 0.3 mu, beyond which the turning normal looks like elastic
deflection, for a mu of 0.5."""

SPIN_SHARE = 0.8
"""Of the supervisor's limit on turning."""

TURNING_SHARE = 0.8
"""Of the acceleration with which the robot can turn: it catches up where a period was late."""

TURNS = 1.5
"""How far the tip may turn in one direction [rad]."""


@dataclass(frozen=True, slots=True, eq=False)
class FrictionPlan(ReadyPlan):
    """A rubbing run that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        config: What was asked for.
        robot: What carries it out.
        wanted: Loads, speeds and travels.
        left_out: Speeds that were asked for, but whose strokes would be too long here [m/s].
        parameters: For the controller.
        plant: The true friction law; None if it is MuJoCo's.
        library_text: Of a library of materials, for recognition; empty if none was asked for.
        limits: For the supervisor.
        ready: The robot as built, with what is known of it.
        expected_duration: About how long it takes [s].
    """

    config: FrictionConfig
    robot: Robot
    wanted: SurveyWanted
    left_out: tuple[float, ...]
    parameters: RubbingParameters
    plant: FrictionLaw | None
    library_text: str
    limits: Limits
    ready: RobotInScene
    expected_duration: float

    @property
    def longest_duration(self) -> float:
        """After which it is stopped [s]: what does not slip is rubbed again, up to eight times as far."""
        return 8.0 * self.expected_duration + 20.0

    def backend(self) -> Backend:
        """Return the robot."""
        return built(self.config, self.robot).backend

    def controller(self) -> RubbingController:
        """Return a fresh controller for it."""
        return RubbingController(self.parameters, Survey(self.wanted), self.ready.backend.period)

    def observer(self, controller: RubbingController, truth: TruthSource | None) -> RubRecorder:
        """Return what keeps the strokes."""
        return RubRecorder()

    def texts(self) -> dict[str, str]:
        """Return the library, if there is one."""
        return {LIBRARY_TEXT: self.library_text} if self.library_text else {}

    @property
    def library(self) -> MaterialLibrary | None:
        """Library to recognise the material in; None if none was asked for."""
        return read_materials(self.library_text) if self.library_text else None

    def dry_run(self) -> DryRun:
        """Return what it would do."""
        wanted = self.wanted
        notes = [] if wanted.most_spin else ["This robot does not turn its tip: it finds mu, but not e."]
        if self.left_out:
            speeds = ", ".join(f"{MILLI * speed:g}" for speed in self.left_out)
            notes.append(f"Strokes at {speeds} mm/s are left out: they would go too far on this object.")
        return DryRun(
            f"Friction of a {self.config.object} by touch",
            (
                Quantity("expected duration", self.expected_duration, "s"),
                Quantity("loads", len(wanted.loads), "", ", ".join(f"{load:g} N" for load in wanted.loads)),
                Quantity("greatest force asked for", max(wanted.loads), "N"),
                Quantity("speed", MILLI * wanted.speed, "mm/s", "of strokes at every load"),
                Quantity("fastest stroke", MILLI * max((wanted.speed, *wanted.speeds)), "mm/s"),
                Quantity("longest stroke", MILLI * wanted.most_travel, "mm"),
                Quantity(
                    "twist, largest", wanted.most_angle if wanted.most_spin else 0.0, "rad", "in one direction"
                ),
                *limit_quantities(self.limits, self.ready.landing_model(self.config.stiffness)),
            ),
            (FILE_NAME,),
            tuple(notes),
        )

    def view(self) -> ViewScene:
        """See `Plan`."""
        title = f"Friction of a {self.config.object}, {self.config.robot}"
        return scene_view(title, known_scene(self.ready.backend).model)

    @property
    def truth_known(self) -> bool:
        """Whether it is simulated."""
        return scene_of(self.ready.backend) is not None

    def true_friction(self, speed: float) -> float | None:
        """Return the mu that is simulated, at a slip speed [m/s]; None on a robot."""
        if not self.truth_known:
            return None
        return self.config.friction if self.plant is None else self.plant.friction_at(speed)

    def true_spin_length(self, load: float) -> float | None:
        """Return the e that is simulated [m], at a load [N]; None on a robot."""
        if not self.truth_known:
            return None
        return self.config.spin_length if self.plant is None else self.plant.spin_length_at(load)

    @property
    def calibration(self) -> float:
        """What the sensor's calibration may be off by, as `FrictionConfig.calibration` has it."""
        if self.config.calibration is not None or not self.truth_known:
            return self.config.usual_calibration
        exact = sensor_of(self.robot, self.config).model.cross_talk is None
        return SIMULATED if exact else AS_DELIVERED

    @property
    def true_limit_surface(self) -> LimitSurface | None:
        """What the simulated contact bears in slip; None on a robot."""
        if not self.truth_known:
            return None
        if self.plant is None:
            return LimitSurface(self.config.friction, self.config.spin_length)
        return self.plant.limit_surface(self.plant.kinetic_friction)


def plan(config: FrictionConfig, robot: Robot, texts: Mapping[str, str]) -> FrictionPlan:
    """Check and build everything that rubbing needs.

    Args:
        config: What to do.
        robot: What carries it out.
        texts: Of the log of an earlier run, its library among them; empty for a new run.

    Raises:
        InvalidValueError: The configuration cannot be carried out; the message names the remedy.
    """
    library = library_text(config, texts)
    limits, loads = robot.file.limits, config.rubbed_loads
    check_force(loads[-1], loads[-1], limits)
    fastest = max((config.speed, *config.speeds))
    check_speed("speed", fastest, limits)
    ready = built(config, robot)
    turns = robot.file.backend.TURNS and (ready.arm is None or ready.arm.turns)
    if config.fit_exponents and not turns:
        raise InvalidValueError(
            f"robot = {config.robot}: it cannot turn its tip, which --fit-exponents asks for; take turning-stage"
        )
    most_spin = SPIN_SHARE * limits.angular_speed if turns else 0.0
    wanted, left_out = _survey(config, most_spin, TURNING_SHARE * ready.angular_acceleration)
    least = LEAST_FORCE * ready.touch_force
    if loads[0] < least * (1.0 - 1e-12):
        raise InvalidValueError(
            f"loads: the least is {loads[0]:g} N and must be at least {least:g} N, {LEAST_FORCE:g} times what "
            "counts as a touch; press more"
        )
    sensing_delay, period = ready.finger.pipeline().delay, ready.backend.period
    landing = ready.landing_model(config.stiffness)
    limits = limits_allowing(limits, f"speed = {fastest:g} m/s", fastest + FASTEST_LANDING, landing)
    parameters = RubbingParameters(
        force_gain(landing.stiffness, landing.delay),
        tracking_delay(period, ready.lag, sensing_delay),
        landing_speed=min(FASTEST_LANDING, landing.speed(loads[0], min(ready.touch_force, 0.5 * loads[0]))),
        approach_distance=CLEARANCE + BEYOND,
        lift_speed=min(LIFT_SPEED, limits.commanded_speed),
    )
    around = 2.0 * parameters.tare_time + CLEARANCE / parameters.landing_speed + parameters.settle_time + 0.5
    return FrictionPlan(
        config,
        robot,
        wanted,
        left_out,
        parameters,
        friction_law(config),
        library,
        limits,
        ready,
        wanted.expected_duration + around,
    )


def _survey(
    config: FrictionConfig, most_spin: float, angular_acceleration: float
) -> tuple[SurveyWanted, tuple[float, ...]]:
    """What to rub, and which speeds are left out."""
    room = _room(config)
    most = min(MAX_TRAVEL, room) if config.most_travel is None else config.most_travel
    if most > room * (1.0 + 1e-9):
        raise InvalidValueError(
            f"most_travel = {most:g} m: must be at most {room:.3g} m on this {config.object}: farther, its edge "
            "or its bend would be felt as friction"
        )
    if config.travel > most:
        raise InvalidValueError(
            f"travel = {config.travel:g} m: must be at most {most:.3g} m, the farthest on this {config.object} "
            "(--most-travel)"
        )
    bare = SurveyWanted(
        config.rubbed_loads,
        config.speed,
        travel=config.travel,
        most_travel=most,
        most_spin=most_spin,
        most_angle=TURNS,
        repeats=config.repeats,
        exponent_slips=EXPONENT_SLIPS if config.fit_exponents else 0,
        angular_acceleration=angular_acceleration,
    )
    speeds = () if config.quick else tuple(sorted(set(config.speeds) - {config.speed}))
    kept = tuple(speed for speed in speeds if bare.stroke(config.loads[0], speed).travel <= most)
    return replace(bare, speeds=kept), tuple(speed for speed in speeds if speed not in kept)


def _room(config: FrictionConfig) -> float:
    """How far a stroke from the middle of the object may go [m]."""
    if config.object == "sphere":
        return BENT * config.sizes[0]
    room = 0.5 * min(config.sizes[:2]) - FROM_EDGE
    if room <= 0.0:
        raise InvalidValueError(f"size = {config.sizes[0]:g} m: must be more than {2.0 * FROM_EDGE:g} m long")
    return room
