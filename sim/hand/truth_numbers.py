"""The truth of a grasp as plain numbers, and back. Base frame; forces on the tips."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.runtime.data import ArmSample
from palpate.sim.friction.plant import FrictionContact
from palpate.sim.hand.hand_model import HandModel
from palpate.sim.hand.scene import GraspScene
from palpate.sim.hand.truth import HandTruth
from palpate.spatial import Wrench, norm

OBJECT_POSITION = ("object_x_m", "object_y_m", "object_z_m")
OBJECT_QUATERNION = ("object_qw", "object_qx", "object_qy", "object_qz")

_HAND_COLUMNS = (
    "time_s",
    *OBJECT_POSITION,
    *OBJECT_QUATERNION,
    *(f"object_velocity_{axis}_m_per_s" for axis in "xyz"),
    *(f"object_angular_velocity_{axis}_rad_per_s" for axis in "xyz"),
    *(f"pull_{axis}_n" for axis in "xyz"),
    *(f"pull_moment_{axis}_nm" for axis in "xyz"),
    *(f"hand_{axis}_m" for axis in "xyz"),
    *(f"hand_r{i}{j}" for i in range(3) for j in range(3)),
)
_FINGER_COLUMNS = (
    "touching",
    *(f"contact_{axis}_m" for axis in "xyz"),
    *(f"force_{axis}_n" for axis in "xyz"),
    *(f"torque_{axis}_nm" for axis in "xyz"),
    "current_a",
    "slip_speed_m_per_s",
    "slip_spin_rad_per_s",
)


def hand_columns(hand: HandModel) -> tuple[str, ...]:
    """Return the names of the numbers of a grasp's truth."""
    joints = (f"joint_{k}" for k in range(len(hand.start)))
    return (
        *_HAND_COLUMNS,
        *joints,
        *(f"finger_{i}_{name}" for i in range(hand.fingers) for name in _FINGER_COLUMNS),
    )


@dataclass(frozen=True, slots=True, eq=False)
class GraspMoments:
    """What really happened in a grasp, at n samples, with k fingers and j joints. Base frame.

    Attributes:
        time: Shape (n,) [s].
        position: Of the object's frame, shape (n, 3) [m].
        quat_wxyz: Its orientation, object to base, shape (n, 4).
        velocity: Of its frame, shape (n, 3) [m/s].
        angular_velocity: Of the object, shape (n, 3) [rad/s].
        pull: On the object besides fingers and weight, about its origin, shape (n, 6) [N, N m].
        hand_position: Where the hand is, shape (n, 3) [m].
        hand_rotation: Hand to base, shape (n, 3, 3).
        joint_position: Of the hand, without rounding, shape (n, j) [rad or m].
        touching: Whether each finger touches the object, shape (n, k).
        contact: Force-weighted centroid of its contacts, shape (n, k, 3) [m].
        force: What the object exerts on its tip, shape (n, k, 3) [N].
        torque: Likewise, about `contact`, shape (n, k, 3) [N m].
        current: Of its servo, shape (n, k) [A].
        slip: How fast its contact slips and spins on the friction plant, shape (n, k, 2) [m/s, rad/s]; zeros where
            MuJoCo rubs.
    """

    time: FloatArray
    position: FloatArray
    quat_wxyz: FloatArray
    velocity: FloatArray
    angular_velocity: FloatArray
    pull: FloatArray
    hand_position: FloatArray
    hand_rotation: FloatArray
    joint_position: FloatArray
    touching: npt.NDArray[np.bool_]
    contact: FloatArray
    force: FloatArray
    torque: FloatArray
    current: FloatArray
    slip: FloatArray


def numbers_of_hand(
    truth: HandTruth, pull: Wrench, hand: ArmSample, rubbing: Sequence[FrictionContact], scene: GraspScene
) -> tuple[float, ...]:
    """Return the truth of a grasp as the numbers of `hand_columns`.

    Args:
        truth: Of the scene.
        pull: What pulls at the object [N, N m].
        hand: Where the hand is.
        rubbing: Contacts of the friction plant, if it rubs.
        scene: Whose pairs of tip and object they are.
    """
    fingers = (
        (
            float(f.touching),
            *f.position,
            *f.force,
            *f.torque,
            f.current,
            sum(norm(its.slip_velocity) for its in rubbing if its.pair is scene.rubbing[i]),
            sum(abs(its.slip_spin) for its in rubbing if its.pair is scene.rubbing[i]),
        )
        for i, f in enumerate(truth.fingers)
    )
    return (
        truth.time,
        *truth.position,
        *truth.quat_wxyz,
        *truth.velocity,
        *truth.angular_velocity,
        *pull,
        *hand.position_base_tip,
        *chain.from_iterable(hand.rotation_base_tip),
        *truth.joint_position,
        *chain.from_iterable(fingers),
    )


def moments_of_numbers(rows: FloatArray, fingers: int) -> GraspMoments:
    """Return what `numbers_of_hand` was given, in n periods, of a hand with so many fingers.

    Args:
        rows: Its numbers, shape (n, columns).
        fingers: How many there are.
    """
    n, width = len(rows), len(_FINGER_COLUMNS)
    first = rows.shape[1] - fingers * width
    each = rows[:, first:].reshape(n, fingers, width)
    return GraspMoments(
        time=rows[:, 0],
        position=rows[:, 1:4],
        quat_wxyz=rows[:, 4:8],
        velocity=rows[:, 8:11],
        angular_velocity=rows[:, 11:14],
        pull=rows[:, 14:20],
        hand_position=rows[:, 20:23],
        hand_rotation=rows[:, 23:32].reshape(n, 3, 3),
        joint_position=rows[:, 32:first],
        touching=each[:, :, 0] > 0.0,
        contact=each[:, :, 1:4],
        force=each[:, :, 4:7],
        torque=each[:, :, 7:10],
        current=each[:, :, 10],
        slip=each[:, :, 11:13],
    )
