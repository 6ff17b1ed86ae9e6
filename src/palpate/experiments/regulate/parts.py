"""The parts of a regulation from its configuration: profile, motion, surface, sensor."""

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import numpy as np

from palpate.bounded_file import read_text
from palpate.controllers.damped_contact import DampedContact, SpringMounting
from palpate.controllers.force_profile import ConstantForce, ForceProfile, RampForce
from palpate.controllers.force_program import StepForce, Tones
from palpate.controllers.tangent_motion import (
    CircleMotion,
    PathTable,
    SineMotion,
    Still,
    TangentMotion,
    VelocityTable,
)
from palpate.csv_table import BOUNDS
from palpate.errors import InvalidValueError
from palpate.experiments.kit.scene_texts import SCENE_TEXT, scene_in
from palpate.experiments.regulate.config import MOTION_TEXT, RegulateConfig
from palpate.experiments.regulate.joint_mounting import joint_mounting
from palpate.experiments.regulate.motion import read_motion
from palpate.robots.finger_sensor import model_with_noise
from palpate.robots.known_truth import scene_of
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene
from palpate.sim import (
    Box,
    DrivenJoint,
    JointKind,
    Mount,
    MovingTarget,
    ObjectBody,
    Ramp,
    Scene,
    SceneFile,
    SceneObject,
    SceneTarget,
    SeededSensor,
    Sine,
    SphereObject,
    SprungTarget,
    StaticObject,
    Target,
)
from palpate.sim.sensor.temperature import ThermalDrift, WarmUp
from palpate.spatial import Vector

PLATE = (0.2, 0.2, 0.04)
"""Of the plate [m]."""

RADIUS = 0.04
"""Of the sphere [m]."""

UP: Vector = (0.0, 0.0, 1.0)

AWAY = -0.5
"""Height of an object that is missing [m]: nothing that is looked for gets there."""

NOTHING_KEPT: Mapping[str, str] = MappingProxyType({})
"""Of a new run."""

STEADY = 1e5
"""Time constant of the sensor's drift [s]: over a run it is as good as steady."""


def profile_of(config: RegulateConfig) -> ForceProfile:
    """Return the force over time."""
    match config.profile:
        case "constant":
            return ConstantForce(config.force)
        case "step":
            return StepForce(config.force, config.greatest, config.hold)
        case "ramp":
            return RampForce(config.force, config.greatest, config.rate, begin=0.5)
        case "sine":
            return Tones(config.force, config.swung, config.frequencies)


def duration_of(config: RegulateConfig, profile: ForceProfile) -> float:
    """Return how long the profile is held [s]."""
    return profile.duration if isinstance(profile, Tones) else config.duration


def motion_of(config: RegulateConfig, kept: str | None = None) -> TangentMotion:
    """Return how something else moves the tip.

    Args:
        config: What was asked for.
        kept: Text of the motion's file as a log keeps it; the file is read if left out.

    Raises:
        InvalidValueError: The file cannot be read, or is no such file.
    """
    frequency = config.motion_speed / (2.0 * math.pi * config.motion_size)
    match config.motion:
        case "still":
            return Still()
        case "sine":
            return SineMotion(config.motion_size, frequency)
        case "circle":
            return CircleMotion(config.motion_size, frequency)
        case "path" | "table":
            assert config.motion_file is not None  # RegulateConfig has made sure
            name = MOTION_TEXT if kept is not None else str(config.motion_file)
            text = _text(config.motion_file) if kept is None else kept
            if config.motion == "path":
                return read_motion(PathTable, text, name)
            return read_motion(VelocityTable, text, name)


def _text(path: Path) -> str:
    try:
        return read_text(path, BOUNDS, "a motion is CSV text")
    except OSError as error:
        raise InvalidValueError(f"motion_file = {path}: cannot be read: {error.strerror}") from None


def shape_of(config: RegulateConfig) -> SceneObject:
    """Return the surface that is pressed on."""
    return Box(PLATE) if config.object == "plate" else SphereObject(RADIUS)


def target_of(config: RegulateConfig, texts: Mapping[str, str] = NOTHING_KEPT, *, at_rest: bool = False) -> Target:
    """Return the object, and what it does.

    Args:
        config: What was asked for.
        texts: What a log has kept, by file name; empty to read the file of a scene.
        at_rest: Whether it stands still where it is first met, to be identified; a scene does what it does.

    Raises:
        InvalidValueError: The scene cannot be read, or has nothing there to press on.
    """
    if config.object == "scene":
        assert config.file is not None  # RegulateConfig has made sure
        scene = scene_in(texts, SceneFile) if SCENE_TEXT in texts else SceneFile.read(config.file)
        return SceneTarget.of(scene, config.touch)
    shape = shape_of(config)
    if config.surface in ("still", "soft") or (at_rest and config.surface in ("sine", "leaving")):
        return StaticObject(shape)
    match config.surface:
        case "yielding":
            return sprung(config, shape)
        case "sine":
            amplitude = config.surface_amplitude
            frequency = config.surface_speed / (2.0 * math.pi * amplitude)
            # its highest point is where a still one would be; there it begins
            course = Sine(amplitude, frequency, math.pi / 2.0)
            return MovingTarget(shape, [DrivenJoint(JointKind.SLIDE, UP, course)], (0.0, 0.0, -amplitude))
        case "leaving":
            away = Ramp(-config.surface_speed, config.leave_time)
            return MovingTarget(shape, [DrivenJoint(JointKind.SLIDE, UP, away)])
    return ObjectBody(
        shape,
        position=(0.0, 0.0, AWAY),
        friction=config.friction,
        spin_length=config.spin_length,
        mount=Mount.FIXED,
    )


def sprung(config: RegulateConfig, shape: SceneObject) -> SprungTarget:
    """Return the shape on its mount."""
    critical = 2.0 * math.sqrt(config.mount_stiffness * config.mount_mass)
    return SprungTarget(shape, config.mount_stiffness, config.mount_damping_ratio * critical, config.mount_mass)


def depth_of(target: Target) -> float:
    """Return how far below its highest point an object is met [m], which is above or below the origin.

    Raises:
        InvalidValueError: There is nothing of it.
    """
    met = float(target.shape.height(np.zeros(()), np.zeros(())))
    if math.isnan(met):
        raise InvalidValueError(
            "touch: nothing of it lies under its middle, where it is pressed; name another geom"
        )
    return target.shape.top - met


def contact_model(config: RegulateConfig, ready: RobotInScene) -> DampedContact:
    """Return the model of contact, mount and servo that force control is designed for.

    That is what is simulated (on a robot: what is taken for its stiffness), or what is assumed instead: an
    assumed stiffness scales contact and mount alike, with their damping ratios kept.
    """
    scene, servo = scene_of(ready.backend), ready.stiffness
    if scene is None:  # the truth is unknown: the given values, with no damping by default
        return DampedContact(
            config.assumed_stiffness or config.true_stiffness, config.assumed_damping_time or 0.0, servo
        )
    pair = scene.pair
    # the pair's direct format: -(1 - d) A times stiffness and damping
    true = DampedContact(config.true_stiffness, pair.solref[1] / pair.solref[0], servo, _mounting(config, scene))
    if config.assumed_stiffness is None and config.assumed_damping_time is None:
        return true
    times = (config.assumed_stiffness or true.surface_stiffness) / true.surface_stiffness
    damping, mounting = config.assumed_damping_time, true.mounting
    if damping is None:
        damping = true.damping_time / math.sqrt(times)
    if mounting is not None:
        mounting = SpringMounting(times * mounting.stiffness, math.sqrt(times) * mounting.damping, mounting.mass)
    return DampedContact(times * true.stiffness, damping, servo, mounting)


def _mounting(config: RegulateConfig, scene: Scene) -> SpringMounting | None:
    if config.object == "scene":
        return joint_mounting(scene)
    if config.surface != "yielding":
        return None
    target = sprung(config, shape_of(config))
    return SpringMounting(target.stiffness, target.damping, target.mass)


def travel_of(config: RegulateConfig) -> float:
    """Return how far below a still surface's place the surface may be when it is first met [m]."""
    return 2.0 * config.surface_amplitude if config.surface == "sine" else 0.0


def sensor_of(robot: Robot, config: RegulateConfig) -> SeededSensor:
    """Return the simulated sensor: the robot file's, with other noise and drift if that is asked for.

    Raises:
        InvalidValueError: It cannot be.
    """
    model = model_with_noise(robot.file.fingers[0], config.force_noise, config.moment_noise)
    if config.drift:
        per_second = config.drift / 60.0
        model = replace(
            model,
            thermal_drift=ThermalDrift((0.0, 0.0, per_second, 0.0, 0.0, 0.0), WarmUp(STEADY, STEADY)),
        )
    return SeededSensor(model, config.seed)
