"""How a hand and the object in it really moved, as arrays: from the truth that a simulation told every period."""

from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

from palpate.errors import FloatArray
from palpate.runtime.truth import TruthTable
from palpate.sim.hand.hand_model import HandModel


@dataclass(frozen=True, slots=True, eq=False)
class HandMotion:
    """Object, fingertips and contacts of n periods and k fingers; base frame.

    Attributes:
        position: Of the object's origin, shape (n, 3) [m].
        quat_wxyz: Its orientation, object to base, shape (n, 4).
        pull: On it besides fingers and weight, about its origin, shape (n, 6) [N, N m].
        touching: Shape (n, k).
        contact: Force-weighted centroid of the contacts, shape (n, k, 3) [m].
        force: What the object exerts on each tip, shape (n, k, 3) [N].
        torque: Likewise, about `contact`, shape (n, k, 3) [N m].
        speeds: With which a contact of the friction plant slips and spins, shape (n, k, 2) [m/s, rad/s].
        sensor: Of each finger, shape (n, k, 3) [m].
        rotation: Sensor to base, shape (n, k, 3, 3).
        tip: Middle of each fingertip, shape (n, k, 3) [m].
        normal: Out of a spherical fingertip where it is touched, along its closing where it is not, (n, k, 3).
    """

    position: FloatArray
    quat_wxyz: FloatArray
    pull: FloatArray
    touching: npt.NDArray[np.bool_]
    contact: FloatArray
    force: FloatArray
    torque: FloatArray
    speeds: FloatArray
    sensor: FloatArray
    rotation: FloatArray
    tip: FloatArray
    normal: FloatArray

    @classmethod
    def of(cls, table: TruthTable, hand: HandModel) -> Self:
        """Take the numbers of `palpate.sim.hand.truth_numbers.hand_columns`, and whose hand they are."""
        n = len(table.rows)

        def each(*names: str) -> FloatArray:
            """Columns of every finger, shape (n, k, len(names))."""
            fingers = range(hand.fingers)
            return table.column(*(f"finger_{i}_{name}" for i in fingers for name in names)).reshape(
                n, hand.fingers, len(names)
            )

        def vectors(name: str, unit: str) -> FloatArray:
            return each(*(f"{name}_{axis}_{unit}" for axis in "xyz"))

        joints = table.column(*(name for name in table.columns if name.startswith("joint_")))
        poses = [hand.sensor_poses(tuple(row)) for row in joints.tolist()]
        in_hand = np.array([[pose.position for pose in row] for row in poses]).reshape(n, hand.fingers, 3)
        turned = np.array([[pose.rotation for pose in row] for row in poses]).reshape(n, hand.fingers, 3, 3)
        palm = table.column(*(f"hand_r{i}{j}" for i in range(3) for j in range(3))).reshape(n, 1, 3, 3)
        at = table.column("hand_x_m", "hand_y_m", "hand_z_m")
        rotation = palm @ turned
        sensor = at[:, None] + _applied(palm, in_hand)
        tip = sensor + _applied(rotation, np.array([its.center_of_mass for its in hand.tips]))
        touching, contact = each("touching")[:, :, 0] > 0.0, vectors("contact", "m")
        outward = contact - tip
        length = np.linalg.norm(outward, axis=2, keepdims=True)
        normal = np.where(touching[:, :, None], outward / np.where(length > 0.0, length, 1.0), rotation[..., 0])
        return cls(
            position=table.column("object_x_m", "object_y_m", "object_z_m"),
            quat_wxyz=table.column("object_qw", "object_qx", "object_qy", "object_qz"),
            pull=table.column(
                *(f"pull_{axis}_n" for axis in "xyz"), *(f"pull_moment_{axis}_nm" for axis in "xyz")
            ),
            touching=touching,
            contact=contact,
            force=vectors("force", "n"),
            torque=vectors("torque", "nm"),
            speeds=each("slip_speed_m_per_s", "slip_spin_rad_per_s"),
            sensor=sensor,
            rotation=rotation,
            tip=tip,
            normal=normal,
        )


class OverTips:
    """How far an object slips and spins over the fingertips that hold it, each in its sensor's frame."""

    def __init__(self, motion: HandMotion, rubbed_period: float | None) -> None:
        """Take the motion.

        Args:
            motion: Of hand and object.
            rubbed_period: Where the friction plant rubs, the period [s] with which its speeds are added up.
        """
        self._motion, self._period = motion, rubbed_period
        turned = np.swapaxes(motion.rotation, 2, 3)
        w, x, y, z = motion.quat_wxyz.T
        stands = Rotation.from_quat(np.column_stack([x, y, z, w])).as_matrix() if len(w) else np.zeros((0, 3, 3))
        self._rotation = turned @ stands[:, None]
        self._position = _applied(turned, motion.position[:, None] - motion.sensor)
        self._under = _applied(turned, motion.contact - motion.sensor)
        self._normal = _applied(turned, motion.normal)

    def since(self, counts: npt.NDArray[np.bool_]) -> tuple[FloatArray, FloatArray]:
        """Return slip [m] and spin [rad] since a period, both of shape (n, k); 0 before it.

        Slip is how far the point that was under the finger then has moved over it across the normal, spin how far
        the object has turned about the normal, what is elastic included; where the friction plant rubs, what its
        speeds add up to.

        Args:
            counts: Shape (n,); the first period in which it is true is where it counts from.
        """
        slip, spin = np.zeros(self._position.shape[:2]), np.zeros(self._position.shape[:2])
        if not counts.any():
            return slip, spin
        s = int(np.argmax(counts))
        if self._period is not None:
            added = np.cumsum(self._motion.speeds[s:] * self._period, axis=0)
            slip[s:], spin[s:] = added[..., 0], added[..., 1]
            return slip, spin
        normal, begun = self._normal[s], self._rotation[s]
        point = _applied(np.swapaxes(begun, 1, 2), self._under[s] - self._position[s])
        over = _applied(self._rotation[s:], point) + self._position[s:] - self._under[s]
        aside = over - np.sum(over * normal, axis=2, keepdims=True) * normal
        slip[s:] = np.linalg.norm(aside, axis=2)
        # of the turn's quaternion, the share about the normal (swing and twist)
        turn = self._rotation[s:] @ np.swapaxes(begun, 1, 2)
        quat = Rotation.from_matrix(turn.reshape(-1, 3, 3)).as_quat().reshape(*turn.shape[:2], 4)
        twist = 2.0 * np.arctan2(np.sum(quat[..., :3] * normal, axis=2), quat[..., 3])
        spin[s:] = np.abs(twist - 2.0 * np.pi * np.rint(twist / (2.0 * np.pi)))
        return slip, spin


def _applied(rotation: FloatArray, vector: FloatArray) -> FloatArray:
    """Rotations, shape (..., 3, 3), times vectors, shape (..., 3)."""
    rotated: FloatArray = np.squeeze(rotation @ vector[..., None], axis=-1)
    return rotated
