"""What really happened in a grasp, kept beside what was sensed, one row per period."""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
import numpy.typing as npt

from palpate.controllers.grip.grasp import GraspController, GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.clearance import clearance
from palpate.experiments.grasp.config import GraspConfig
from palpate.kinematics.pose import Pose
from palpate.robots.hand_description import HandDescription
from palpate.runtime import Command, Observation, Sample
from palpate.runtime.truth import TruthSource
from palpate.sim.hand.truth import FingerTruth, HandTruth
from palpate.sim.hand.truth_numbers import moment_of_numbers
from palpate.spatial import Vector, add_scaled, dot, norm, rotate, rotate_back, subtract, unit

STAGES = tuple(GraspStage)

ALL = 16
"""Columns of all fingers together: time, stage, target, height; pull; clearance, regrips; orientation."""

PER_FINGER = 21
"""Columns: touching; contact and normal, base frame, from the object's origin; normal force, length of the
tangential force, spin torque; slip and spin since the pull began, and since the lift did; commanded grip; middle
of the fingertip, as the contact, and the force on it."""


@dataclass(frozen=True, slots=True, eq=False)
class GraspTruth:
    """What really happened, one row per period (n) and finger (k).

    Slip and spin are of the object over each fingertip since `watched`: how far the point that was under the
    finger then has moved over it across the normal, and how far the object has turned about the normal, what is
    elastic included. Where the friction plant rubs, whose bristles bend, it is the integral of the contacts' slip
    and spin speeds.

    Attributes:
        time: Shape (n,) [s].
        stage: Index in `STAGES`, shape (n,).
        touching: Shape (n, k).
        contact: From the object's origin, base frame, shape (n, k, 3) [m].
        normal: Into the object, base frame, shape (n, k, 3).
        loads: Normal force [N], length of the tangential force [N], spin torque [N m], shape (n, k, 3).
        slip: Shape (n, k) [m].
        spin: Shape (n, k) [rad].
        command: Grip that was commanded, shape (n, k) [N]; NaN where nothing was.
        target: Grip that was wanted, without correction, shape (n,) [N].
        pull: On the object besides fingers and weight, about its origin, shape (n, 6) [N, N m].
        height: Of the object's origin, shape (n,) [m].
        clearance: From the table to the lowest point of the object, shape (n,) [m]; 0 or less: it touches.
        slid: As slip, but since the lift began, shape (n, k) [m].
        turned: As spin, but since the lift began, shape (n, k) [rad].
        regrips: How often the grip had been raised for an alarm by then, shape (n,).
        quat_wxyz: The object's orientation, object to base, shape (n, 4).
        tip: Middle of each fingertip, as `contact`, shape (n, k, 3) [m].
        force: What the object exerts on each, base frame, shape (n, k, 3) [N].
    """

    time: FloatArray
    stage: npt.NDArray[np.intp]
    touching: npt.NDArray[np.bool_]
    contact: FloatArray
    normal: FloatArray
    loads: FloatArray
    slip: FloatArray
    spin: FloatArray
    command: FloatArray
    target: FloatArray
    pull: FloatArray
    height: FloatArray
    clearance: FloatArray
    slid: FloatArray
    turned: FloatArray
    regrips: npt.NDArray[np.intp]
    quat_wxyz: FloatArray
    tip: FloatArray
    force: FloatArray

    def __len__(self) -> int:
        """Number of periods."""
        return len(self.time)

    @property
    def phase(self) -> npt.NDArray[np.str_]:
        """Name of the stage, shape (n,)."""
        return np.array(STAGES, dtype=np.str_)[self.stage]

    @property
    def fingers(self) -> int:
        """How many there are."""
        return int(self.touching.shape[1])


class GraspTruthRecorder:
    """An observer that asks for the truth at every sample: of a back end, or of a log."""

    def __init__(
        self,
        source: TruthSource,
        controller: GraspController,
        config: GraspConfig,
        hand: HandDescription,
        watched: float,
        *,
        rubbed: bool,
    ) -> None:
        """Take the source of the truth.

        Args:
            source: Of the numbers of a hand (`palpate.sim.hand.truth_numbers`).
            controller: Whose stage and target are kept.
            config: What is held.
            hand: That holds it.
            watched: From when on slip and spin are counted [s]: by then the object must be held.
            rubbed: Whether the friction plant rubs: then slip and spin are those that it reports.
        """
        self._source, self._controller, self._config, self._from = source, controller, config, watched
        self._hand = hand.geometry
        self._rows = array("d")
        self._pulled, self._lifted = (_SlipMeter(hand, rubbed=rubbed) for _ in range(2))

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append the truth that belongs to this sample."""
        controller, hand = self._controller, self._hand
        moment = moment_of_numbers(self._source.truth_row(), hand.fingers)
        truth = moment.hand
        assert truth.pose_base_hand is not None  # of numbers it is
        sensors = [truth.pose_base_hand @ pose for pose in hand.sensor_poses(truth.joint_position)]
        tips = [(its @ Pose(tip.center_of_mass)).position for tip, its in zip(hand.tips, sensors, strict=True)]
        normals = [_normal(tip, f, its) for tip, f, its in zip(tips, truth.fingers, sensors, strict=True)]
        if now.time >= self._from:
            self._pulled.update(truth, sensors, normals, moment.slip)
        if controller.stage is GraspStage.LIFT or self._lifted.begun:
            self._lifted.update(truth, sensors, normals, moment.slip)
        row = [
            now.time,
            STAGES.index(controller.stage),
            self._wanted(command),
            truth.position[2],
            *moment.pull,
            clearance(self._config, truth.position[2], truth.quat_wxyz),
            controller.grip.regrips,
            *truth.quat_wxyz,
        ]
        for i, (finger, normal, tip) in enumerate(zip(truth.fingers, normals, tips, strict=True)):
            pressed = -dot(finger.force, normal)
            aside = norm(add_scaled(finger.force, pressed, normal))
            wanted = math.nan if command.grip_force is None else command.grip_force[i]
            at = subtract(finger.position, truth.position)
            spun = dot(finger.torque, normal)
            motion = (*self._pulled.of(i, truth, sensors[i]), *self._lifted.of(i, truth, sensors[i]))
            row += [finger.touching, *at, *normal, pressed, aside, spun, *motion, wanted]
            row += [*subtract(tip, truth.position), *finger.force]
        self._rows.extend(row)

    def _wanted(self, command: Command) -> float:
        if self._controller.stage is GraspStage.LET_GO and command.grip_force is not None:
            return max(command.grip_force)
        return self._controller.grip.target

    def truth(self) -> GraspTruth:
        """Return all that was appended so far."""
        k = self._hand.fingers
        rows = np.array(self._rows).reshape(-1, ALL + k * PER_FINGER)
        each = rows[:, ALL:].reshape(-1, k, PER_FINGER)
        return GraspTruth(
            rows[:, 0],
            rows[:, 1].astype(np.intp),
            each[:, :, 0].astype(bool),
            each[:, :, 1:4],
            each[:, :, 4:7],
            each[:, :, 7:10],
            each[:, :, 10],
            each[:, :, 11],
            each[:, :, 14],
            rows[:, 2],
            rows[:, 4:10],
            rows[:, 3],
            rows[:, 10],
            each[:, :, 12],
            each[:, :, 13],
            rows[:, 11].astype(np.intp),
            rows[:, 12:16],
            each[:, :, 15:18],
            each[:, :, 18:21],
        )


class _SlipMeter:
    """How far the object has slipped and spun over the fingertips since the first update."""

    def __init__(self, hand: HandDescription, *, rubbed: bool) -> None:
        self._period = hand.period
        self._moved: _RelativeMotion | None = None
        self._rubbed = [(0.0, 0.0)] * hand.geometry.fingers if rubbed else None

    @property
    def begun(self) -> bool:
        """Whether it counts already."""
        return self._moved is not None

    def update(
        self,
        truth: HandTruth,
        sensors: list[Pose],
        normals: list[Vector],
        speeds: Sequence[tuple[float, float]],
    ) -> None:
        """Take a period; the first one is where it counts from.

        Args:
            truth: Where the object is.
            sensors: Of the fingers, base frame.
            normals: Of their contacts, base frame.
            speeds: With which these slip and spin, where the friction plant rubs [m/s, rad/s].
        """
        if self._moved is None:
            self._moved = _RelativeMotion(truth, sensors, normals)
        if self._rubbed is not None:
            dt = self._period
            self._rubbed = [
                (slip + speed * dt, spin + rate * dt)
                for (slip, spin), (speed, rate) in zip(self._rubbed, speeds, strict=True)
            ]

    def of(self, i: int, truth: HandTruth, sensor: Pose) -> tuple[float, float]:
        """Return slip [m] and spin [rad] over a finger."""
        if self._moved is None:
            return 0.0, 0.0
        if self._rubbed is not None:
            return self._rubbed[i]
        return self._moved.of(i, truth, sensor)


class _RelativeMotion:
    """How far the object has moved over the fingertips, each in its sensor's frame, since construction."""

    def __init__(self, truth: HandTruth, sensors: list[Pose], normals: list[Vector]) -> None:
        self._normals = [
            np.array(rotate_back(its.rotation, normal)) for its, normal in zip(sensors, normals, strict=True)
        ]
        self._under, self._points, self._rotations = [], [], []
        for its, finger in zip(sensors, truth.fingers, strict=True):
            position, rotation = _seen_from(its, truth)
            under = np.array(rotate_back(its.rotation, subtract(finger.position, its.position)))
            self._under.append(under)
            self._points.append(rotation.T @ (under - position))
            self._rotations.append(rotation)

    def of(self, i: int, truth: HandTruth, sensor: Pose) -> tuple[float, float]:
        """Return slip [m] and spin [rad] over a finger."""
        position, rotation = _seen_from(sensor, truth)
        over, normal = rotation @ self._points[i] + position - self._under[i], self._normals[i]
        aside = over - (over @ normal) * normal
        # of the turn's quaternion, the share about the normal (swing and twist)
        quaternion = np.zeros(4)
        mujoco.mju_mat2Quat(quaternion, (rotation @ self._rotations[i].T).ravel())
        twist = 2.0 * math.atan2(float(quaternion[1:] @ normal), float(quaternion[0]))
        return float(np.linalg.norm(aside)), abs(math.remainder(twist, 2.0 * math.pi))


def _seen_from(sensor: Pose, truth: HandTruth) -> tuple[FloatArray, FloatArray]:
    """Position [m] and rotation of the object in a frame that is given in base coordinates."""
    flat = np.zeros(9)
    mujoco.mju_quat2Mat(flat, truth.quat_wxyz)
    turn = np.array(sensor.rotation).T
    return turn @ (np.array(truth.position) - np.array(sensor.position)), turn @ flat.reshape(3, 3)


def _normal(middle: Vector, finger: FingerTruth, sensor: Pose) -> Vector:
    """Out of a spherical fingertip where it is touched, base frame; along its closing where it is not."""
    if not finger.touching:
        return rotate(sensor.rotation, (1.0, 0.0, 0.0))
    return unit(subtract(finger.position, middle))
