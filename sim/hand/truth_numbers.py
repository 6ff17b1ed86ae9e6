"""The truth of a grasp as plain numbers, and back. Base frame; forces on the tips."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice

from palpate.kinematics.pose import Pose
from palpate.runtime.data import ArmSample
from palpate.sim.friction.plant import FrictionContact
from palpate.sim.hand.hand_model import HandModel
from palpate.sim.hand.scene import GraspScene
from palpate.sim.hand.truth import FingerTruth, HandTruth
from palpate.spatial import Vector, Wrench, norm

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


@dataclass(frozen=True, slots=True)
class GraspMoment:
    """What really happens in a grasp at one sample.

    Attributes:
        hand: Object and fingers.
        pull: On the object besides fingers and weight, about its origin [N, N m].
        slip: How fast each contact of the friction plant slips, and how fast it spins [m/s, rad/s]; zeros where
            MuJoCo rubs.
    """

    hand: HandTruth
    pull: Wrench
    slip: tuple[tuple[float, float], ...]


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


def moment_of_numbers(numbers: Sequence[float], fingers: int) -> GraspMoment:
    """Return what `numbers_of_hand` was given, of a hand with so many fingers."""
    each = iter(numbers)
    time, position = next(each), _vector(each)
    w, x, y, z = islice(each, 4)
    velocity, angular_velocity = _vector(each), _vector(each)
    a, b, c, d, e, f = islice(each, 6)
    hand = Pose(_vector(each), (_vector(each), _vector(each), _vector(each)))
    joints = tuple(islice(each, len(numbers) - len(_HAND_COLUMNS) - fingers * len(_FINGER_COLUMNS)))
    found, slip = [], []
    for _ in range(fingers):
        touching = next(each) > 0.0
        at, force, torque = (_vector(each) for _ in range(3))
        found.append(FingerTruth(touching, at, force, torque, next(each)))
        slip.append((next(each), next(each)))
    truth = HandTruth(time, tuple(found), joints, position, (w, x, y, z), velocity, angular_velocity, hand)
    return GraspMoment(truth, (a, b, c, d, e, f), tuple(slip))


def _vector(each: Iterator[float]) -> Vector:
    x, y, z = islice(each, 3)
    return x, y, z
