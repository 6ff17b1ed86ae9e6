"""From a configuration to a rubbing run, checked and built."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import msgspec

from palpate.controllers.rub_program import Survey, SurveyWanted
from palpate.controllers.rubbing import RubbingController
from palpate.controllers.rubbing_parameters import RubbingParameters
from palpate.errors import InvalidValueError
from palpate.experiments.friction.config import EXPONENT_SLIPS, LIBRARY_TEXT, FrictionConfig
from palpate.experiments.friction.library import library_text
from palpate.experiments.friction.strokes import RubRecorder
from palpate.experiments.kit.checks import check_force, check_least_force, check_speed
from palpate.experiments.kit.one_finger import (
    CLEARANCE,
    MAX_LANDING_SPEED,
    MAX_LIFT_SPEED,
    SEARCH_DEPTH,
    OneFingerPlan,
    Setup,
    sensor_model,
    touch_threshold,
)
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.materials.library import MaterialLibrary, read_materials
from palpate.reporting.data import Quantity
from palpate.robots.fingertip import fingertip, start_above
from palpate.robots.known_sensor import described
from palpate.robots.known_truth import scene_of
from palpate.robots.robot import Robot
from palpate.robots.task import Task
from palpate.runtime.truth import TruthSource
from palpate.sensing.ft.filters import WrenchFilter
from palpate.sim import Box, ContactLaw, SceneObject, SeededSensor, SphereObject
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.sensor.description import TOUCH_SIGMAS
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.presets import NANO17_RATED

FILE_NAME = "friction.yaml"
"""Name of the file with the result."""

_SIMULATED_RATIO_SD, _DELIVERED_RATIO_SD = 0.001, 0.01
"""Standard deviations of ratios of loads: that of the finger's own motion with an exact sensor, and that of the
cross-talk that data sheets allow."""

_MAX_TRAVEL = 0.025
"""Largest length of strokes on a large flat object [m]."""

_EDGE_DISTANCE = 0.005
"""Smallest distance of strokes from an edge [m]."""

_MAX_TRAVEL_SHARE = 0.15
"""Longest stroke on a sphere over its radius: 0.3 mu for a mu of 0.5; beyond it the turning normal looks like
elastic deflection."""

_SPIN_SHARE = 0.8
"""Largest angular speed of twists over the supervisor's limit."""

_TURNING_SHARE = 0.8
"""Angular acceleration of twists over that of the robot, which catches up where a period was late."""

_MAX_ANGLE = 1.5
"""Largest turn of the tip in one direction [rad]."""

_IMPEDANCE = 0.05
"""Impedance of MuJoCo's contact: the larger, the more mass rubs along (see `_FRICTION_DAMPING`)."""

_FRICTION_DAMPING = 300.0
"""Largest damping b_f of MuJoCo's friction [1/s]. Friction is along b_f v + a, v the slip and a its acceleration:
with a b_f of 2/s, as a lift-off speed of 1 m/s gives, the tangential force of a twist is arbitrary. 300/s is 0.15
of a step of 0.5 ms."""

_LIFT_SPEEDS = 3.0
"""Lift-off speed of MuJoCo's contact over the speed of the fastest stroke."""

_DRIFT_LEVER = 0.01
"""Drift of a moment over that of a force [m], as the ranges of sensors of this size, 0.12 N m and 12 N."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FrictionPlan(OneFingerPlan):
    """A rubbing run that can be carried out: everything checked and built, nothing moved yet.

    Attributes:
        wanted: Loads, speeds and travels.
        left_out: Requested speeds [m/s] whose strokes would be too long here.
        parameters: Parameters of the controller.
        plant: True friction law; None if MuJoCo simulates friction.
        library_text: Text of a library of materials, for recognition; empty without one.
    """

    config: FrictionConfig
    wanted: SurveyWanted
    left_out: tuple[float, ...]
    parameters: RubbingParameters
    plant: FrictionLaw | None
    library_text: str

    def controller(self) -> RubbingController:
        """Return a fresh controller."""
        return RubbingController(self.parameters, Survey(self.wanted), self.period)

    def observer(self, controller: RubbingController, truth: TruthSource | None) -> RubRecorder:
        """Return an observer that keeps the strokes."""
        return RubRecorder()

    def attachments(self) -> dict[str, str]:
        """Return the library, if there is one."""
        return {LIBRARY_TEXT: self.library_text} if self.library_text else {}

    @property
    def library(self) -> MaterialLibrary | None:
        """Library to recognise the material in; None if none was requested."""
        return read_materials(self.library_text) if self.library_text else None

    @property
    def truth_known(self) -> bool:
        """Whether the contact is simulated."""
        return scene_of(self.ready.backend) is not None

    def true_friction(self, speed: float) -> float | None:
        """Return the simulated mu at a slip speed [m/s]; None on a robot."""
        if not self.truth_known:
            return None
        return self.config.friction if self.plant is None else self.plant.friction_at(speed)

    def true_spin_length(self, load: float) -> float | None:
        """Return the simulated e [m] at a load [N]; None on a robot."""
        if not self.truth_known:
            return None
        return self.config.spin_length if self.plant is None else self.plant.spin_length_at(load)

    @property
    def true_limit_surface(self) -> LimitSurface | None:
        """Limit surface of the simulated contact in slip; None on a robot."""
        if not self.truth_known:
            return None
        if self.plant is None:
            return LimitSurface(self.config.friction, self.config.spin_length)
        return self.plant.limit_surface(self.plant.kinetic_friction)

    @property
    def calibration(self) -> float:
        """Possible error of the sensor's calibration, as in `FrictionConfig.calibration`."""
        if self.config.calibration is not None or not self.truth_known:
            return self.config.usual_calibration
        exact = self.setup.task.sensor.model.cross_talk is None
        return _SIMULATED_RATIO_SD if exact else _DELIVERED_RATIO_SD


def plan(config: FrictionConfig, robot: Robot, attachments: Mapping[str, str]) -> FrictionPlan:
    """Check and build everything that rubbing needs.

    Args:
        config: Configuration.
        robot: Robot that carries the fingertip.
        attachments: Texts of a log, its library among them; empty for a new run.

    Raises:
        InvalidValueError: If the run cannot be carried out; the message names the remedy.
    """
    library = library_text(config, attachments)
    limits, loads = robot.file.limits, config.rubbed_loads
    check_force(loads[-1], loads[-1], limits)
    fastest = max((config.speed, *config.speeds))
    check_speed("speed", fastest, limits)
    setup, plant = _setup(config, robot)
    ready, landing, turns = setup.ready, setup.landing, setup.turns
    if config.fit_exponents and not turns:
        raise InvalidValueError(
            f"robot = {config.robot}: it cannot turn its tip, which --fit-exponents asks for; take turning-stage"
        )
    max_spin = _SPIN_SHARE * limits.angular_speed if turns else 0.0
    wanted, left_out = _survey(config, max_spin, _TURNING_SHARE * ready.angular_acceleration)
    option = f"loads: the least is {loads[0]:g} N and"
    check_least_force(option, loads[0], ready.touch_force, "press more")
    setup = setup.allowing(f"speed = {fastest:g} m/s", fastest + MAX_LANDING_SPEED)
    parameters = RubbingParameters(
        setup.gain,
        setup.lead,
        landing_speed=min(MAX_LANDING_SPEED, landing.speed(loads[0], min(ready.touch_force, 0.5 * loads[0]))),
        approach_distance=CLEARANCE + SEARCH_DEPTH,
        lift_speed=min(MAX_LIFT_SPEED, setup.limits.commanded_speed),
    )
    around = 2.0 * parameters.tare_time + CLEARANCE / parameters.landing_speed + parameters.settle_time + 0.5
    expected = wanted.expected_duration + around
    return FrictionPlan(
        setup=setup,
        config=config,
        title=f"Friction of a {config.object} by touch",
        quantities=_quantities(wanted, expected),
        expected_duration=expected,
        longest_duration=8.0 * expected + 20.0,  # strokes without slip are repeated, up to eight times as far
        files=(FILE_NAME,),
        notes=_notes(config, wanted, left_out),
        wanted=wanted,
        left_out=left_out,
        parameters=parameters,
        plant=plant,
        library_text=library,
    )


def _quantities(wanted: SurveyWanted, expected: float) -> tuple[Quantity, ...]:
    """Return the quantities of a dry run."""
    twist = wanted.most_angle if wanted.most_spin else 0.0
    return (
        Quantity("expected duration", expected, "s"),
        Quantity("loads", len(wanted.loads), "", ", ".join(f"{load:g} N" for load in wanted.loads)),
        Quantity("greatest force asked for", max(wanted.loads), "N"),
        Quantity("speed", 1e3 * wanted.speed, "mm/s", "of strokes at every load"),
        Quantity("fastest stroke", 1e3 * max((wanted.speed, *wanted.speeds)), "mm/s"),
        Quantity("longest stroke", 1e3 * wanted.most_travel, "mm"),
        Quantity("twist, largest", twist, "rad", "in one direction"),
    )


def _notes(config: FrictionConfig, wanted: SurveyWanted, left_out: tuple[float, ...]) -> tuple[str, ...]:
    """Return the notes of a dry run."""
    notes = () if wanted.most_spin else ("This robot does not turn its tip: it finds mu, but not e.",)
    if not left_out:
        return notes
    speeds = ", ".join(f"{1e3 * speed:g}" for speed in left_out)
    return (*notes, f"Strokes at {speeds} mm/s are left out: they would go too far on this {config.object}.")


def _survey(
    config: FrictionConfig, max_spin: float, angular_acceleration: float
) -> tuple[SurveyWanted, tuple[float, ...]]:
    """Return strokes and twists, and the speeds that are left out."""
    room = _room(config)
    most = min(_MAX_TRAVEL, room) if config.most_travel is None else config.most_travel
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
        most_spin=max_spin,
        most_angle=_MAX_ANGLE,
        repeats=config.repeats,
        exponent_slips=EXPONENT_SLIPS if config.fit_exponents else 0,
        angular_acceleration=angular_acceleration,
    )
    speeds = () if config.quick else tuple(sorted(set(config.speeds) - {config.speed}))
    kept = tuple(speed for speed in speeds if bare.stroke(config.loads[0], speed).travel <= most)
    return replace(bare, speeds=kept), tuple(speed for speed in speeds if speed not in kept)


def _room(config: FrictionConfig) -> float:
    """Return the largest length of a stroke from the middle of the object [m]."""
    if config.object == "sphere":
        return _MAX_TRAVEL_SHARE * config.sizes[0]
    room = 0.5 * min(config.sizes[:2]) - _EDGE_DISTANCE
    if room <= 0.0:
        raise InvalidValueError(f"size = {config.sizes[0]:g} m: must be more than {2.0 * _EDGE_DISTANCE:g} m long")
    return room


def _setup(config: FrictionConfig, robot: Robot) -> tuple[Setup, FrictionLaw | None]:
    """Return the robot over the object, and the law of the friction plant; None if MuJoCo simulates friction.

    Raises:
        InvalidValueError: If the fingertip is smaller than its compression, or the simulation is impossible.
    """
    size, tip, loads = config.sizes, fingertip(robot, config.tip), config.rubbed_loads
    shape: SceneObject = SphereObject(size[0]) if config.object == "sphere" else Box((size[0], size[1], size[2]))
    model = _sensor_model(robot, config)
    # the mean: touch takes one size of the tip for all loads
    compression = 0.25 * (loads[0] + loads[-1]) / config.stiffness
    smallest = min(tip.half_extents)
    if smallest <= 2.0 * compression:
        raise InvalidValueError(
            f"tip = {smallest:g} m: must be larger than twice its compression at {loads[-1]:g} N and "
            f"{config.stiffness:g} N/m, {2.0 * compression:.2g} m"
        )
    task = Task(
        tip=tip,
        compression=compression,
        target=shape,
        law=ContactLaw(
            config.stiffness,
            config.friction,
            config.spin_length,
            impedance=_IMPEDANCE,
            smallest_force=loads[0],
        ),
        start=start_above(tip, shape.top, CLEARANCE),
        period=config.period or robot.file.period,
        sensor=SeededSensor(model, config.seed),
        touch_force=touch_threshold(model),
    )
    robot = _touching_above(robot, model, config, task.touch_force)
    setup, plant = Setup.build(robot, task, config.stiffness), _friction_law(config)
    scene = scene_of(setup.ready.backend)
    if scene is None:
        return setup, plant
    if plant is None:
        # the first scene's friction damping gives the mass that moves with the contact
        fastest = max((config.speed, *config.speeds))
        lift = max(_LIFT_SPEEDS * fastest, task.law.lift_speed * scene.pair.friction_damping / _FRICTION_DAMPING)
        task = replace(task, law=replace(task.law, lift_speed=lift))
    else:
        task = replace(task, rubbing=plant)
    return Setup.build(robot, task, config.stiffness), plant


def _friction_law(config: FrictionConfig) -> FrictionLaw | None:
    if not config.on_plant:
        return None
    given = {
        "norm_exponent": config.norm_exponent,
        "load_exponent": config.load_exponent,
        "stribeck_speed": config.stribeck_speed,
        "viscous_friction": config.viscous_friction,
        "stiffness": config.skin_stiffness,
    }
    return FrictionLaw(
        static_friction=config.static_friction or config.friction,
        kinetic_friction=config.friction,
        spin_length=config.spin_length,
        **{name: value for name, value in given.items() if value is not None},
    )


def _sensor_model(robot: Robot, config: FrictionConfig) -> SensorModel:
    """Return the simulated sensor; one that drifts has a range and noise.

    Raises:
        InvalidValueError: If a sensor that drifts has no noise.
    """
    model = sensor_model(robot, config.force_noise, config.moment_noise, config.drift, _DRIFT_LEVER)
    if not config.drift:
        return model
    if model.rated is None:
        # a Nano17's full load, or the supervisor's limits if more
        limits = robot.file.limits
        a, b, c, d, e, f = (
            max(rated, limit)
            for rated, limit in zip(NANO17_RATED, 3 * (limits.force,) + 3 * (limits.moment,), strict=True)
        )
        model = replace(model, rated=(a, b, c, d, e, f))
    if not min(model.noise_sd) > 0.0:
        raise InvalidValueError(
            f"drift = {config.drift:g} N/min: a sensor that drifts has noise, too: constant readings "
            "are taken for a dead sensor; give --force-noise and --moment-noise, as 0.01 and 1e-4"
        )
    return model


def _touching_above(robot: Robot, model: SensorModel, config: FrictionConfig, touch_force: float) -> Robot:
    """Return the robot with a touch threshold for the requested noise and drift, not for its own.

    Args:
        robot: Robot as its file describes it.
        model: Simulated sensor.
        config: Configuration.
        touch_force: Touch threshold on a sensor without a file [N].
    """
    file, least = robot.sensors[0], 0.0
    if file is None:
        file = described(robot.file.fingers[0], model, config.period or robot.file.period)
        # between two rubs the sensor is not tared
        least = touch_force if config.drift else 0.0
    elif config.force_noise is not None:
        gain = WrenchFilter(file.filters, file.sample_rate).held_noise_gain(file.repeats)
        least = TOUCH_SIGMAS * max(model.noise_sd[:3]) * gain
    if file is None or file.contact.touch_force >= least:
        return robot
    contact = msgspec.structs.replace(file.contact, touch_force=least, release_force=0.5 * least)
    return replace(robot, sensors=(msgspec.structs.replace(file, contact=contact), *robot.sensors[1:]))
