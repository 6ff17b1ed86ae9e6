"""What is touched: a plate, a rod and a ball, where they are thought to be, and where a simulation has them."""

import math

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.sensing.tip_calibration import TargetKind, TouchTarget
from palpate.sim.objects.fixed_pieces import FixedPieces
from palpate.sim.objects.posed import PosedGeom
from palpate.spatial import Vector, as_vector

PLATE, ROD, BALL = "plate", "rod", "ball"

PLATE_HALF = (0.03, 0.03, 0.005)
"""Half lengths of the simulated plate [m]."""

ROD_HALF = 0.025
"""Half the length of the simulated rod [m]."""

SPREAD = {TargetKind.PLANE: 0.015, TargetKind.LINE: 0.006, TargetKind.POINT: 0.0}
"""How far from its place a target is touched [m]: on plate and rod touches are spread, to find their tilt."""

UP: Vector = (0.0, 0.0, 1.0)

TILT_SD = 0.05
"""How well directions are known by eye, standard deviation [rad]."""

FARTHEST, STEEPEST = 1.5e-3, math.radians(2.0)
"""By how much simulated things are elsewhere [m], and tilted [rad]."""

POST = 0.7
"""Radius of the simulated posts, over that of what stands on them."""

GROUND = -0.01
"""z of what the posts stand on [m]."""


def believed_targets(config: TipCalibrationConfig) -> tuple[TouchTarget, ...]:
    """Return plate, rod and ball, where they are thought to be."""
    sd = config.place_sd
    return (
        TouchTarget(PLATE, TargetKind.PLANE, config.plate, UP, place_sd=sd, direction_sd=TILT_SD),
        TouchTarget(ROD, TargetKind.LINE, config.rod, config.rod_direction, config.rod_radius, sd, TILT_SD),
        TouchTarget(BALL, TargetKind.POINT, config.ball, radius=config.ball_radius, place_sd=sd),
    )


def true_targets(config: TipCalibrationConfig) -> tuple[TouchTarget, ...]:
    """Return the same where a simulation has them."""
    rng = np.random.default_rng(config.scene_error)
    return tuple(_displaced(target, rng) for target in believed_targets(config))


def simulated_bench(config: TipCalibrationConfig) -> FixedPieces:
    """Return what is simulated: plate, rod and ball, and the posts that carry them.

    Raises:
        InvalidValueError: A sharp edge or point, which a simulation has no geom for.
    """
    for name in ("rod_radius", "ball_radius"):
        if getattr(config, name) == 0.0:
            raise InvalidValueError(f"{name} = 0: a simulated one is round; give its radius [m], as 0.0005")
    plate, rod, ball = true_targets(config)
    axes = _axes_about(plate.unit)
    box = PosedGeom(
        mujoco.mjtGeom.mjGEOM_BOX,
        np.array(PLATE_HALF),
        np.array(plate.place) - PLATE_HALF[2] * plate.unit,
        axes,
    )
    tube = PosedGeom(
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        np.array([rod.radius, ROD_HALF, 0.0]),
        np.array(rod.place),
        _axes_about(rod.unit),
    )
    sphere = PosedGeom(
        mujoco.mjtGeom.mjGEOM_SPHERE, np.array([ball.radius, 0.0, 0.0]), np.array(ball.place), np.eye(3)
    )
    ends = [np.array(rod.place) + sign * ROD_HALF * rod.unit for sign in (-1.0, 1.0)]
    posts = [_post(end, rod.radius) for end in ends]
    return FixedPieces((box, tube, sphere), (_post(np.array(ball.place), ball.radius), *posts))


def _displaced(target: TouchTarget, rng: np.random.Generator) -> TouchTarget:
    moved = np.array(target.place) + rng.uniform(-FARTHEST, FARTHEST, 3)
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(STEEPEST * rng.uniform() * axis / np.linalg.norm(axis))
    direction = target.direction if target.kind is TargetKind.POINT else as_vector(turn.apply(target.unit))
    return TouchTarget(target.name, target.kind, as_vector(moved), direction, target.radius)


def _post(top: FloatArray, radius: float) -> PosedGeom:
    """A thin post from the ground up to the middle of what it carries."""
    half = 0.5 * (float(top[2]) - GROUND)
    if half <= 0.0:
        raise InvalidValueError(f"rod, ball: z = {top[2]:g} m: must be above {GROUND:g} m in a simulation")
    size = np.array([POST * radius, half, 0.0])
    middle = np.array([top[0], top[1], GROUND + half])
    return PosedGeom(mujoco.mjtGeom.mjGEOM_CYLINDER, size, middle, np.eye(3))


def _axes_about(z: FloatArray) -> FloatArray:
    """A rotation whose third column is z."""
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
