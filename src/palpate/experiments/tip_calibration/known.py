"""Prior knowledge of a tip calibration: typed tip, targets and instrument; and the bench that a simulation has."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import mujoco
import numpy as np
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.fingertip import only_finger
from palpate.robots.robot import Robot
from palpate.sensing.tip_calibration import (
    Instrument,
    PlannedTouch,
    TargetKind,
    TipFit,
    TipShape,
    Touches,
    TouchPlan,
    TouchTarget,
    TypedTip,
    candidate_touches,
    fit_tip,
    planned_touches,
    tip_shape,
)
from palpate.sensing.tip_calibration.shapes import (
    capsule_shape,
    ellipsoid_shape,
    sphere_shape,
    superellipsoid_shape,
)
from palpate.sim.objects.fixed_pieces import FixedPieces
from palpate.sim.objects.posed import PosedGeom
from palpate.spatial import Vector, as_vector
from palpate.surfaces import CompliantTip

_PLATE, _ROD, _BALL = "plate", "rod", "ball"

PLATE_HALF = (0.03, 0.03, 0.005)
"""Half lengths of the simulated plate [m]."""

ROD_HALF = 0.025
"""Half the length of the simulated rod [m]."""

SPREAD = {TargetKind.PLANE: 0.015, TargetKind.LINE: 0.006, TargetKind.POINT: 0.0}
"""Largest distance of a touch from a target's place [m]: spread over plate and rod, to find their tilt."""

_UP: Vector = (0.0, 0.0, 1.0)

_MAX_TURN = 0.6
"""Largest tilt of the tip from upright [rad], of a robot that can turn it."""

_TILT_SD = 0.05
"""Standard deviation of directions that were estimated by eye [rad]."""

_MAX_DISPLACEMENT, _MAX_TILT = 1.5e-3, math.radians(2.0)
"""Largest displacement [m] and tilt [rad] of simulated targets."""

_POST_SHARE = 0.7
"""Radius of the simulated posts, over that of rod and ball on them."""

_GROUND = -0.01
"""Height of the ground below the posts [m]."""

_SIMULATED_SHARE = 0.5
"""Share of the indentation of a simulated tip: MuJoCo has contacts in the middle of the overlap."""

_INITIAL_EXPONENT = 2.5
"""Initial exponent of a superellipsoid that was not typed as one."""

_REAL_ARM_SD, _SIMULATED_ARM_SD = 2e-5, 1e-6
"""Repeatability of an arm [m]: makers of small arms state 20 to 50 um, and at rest in one region they do better. A
simulated arm is exact, but for the contact."""

_DELIVERED_ACCURACY = 0.01 / math.sqrt(3.0)
"""Standard deviation of the entries of a sensor's matrix, of a full load, where 1 % is the limit: makers claim 1
to 2 % for all errors together (`palpate.sensing.ft.calibration`)."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownBefore:
    """Prior knowledge before the first touch.

    Attributes:
        tip: Fingertip of the robot file.
        targets: Targets at their expected places.
        instrument: Accuracy of arm and sensor.
        turn: Largest turn of the tip [rad]; 0 for a robot that cannot turn it.
        forces: Forces of each touch [N].
    """

    tip: TypedTip
    targets: tuple[TouchTarget, ...]
    instrument: Instrument
    turn: float
    forces: tuple[float, ...]

    @classmethod
    def of(cls, config: TipCalibrationConfig, robot: Robot, *, turns: bool) -> "KnownBefore":
        """Return the prior knowledge of a robot.

        Raises:
            InvalidValueError: If touches cannot calibrate its kind of fingertip.
        """
        tip = typed_tip(config, robot)
        turn = _MAX_TURN if turns else 0.0
        return cls(tip, believed_targets(config), _instrument(robot), turn, config.forces)

    def fit(self, touches: Touches) -> TipFit:
        """Return the tip that explains touches.

        Raises:
            InvalidValueError: If there are no touches, or they are impossible.
        """
        return fit_tip(touches, self.targets, self.tip, self.instrument)

    def telling(self, count: int, fit: TipFit | None) -> list[PlannedTouch]:
        """Return the most informative touches, after those of a fit if there is one.

        Raises:
            InvalidValueError: If no touch is possible.
        """
        plan = TouchPlan(most_tilt=self.turn, forces=(max(self.forces),))
        if fit is not None:
            plan = replace(plan, wrench_sd=tuple(np.median(fit.touches.wrench_sd, axis=0).tolist()))
        values = None if fit is None else fit.values
        candidates = candidate_touches(self.tip, self.targets, plan, values)
        chosen, _ = planned_touches(candidates, count, self.tip, self.targets, plan, self.instrument, fit)
        return chosen


def typed_tip(config: TipCalibrationConfig, robot: Robot) -> TypedTip:
    """Return the fingertip of the robot file, in the requested family of shapes."""
    kind = only_finger(robot).surface
    surface = kind.surface()
    stiffness, exponent = config.stiffness, 1.0
    if isinstance(surface, CompliantTip):
        stiffness, exponent = surface.stiffness, surface.exponent
    share = 1.0 if robot.file.backend.REAL else _SIMULATED_SHARE
    shape = tip_shape(surface) if config.shape is None else _shape_of(config.shape, kind.half_extents)
    return TypedTip(
        shape,
        np.array(kind.center),
        np.asarray(kind.rotation),
        stiffness=stiffness,
        exponent=exponent,
        share=share,
        exponent_sd=config.exponent_sd,
        mount_turn_sd=config.mount_turn_sd,
        mount_shift_sd=config.mount_shift_sd,
        deviation_degree=config.deviations,
    )


def _shape_of(name: str, half_extents: Sequence[float]) -> TipShape:
    """Return a shape of a family with the half lengths of a tip."""
    x, y, z = half_extents if len(half_extents) == 3 else tuple(half_extents) * 3
    match name:
        case "sphere":
            return sphere_shape((x + y + z) / 3.0)
        case "ellipsoid":
            return ellipsoid_shape((x, y, z))
        case "capsule":
            return capsule_shape(0.5 * (x + y), 2.0 * z)
        case _:
            return superellipsoid_shape((x, y, z), _INITIAL_EXPONENT)


def _instrument(robot: Robot) -> Instrument:
    sensor, finger = robot.sensors[0], only_finger(robot)
    simulated = None if robot.file.backend.REAL else model_of_finger(finger)
    ranges = None if simulated is None else simulated.rated
    if sensor is not None:
        ranges = (*sensor.force_range, *sensor.moment_range)
    exact = simulated is not None and simulated.cross_talk is None
    accuracy = 0.0 if exact or ranges is None else _DELIVERED_ACCURACY
    arm = _SIMULATED_ARM_SD if simulated else _REAL_ARM_SD
    return Instrument(arm, (1.0,) * 6 if ranges is None else ranges, accuracy)


def believed_targets(config: TipCalibrationConfig) -> tuple[TouchTarget, ...]:
    """Return plate, rod and ball at their expected places."""
    sd = config.place_sd
    return (
        TouchTarget(_PLATE, TargetKind.PLANE, config.plate, _UP, place_sd=sd, direction_sd=_TILT_SD),
        TouchTarget(_ROD, TargetKind.LINE, config.rod, config.rod_direction, config.radii[0], sd, _TILT_SD),
        TouchTarget(_BALL, TargetKind.POINT, config.ball, radius=config.radii[1], place_sd=sd),
    )


def true_targets(config: TipCalibrationConfig) -> tuple[TouchTarget, ...]:
    """Return plate, rod and ball at their simulated places."""
    rng = np.random.default_rng(config.scene_error)
    return tuple(_displaced(target, rng) for target in believed_targets(config))


def simulated_bench(config: TipCalibrationConfig) -> FixedPieces:
    """Return the simulated bench: plate, rod and ball, and the posts that carry them.

    Raises:
        InvalidValueError: If a radius is 0: a simulation has no geom for a sharp edge or point.
    """
    if 0.0 in config.radii:
        raise InvalidValueError("radii = 0: a simulated rod or ball is round; give its radius [m], as 0.0005")
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
    moved = np.array(target.place) + rng.uniform(-_MAX_DISPLACEMENT, _MAX_DISPLACEMENT, 3)
    axis = rng.normal(size=3)
    turn = Rotation.from_rotvec(_MAX_TILT * rng.uniform() * axis / np.linalg.norm(axis))
    direction = target.direction if target.kind is TargetKind.POINT else as_vector(turn.apply(target.unit))
    return TouchTarget(target.name, target.kind, as_vector(moved), direction, target.radius)


def _post(top: FloatArray, radius: float) -> PosedGeom:
    """Return a thin post from the ground up to the middle of a target."""
    half = 0.5 * (float(top[2]) - _GROUND)
    if half <= 0.0:
        raise InvalidValueError(f"rod, ball: z = {top[2]:g} m: must be above {_GROUND:g} m in a simulation")
    size = np.array([_POST_SHARE * radius, half, 0.0])
    middle = np.array([top[0], top[1], _GROUND + half])
    return PosedGeom(mujoco.mjtGeom.mjGEOM_CYLINDER, size, middle, np.eye(3))


def _axes_about(z: FloatArray) -> FloatArray:
    """Return a rotation whose third column is z."""
    helper = np.eye(3)[int(np.argmin(np.abs(z)))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])
