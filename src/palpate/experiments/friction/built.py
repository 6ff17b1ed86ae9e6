"""The robot above the surface that is to be rubbed, and how the two rub."""

from dataclasses import replace

import msgspec

from palpate.errors import InvalidValueError
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.kit.contact_checks import LEAST_TOUCH_FORCE, TOUCH_DEVIATIONS
from palpate.experiments.kit.run_checks import CLEARANCE
from palpate.robots.finger_sensor import model_with_noise
from palpate.robots.fingertip import fingertip, start_above
from palpate.robots.in_scene import build
from palpate.robots.known_sensor import described
from palpate.robots.known_truth import scene_of
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
from palpate.sensing.ft.filters import WrenchFilter
from palpate.sim import Box, ContactLaw, SceneObject, SeededSensor, SphereObject
from palpate.sim.friction.law import FrictionLaw
from palpate.sim.sensor.description import TOUCH_SIGMAS
from palpate.sim.sensor.model import SensorModel
from palpate.sim.sensor.presets import NANO17_RATED
from palpate.sim.sensor.temperature import ThermalDrift, WarmUp
from palpate.spatial import Wrench

IMPEDANCE = 0.05
"""Of MuJoCo's contact: the larger it is, the more mass rubs along (see `FASTEST_DAMPING`)."""

FASTEST_DAMPING = 300.0
"""Of MuJoCo's friction [1/s]. That is along b_f v + a, v the slip and a its acceleration: with a b_f of 2/s, as a
lift-off speed of 1 m/s gives, the tangential force of a twist is anything. 300/s is 0.15 of a step of 0.5 ms."""

LIFT_SPEEDS = 3.0
"""Lift-off speed of MuJoCo's contact over the fastest stroke's."""

STEADY = 1e5
"""Time constant of the sensor's drift [s]: over a run it is as good as steady."""

MOMENT_DRIFT = 0.01
"""Drift of a moment over that of a force [m]: as ranges of sensors of this size are, 0.12 N m and 12 N."""


def object_of(config: FrictionConfig) -> SceneObject:
    """Return the surface that is rubbed."""
    size = config.sizes
    return SphereObject(size[0]) if config.object == "sphere" else Box((size[0], size[1], size[2]))


def friction_law(config: FrictionConfig) -> FrictionLaw | None:
    """Return how the friction plant rubs; None: MuJoCo rubs.

    Raises:
        InvalidValueError: A law that cannot be.
    """
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


def sensor_of(robot: Robot, config: FrictionConfig) -> SeededSensor:
    """Return the simulated sensor: the robot file's, with other noise and drift if that is asked for.

    Raises:
        InvalidValueError: It cannot be.
    """
    model = model_with_noise(robot.file.fingers[0], config.force_noise, config.moment_noise)
    if config.drift:
        rate = config.drift / 60.0
        drift = ThermalDrift((0.0, 0.0, rate, MOMENT_DRIFT * rate, 0.0, 0.0), WarmUp(STEADY, STEADY))
        model = replace(model, thermal_drift=drift)
        if model.rated is None:
            model = replace(model, rated=_rated(robot))
        if not min(model.noise_sd) > 0.0:
            raise InvalidValueError(
                f"drift = {config.drift:g} N/min: a sensor that drifts has noise, too: constant readings "
                "are taken for a dead sensor; give --force-noise and --moment-noise, as 0.01 and 1e-4"
            )
    return SeededSensor(model, config.seed)


def _rated(robot: Robot) -> Wrench:
    """Full load of a sensor of which nothing is known: a Nano17's, or the supervisor's limits if more."""
    force, moment = robot.file.limits.force, robot.file.limits.moment
    a, b, c, d, e, f = NANO17_RATED
    return max(a, force), max(b, force), max(c, force), max(d, moment), max(e, moment), max(f, moment)


def _touching_above(robot: Robot, model: SensorModel, config: FrictionConfig, touch_force: float) -> Robot:
    """Return the robot with a touch threshold for the noise and the drift that were typed, not for its own.

    Args:
        robot: As its file describes it.
        model: What is simulated.
        config: What was typed.
        touch_force: That counts as a touch on a sensor of which nothing is known [N].
    """
    file, least = robot.sensors[0], 0.0
    if file is None:
        file = described(robot.file.fingers[0], model, config.period or robot.file.period)
        # nobody tares it between two rubs
        least = touch_force if config.drift else 0.0
    elif config.force_noise is not None:
        gain = WrenchFilter(file.filters, file.sample_rate).held_noise_gain(file.repeats)
        least = TOUCH_SIGMAS * max(model.noise_sd[:3]) * gain
    if file is None or file.contact.touch_force >= least:
        return robot
    contact = msgspec.structs.replace(file.contact, touch_force=least, release_force=0.5 * least)
    return replace(robot, sensors=(msgspec.structs.replace(file, contact=contact), *robot.sensors[1:]))


def built(config: FrictionConfig, robot: Robot) -> RobotInScene:
    """Return the robot above the object.

    Raises:
        InvalidValueError: The fingertip is smaller than its compression, or the simulation cannot be so.
    """
    shape, tip = object_of(config), fingertip(robot, config.tip)
    sensor = sensor_of(robot, config)
    loads = config.rubbed_loads
    # the mean: touch takes one size of the tip for all loads
    compression = 0.25 * (loads[0] + loads[-1]) / config.stiffness
    smallest = min(tip.half_extents)
    if smallest <= 2.0 * compression:
        raise InvalidValueError(
            f"tip = {smallest:g} m: must be larger than twice its compression at {loads[-1]:g} N and "
            f"{config.stiffness:g} N/m, {2.0 * compression:.2g} m"
        )
    noise = 0.0 if sensor.model.noise is None else max(sensor.model.noise.sd[:3])
    task = Task(
        tip=tip,
        compression=compression,
        target=shape,
        law=ContactLaw(
            config.stiffness,
            config.friction,
            config.spin_length,
            impedance=IMPEDANCE,
            smallest_force=loads[0],
        ),
        start=start_above(tip, shape.top, CLEARANCE),
        period=config.period or robot.file.period,
        sensor=sensor,
        touch_force=max(LEAST_TOUCH_FORCE, TOUCH_DEVIATIONS * noise),
    )
    robot = _touching_above(robot, sensor.model, config, task.touch_force)
    ready, plant = build(robot, task), friction_law(config)
    scene = scene_of(ready.backend)
    if scene is None:
        return ready
    if plant is None:
        # what moves with the contact, D_n, the first scene tells by its friction's damping
        fastest = max((config.speed, *config.speeds))
        lift = max(LIFT_SPEEDS * fastest, task.law.lift_speed * scene.pair.friction_damping / FASTEST_DAMPING)
        return build(robot, replace(task, law=replace(task.law, lift_speed=lift)))
    return build(robot, replace(task, rubbing=plant))
