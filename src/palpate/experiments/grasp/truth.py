"""True motion and loads of a grasp, or on a robot its felt contacts: one row per period."""

import math
from abc import ABC, abstractmethod
from array import array
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from palpate.controllers.grip.grasp import GraspController, GraspStage
from palpate.errors import FloatArray
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.friction_belief import rubbed_by_plant
from palpate.kinematics.pose import Pose
from palpate.robots.hand_description import HandDescription
from palpate.runtime import Command, Observation, Sample
from palpate.runtime.truth import TruthSource, TruthTable
from palpate.sim.hand.hand_model import HandModel
from palpate.spatial import ZERO, as_vector, norm, rotate

STAGES = tuple(GraspStage)


def clearance(config: GraspConfig, height: FloatArray, quat_wxyz: FloatArray) -> FloatArray:
    """Return the height of an object's lowest point above the table, shape (n,) [m]; 0 or less: it stands on it.

    Args:
        config: Options of the grasp; the object's origin is its centre, at height 0 half a height above the table.
        height: Height of the origin, base frame, shape (n,) [m].
        quat_wxyz: Orientation of the object, object to base, shape (n, 4). A cylinder's axis is its x.
    """
    w, x, y, z = np.moveaxis(quat_wxyz, -1, 0)
    up = np.stack([2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)], axis=-1)
    sizes = config.sizes
    if config.object == "box":
        below = np.abs(up) @ (0.5 * np.array(sizes))
    elif config.object == "cylinder":
        below = 0.5 * sizes[1] * np.abs(up[..., 0]) + sizes[0] * np.sqrt(np.maximum(0.0, 1.0 - up[..., 0] ** 2))
    else:
        below = np.full(w.shape, sizes[0])
    lowest: FloatArray = height + config.half_height - below
    return lowest


@dataclass(frozen=True, slots=True, eq=False)
class GraspTruth:
    """True motion and loads, one row per period (n) and finger (k); NaN where a robot does not know them.

    Slip and spin belong to the object over each fingertip since the pull began. Slip is how far the point that was
    under the finger then has moved over it across the normal; spin is how far the object has turned about the
    normal. Both include elastic motion. Where the friction plant rubs, whose bristles bend, they are the integrals
    of the contacts' slip and spin speeds.

    Attributes:
        time: Time of each period, shape (n,) [s].
        stage: Index in `STAGES`, shape (n,).
        touching: Whether a finger touches the object, shape (n, k).
        contact: Contact centroid from the object's origin, base frame, shape (n, k, 3) [m].
        normal: Unit normal into the object, base frame, shape (n, k, 3).
        loads: Normal force [N], length of the tangential force [N], spin torque [N m], shape (n, k, 3).
        slip: Slip since the pull began, shape (n, k) [m].
        spin: Spin since the pull began, shape (n, k) [rad].
        command: Commanded grip, shape (n, k) [N]; NaN without a command.
        target: Planned grip, without correction, shape (n,) [N].
        pull: Other load on the object than fingers and weight, about its origin, shape (n, 6) [N, N m].
        height: Height of the object's origin, on a robot that of the hand, shape (n,) [m].
        clearance: Height of the object's lowest point above the table, shape (n,) [m]; 0 or less: it touches.
        slid: Slip since the lift began, shape (n, k) [m].
        turned: Spin since the lift began, shape (n, k) [rad].
        regrips: Number of times that an alarm had raised the grip by then, shape (n,).
        quat_wxyz: Orientation of the object, object to base, shape (n, 4).
        tip: Middle of each fingertip, as `contact`, shape (n, k, 3) [m].
        force: Force of the object on each fingertip, base frame, shape (n, k, 3) [N].
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
        """Number of fingers."""
        return int(self.touching.shape[1])


class _GraspRecorder(ABC):
    """An observer that keeps stage, planned and commanded grip of every period, and numbers of its own."""

    def __init__(self, controller: GraspController, hand: HandModel) -> None:
        self._controller, self._hand = controller, hand
        self._own, self._numbers = array("d"), array("d")

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append one period."""
        stage, grip, force = self._controller.stage, self._controller.grip, command.grip_force
        target = max(force) if force is not None and stage is GraspStage.LET_GO else grip.target
        commanded = force or (math.nan,) * self._hand.fingers
        self._own.extend((now.time, STAGES.index(stage), target, grip.regrips, *commanded))
        self._append(now)

    @abstractmethod
    def _append(self, now: Observation) -> None:
        """Append the numbers of one period."""

    def _kept(self) -> dict[str, Any]:
        """Return the columns that every recorder keeps."""
        own = np.array(self._own).reshape(-1, 4 + self._hand.fingers)
        return {
            "time": own[:, 0],
            "stage": own[:, 1].astype(np.intp),
            "target": own[:, 2],
            "regrips": own[:, 3].astype(np.intp),
            "command": own[:, 4:],
        }


class GraspTruthRecorder(_GraspRecorder):
    """An observer that keeps the truth at every sample, of a back end or of a log; `truth` evaluates it."""

    def __init__(
        self,
        source: TruthSource,
        controller: GraspController,
        config: GraspConfig,
        hand: HandDescription,
        pulled: float,
    ) -> None:
        """Take the source of the truth.

        Args:
            source: Source of a hand's truth (`palpate.sim.hand.truth_numbers`).
            controller: Controller whose stage and planned grip are kept.
            config: Options of the grasp.
            hand: Hand that holds the object.
            pulled: Time from which slip and spin count [s]; the object must be held by then.
        """
        super().__init__(controller, hand.geometry)
        self._source, self._config, self._period, self._pulled = source, config, hand.period, pulled

    def _append(self, now: Observation) -> None:
        self._numbers.extend(self._source.truth_row())

    def truth(self) -> GraspTruth:
        """Return all periods so far."""
        kept, hand, columns = self._kept(), self._hand, self._source.truth_columns
        n, k = len(kept["time"]), hand.fingers
        table = TruthTable(columns, np.array(self._numbers).reshape(n, len(columns)))

        def each(*names: str) -> FloatArray:
            """Return columns of every finger, shape (n, k, len(names))."""
            return table.column(*(f"finger_{i}_{name}" for i in range(k) for name in names)).reshape(n, k, -1)

        def vectors(name: str, unit: str) -> FloatArray:
            return each(*(f"{name}_{axis}_{unit}" for axis in "xyz"))

        joints = table.column(*(name for name in columns if name.startswith("joint_")))
        poses = [hand.sensor_poses(tuple(row)) for row in joints.tolist()]
        in_hand = np.array([[pose.position for pose in row] for row in poses]).reshape(n, k, 3)
        turned = np.array([[pose.rotation for pose in row] for row in poses]).reshape(n, k, 3, 3)
        palm = table.column(*(f"hand_r{i}{j}" for i in range(3) for j in range(3))).reshape(n, 1, 3, 3)
        rotation = palm @ turned
        sensor = table.column("hand_x_m", "hand_y_m", "hand_z_m")[:, None] + _applied(palm, in_hand)
        tip = sensor + _applied(rotation, np.array([its.center_of_mass for its in hand.tips]))
        position = table.column("object_x_m", "object_y_m", "object_z_m")
        quat_wxyz = table.column("object_qw", "object_qx", "object_qy", "object_qz")
        pull = (*(f"pull_{axis}_n" for axis in "xyz"), *(f"pull_moment_{axis}_nm" for axis in "xyz"))
        touching, contact = each("touching")[:, :, 0] > 0.0, vectors("contact", "m")
        force, torque = vectors("force", "n"), vectors("torque", "nm")
        # out of a spherical fingertip where it is touched, along its closing where it is not
        outward = contact - tip
        length = np.linalg.norm(outward, axis=2, keepdims=True)
        normal = np.where(touching[:, :, None], outward / np.where(length > 0.0, length, 1.0), rotation[..., 0])
        pressed = -np.sum(force * normal, axis=2)
        aside = np.linalg.norm(force + pressed[:, :, None] * normal, axis=2)
        # the object in each sensor's frame
        inverse = np.swapaxes(rotation, 2, 3)
        stands = Rotation.from_quat(np.roll(quat_wxyz, -1, axis=1)).as_matrix() if n else np.zeros((0, 3, 3))
        over = inverse @ stands[:, None]
        middle = _applied(inverse, position[:, None] - sensor)
        under, across = _applied(inverse, contact - sensor), _applied(inverse, normal)
        rates = each("slip_speed_m_per_s", "slip_spin_rad_per_s") * self._period

        def since(counts: npt.NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
            """Return slip [m] and spin [rad] since the first period that counts, both (n, k); 0 before it."""
            moved = np.zeros((n, k, 2))
            if counts.any():
                s = int(np.argmax(counts))
                plant = rubbed_by_plant(self._config)
                moved[s:] = (
                    np.cumsum(rates[s:], axis=0) if plant else _motion(over[s:], middle[s:], under[s], across[s])
                )
            return moved[..., 0], moved[..., 1]

        slip, spin = since(kept["time"] >= self._pulled)
        slid, spun = since(kept["stage"] == STAGES.index(GraspStage.LIFT))
        return GraspTruth(
            **kept,
            touching=touching,
            contact=contact - position[:, None],
            normal=normal,
            loads=np.stack([pressed, aside, np.sum(torque * normal, axis=2)], axis=2),
            slip=slip,
            spin=spin,
            pull=table.column(*pull),
            height=position[:, 2],
            clearance=clearance(self._config, position[:, 2], quat_wxyz),
            slid=slid,
            turned=spun,
            quat_wxyz=quat_wxyz,
            tip=tip - position[:, None],
            force=force,
        )


def _motion(rotation: FloatArray, position: FloatArray, under: FloatArray, normal: FloatArray) -> FloatArray:
    """Return slip [m] and spin [rad] of an object over fingertips since the first row, shape (n, k, 2).

    Args:
        rotation: Object to sensor, shape (n, k, 3, 3).
        position: Object's origin, sensor frame, shape (n, k, 3) [m].
        under: Contact centroid at the first row, sensor frame, shape (k, 3) [m].
        normal: Contact normal at the first row, sensor frame, shape (k, 3).
    """
    back = np.swapaxes(rotation[0], 1, 2)
    moved = _applied(rotation, _applied(back, under - position[0])) + position - under
    aside = moved - np.sum(moved * normal, axis=2, keepdims=True) * normal
    # the share about the normal of the turn's quaternion (swing and twist)
    turn = rotation @ back
    quat = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat().reshape(*turn.shape[:2], 4)
    twist = 2.0 * np.arctan2(np.sum(quat[..., :3] * normal, axis=2), quat[..., 3])
    spin = np.abs(twist - 2.0 * np.pi * np.rint(twist / (2.0 * np.pi)))
    return np.stack([np.linalg.norm(aside, axis=2), spin], axis=2)


def _applied(rotation: FloatArray, vector: FloatArray) -> FloatArray:
    """Return rotations, shape (..., 3, 3), times vectors, shape (..., 3)."""
    rotated: FloatArray = np.squeeze(rotation @ vector[..., None], axis=-1)
    return rotated


class GraspFeltRecorder(_GraspRecorder):
    """An observer that keeps the felt contacts of a real hand; quantities that only a simulation knows are NaN.

    Per finger it keeps touching; normal force, length of the tangential force, spin torque; contact and middle of
    the fingertip from the hand's origin, base frame; and the force on the fingertip.
    """

    def _append(self, now: Observation) -> None:
        assert now.hand is not None
        base_hand = Pose(rotation=now.arm.rotation_base_tip)
        sensors = self._hand.sensor_poses(now.hand.joint_position)
        self._numbers.append(now.arm.position_base_tip[2])
        for finger, tip, its in zip(now.fingers, self._hand.tips, sensors, strict=True):
            contact, felt, base_sensor = finger.contact, finger.touching, base_hand @ its
            x, y, z = contact.tangential_force.tolist()
            loads = (contact.normal_force, norm((x, y, z)), contact.spin_torque) if felt else ZERO
            middle = (base_sensor @ Pose(tip.center_of_mass)).position
            at = (base_sensor @ Pose(as_vector(contact.centroid))).position if finger.believed else middle
            force = rotate(base_sensor.rotation, finger.force) if felt else ZERO
            self._numbers.extend((felt, *loads, *at, *middle, *force))

    def truth(self) -> GraspTruth:
        """Return all periods so far."""
        kept, k = self._kept(), self._hand.fingers
        n = len(kept["time"])
        rows = np.array(self._numbers).reshape(n, 1 + 13 * k)
        each = rows[:, 1:].reshape(n, k, 13)

        def unknown(*shape: int) -> FloatArray:
            return np.full((n, *shape), np.nan)

        return GraspTruth(
            **kept,
            touching=each[:, :, 0].astype(bool),
            loads=each[:, :, 1:4],
            contact=each[:, :, 4:7],
            tip=each[:, :, 7:10],
            force=each[:, :, 10:13],
            height=rows[:, 0],
            normal=unknown(k, 3),
            slip=unknown(k),
            spin=unknown(k),
            pull=unknown(6),
            clearance=unknown(),
            slid=unknown(k),
            turned=unknown(k),
            quat_wxyz=unknown(4),
        )
