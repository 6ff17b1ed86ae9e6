"""The object of a force regulation, and the model of its contact that force control is designed for."""

import math
from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np

from palpate.controllers.damped_contact import DampedContact, SpringMounting
from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import check_compression
from palpate.experiments.kit.one_finger import CLEARANCE, Setup, sensor_model, touch_threshold
from palpate.experiments.kit.scene import SCENE_TEXT, attached_scene
from palpate.experiments.regulate.config import MOUNT_DAMPING_RATIO, RegulateConfig
from palpate.robots.fingertip import fingertip, start_above
from palpate.robots.known_truth import scene_of
from palpate.robots.robot import Robot
from palpate.robots.task import RobotInScene, Task
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
from palpate.sim.presets import EXPLORE
from palpate.sim.scene import OBJECT_GEOM
from palpate.spatial import Vector

_PLATE_SIZE = (0.2, 0.2, 0.04)
"""Length, width and height of the plate [m]."""

_SPHERE_RADIUS = 0.04
"""Radius of the sphere [m]."""

_UP: Vector = (0.0, 0.0, 1.0)

_MISSING_HEIGHT = -0.5
"""Height of a missing object [m], out of reach of the approach."""

_MIN_LEVER = 1e-4
"""Smallest lever of a hinge [m], or vertical part of a slide, with which pressing moves a joint."""

_MIN_DAMPING = 1e-6
"""Smallest damping of a mount [N s/m]."""


def target_of(config: RegulateConfig, attachments: Mapping[str, str], *, at_rest: bool = False) -> Target:
    """Return the object with its motion.

    Args:
        config: Configuration.
        attachments: Texts of a log, by file name; empty to read the file of a scene.
        at_rest: Whether the object stands still where it is first met, for pressing; a scene moves all the same.

    Raises:
        InvalidValueError: If the scene cannot be read, or has no such object.
    """
    if config.object == "scene":
        assert config.file is not None  # RegulateConfig has made sure
        kept = SCENE_TEXT in attachments
        scene = attached_scene(attachments, SceneFile) if kept else SceneFile.read(config.file)
        return SceneTarget.of(scene, config.touch)
    shape: SceneObject = Box(_PLATE_SIZE) if config.object == "plate" else SphereObject(_SPHERE_RADIUS)
    if config.surface in ("still", "soft") or (at_rest and config.surface in ("sine", "leaving")):
        return StaticObject(shape)
    match config.surface:
        case "yielding":
            critical = 2.0 * math.sqrt(config.mount_stiffness * config.mount_mass)
            damping = MOUNT_DAMPING_RATIO * critical
            return SprungTarget(shape, config.mount_stiffness, damping, config.mount_mass)
        case "sine":
            amplitude = config.surface_amplitude
            frequency = config.surface_speed / (2.0 * math.pi * amplitude)
            # its highest point is where a still one would be; there it begins
            course = Sine(amplitude, frequency, math.pi / 2.0)
            return MovingTarget(shape, [DrivenJoint(JointKind.SLIDE, _UP, course)], (0.0, 0.0, -amplitude))
        case "leaving":
            away = Ramp(-config.surface_speed, config.leave_time)
            return MovingTarget(shape, [DrivenJoint(JointKind.SLIDE, _UP, away)])
    return ObjectBody(
        shape,
        position=(0.0, 0.0, _MISSING_HEIGHT),
        friction=config.friction,
        spin_length=config.spin_length,
        mount=Mount.FIXED,
    )


def setup_of(config: RegulateConfig, robot: Robot, target: Target) -> Setup:
    """Return the robot over the object.

    Raises:
        InvalidValueError: If the fingertip is smaller than its compression, or a real surface is to move.
    """
    if robot.file.backend.REAL and config.surface != "still":
        raise InvalidValueError(
            f"surface = {config.surface}: is for simulated objects; a real one does as it likes: leave it still"
        )
    tip, stiffness = fingertip(robot, config.tip), config.true_stiffness
    model = sensor_model(robot, config.force_noise, config.moment_noise, config.drift)
    check_compression(tip.half_extents, config.force, stiffness)
    task = Task(
        tip=tip,
        compression=0.5 * config.force / stiffness,
        target=target,
        law=replace(EXPLORE.law, stiffness=stiffness, friction=config.friction, spin_length=config.spin_length),
        start=start_above(tip, target.shape.top, CLEARANCE),
        period=config.period or robot.file.period,
        sensor=SeededSensor(model, config.seed),
        touch_force=touch_threshold(model),
    )
    return Setup.build(robot, task, stiffness)


def depth_of(target: Target) -> float:
    """Return the depth below its highest point at which an object is met above or below the origin [m].

    Raises:
        InvalidValueError: If no part of the object lies there.
    """
    met = float(target.shape.height(np.zeros(()), np.zeros(())))
    if math.isnan(met):
        raise InvalidValueError(
            "touch: nothing of it lies under its middle, where it is pressed; name another geom"
        )
    return target.shape.top - met


def contact_model(config: RegulateConfig, ready: RobotInScene, target: Target) -> DampedContact:
    """Return the model of contact, mount and servo that force control is designed for.

    The model is the simulated contact (on a robot, one of the given stiffness), or an assumed one instead: an
    assumed stiffness scales contact and mount alike, with their damping ratios kept.
    """
    scene, servo = scene_of(ready.backend), ready.stiffness
    if scene is None:  # the truth is unknown: the given values, with no damping by default
        return DampedContact(config.assumed_stiffness or config.true_stiffness, 0.0, servo)
    pair = scene.pair
    mounting = _joint_mounting(scene)
    if isinstance(target, SprungTarget):
        mounting = SpringMounting(target.stiffness, target.damping, target.mass)
    # the pair's direct format: -(1 - d) A times stiffness and damping
    true = DampedContact(config.true_stiffness, pair.solref[1] / pair.solref[0], servo, mounting)
    if config.assumed_stiffness is None:
        return true
    times = config.assumed_stiffness / true.surface_stiffness
    if mounting is not None:
        mounting = SpringMounting(times * mounting.stiffness, math.sqrt(times) * mounting.damping, mounting.mass)
    return DampedContact(times * true.stiffness, true.damping_time / math.sqrt(times), servo, mounting)


def _joint_mounting(scene: Scene) -> SpringMounting | None:
    """Return the mount that one joint with a spring forms under vertical pressing at the origin.

    A joint of stiffness k, damping d and inertia m raises the pressed point by J per unit of its motion. Its mount
    has k / J^2, d / J^2 and m / J^2.

    Returns:
        None for an object that stands still, or moves by several joints or one without a spring: then the gain is
        made for the contact alone, which is the stiffer and so the safer.
    """
    if scene.target.mount is not Mount.JOINTED:
        return None
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    height = float(scene.target.shape.height(np.zeros(()), np.zeros(())))
    moved = np.zeros((3, model.nv))
    mujoco.mj_jac(model, data, moved, None, np.array([0.0, 0.0, height]), int(model.geom(OBJECT_GEOM).bodyid[0]))
    dofs = np.flatnonzero(np.abs(moved[2]) > _MIN_LEVER)
    if len(dofs) != 1:
        return None
    dof, squared = int(dofs[0]), float(moved[2, dofs[0]]) ** 2
    stiffness = float(np.ravel(model.jnt_stiffness[int(model.dof_jntid[dof])])[0])
    if stiffness <= 0.0:
        return None
    damping = max(float(np.ravel(model.dof_damping[dof])[0]) / squared, _MIN_DAMPING)
    return SpringMounting(stiffness / squared, damping, float(model.dof_M0[dof]) / squared)
