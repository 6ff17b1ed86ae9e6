"""What is known before anything is touched: the typed tip, the things, and what measures."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from palpate.experiments.tip_calibration.bench import believed_targets
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.robots.finger_sensor import model_of_finger
from palpate.robots.fingertip import only_finger
from palpate.robots.robot import Robot
from palpate.sensing.tip_calibration import (
    Instrument,
    PlannedTouch,
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
from palpate.surfaces import CompliantTip

HALFWAY = 0.5
"""Share of the indentation that a simulated tip takes: MuJoCo has contacts in the middle of what overlaps."""

ROUNDED = 2.5
"""Exponent to start from, of a superellipsoid that is not typed as one."""

USUAL_ARM, EXACT_ARM = 2e-5, 1e-6
"""[m] How exactly arms repeat: makers of small ones state 20 to 50 um, and at rest in one region they do better; a
simulated arm is where it says, and what is left is the contact's own."""

UNLESS_KNOWN = 0.01 / math.sqrt(3.0)
"""Standard deviation of the entries of a sensor's matrix, of a full load, where 1 % is the limit: makers claim 1
to 2 % for all errors together (`palpate.sensing.ft.calibration`)."""


@dataclass(frozen=True, slots=True, eq=False)
class KnownBefore:
    """What is known before.

    Attributes:
        tip: As the robot file has it.
        targets: Where they are thought to be.
        instrument: What measures.
        turn: How far the tip may be turned [rad]; 0 for a robot that cannot.
        forces: Of each touch [N].
    """

    tip: TypedTip
    targets: tuple[TouchTarget, ...]
    instrument: Instrument
    turn: float
    forces: tuple[float, ...]

    @classmethod
    def of(cls, config: TipCalibrationConfig, robot: Robot, *, turns: bool) -> "KnownBefore":
        """Return it for a robot.

        Raises:
            InvalidValueError: Touches do not calibrate its kind of fingertip.
        """
        tip = typed_tip(config, robot)
        turn = config.most_turn if turns else 0.0
        return cls(tip, believed_targets(config), _instrument(config, robot), turn, config.forces)

    def fit(self, touches: Touches) -> TipFit:
        """Return the tip that explains touches.

        Raises:
            InvalidValueError: There are none, or they are impossible.
        """
        return fit_tip(touches, self.targets, self.tip, self.instrument)

    def telling(self, count: int, fit: TipFit | None) -> list[PlannedTouch]:
        """Return the touches that tell most, after those of a fit if there is one.

        Raises:
            InvalidValueError: None is possible.
        """
        plan = TouchPlan(most_tilt=self.turn, forces=(max(self.forces),))
        if fit is not None:
            plan = replace(plan, wrench_sd=tuple(np.median(fit.touches.wrench_sd, axis=0).tolist()))
        values = None if fit is None else fit.values
        candidates = candidate_touches(self.tip, self.targets, plan, values)
        chosen, _ = planned_touches(candidates, count, self.tip, self.targets, plan, self.instrument, fit)
        return chosen


def typed_tip(config: TipCalibrationConfig, robot: Robot) -> TypedTip:
    """Return the fingertip as the robot file has it, of the family that is asked for."""
    kind = only_finger(robot).surface
    surface = kind.surface()
    stiffness, exponent = config.stiffness, 1.0
    if isinstance(surface, CompliantTip):
        stiffness, exponent = surface.stiffness, surface.exponent
    share = 1.0 if robot.file.backend.REAL else HALFWAY
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
    """A family, begun at the half lengths of a tip."""
    x, y, z = half_extents if len(half_extents) == 3 else tuple(half_extents) * 3
    match name:
        case "sphere":
            return sphere_shape((x + y + z) / 3.0)
        case "ellipsoid":
            return ellipsoid_shape((x, y, z))
        case "capsule":
            return capsule_shape(0.5 * (x + y), 2.0 * z)
        case _:
            return superellipsoid_shape((x, y, z), ROUNDED)


def _instrument(config: TipCalibrationConfig, robot: Robot) -> Instrument:
    sensor, finger = robot.sensors[0], only_finger(robot)
    simulated = None if robot.file.backend.REAL else model_of_finger(finger)
    ranges = None if simulated is None else simulated.rated
    if sensor is not None:
        ranges = (*sensor.force_range, *sensor.moment_range)
    exact = simulated is not None and simulated.cross_talk is None
    usual = 0.0 if exact or ranges is None else UNLESS_KNOWN
    accuracy = usual if config.sensor_accuracy is None else config.sensor_accuracy
    arm = (EXACT_ARM if simulated else USUAL_ARM) if config.arm_sd is None else config.arm_sd
    return Instrument(arm, (1.0,) * 6 if ranges is None else ranges, accuracy)
