"""Truths of simulations as plain numbers, and back."""

from collections.abc import Iterator, Sequence
from itertools import chain, islice

from palpate.kinematics.pose import Pose
from palpate.runtime.data import ArmSample
from palpate.sim.backend import Truth
from palpate.sim.hand.truth import FingerTruth, HandTruth
from palpate.spatial import ZERO, Vector, Wrench

UNKNOWN = Truth(False, ZERO, ZERO, ZERO, Pose())
"""Before anything is known."""

_FINGER = 12


def numbers_of_truth(truth: Truth) -> tuple[float, ...]:
    """Return the truth of one fingertip's contact as 22 numbers."""
    pose = truth.pose_base_object
    return (
        float(truth.touching),
        *truth.position,
        *truth.force,
        *truth.torque,
        *pose.position,
        *chain.from_iterable(pose.rotation),
    )


def truth_of_numbers(numbers: Sequence[float]) -> Truth:
    """Return what `numbers_of_truth` was given; what is unknown of no numbers."""
    if not numbers:
        return UNKNOWN
    each = iter(numbers)
    touching = next(each) > 0.0
    position, force, torque, origin = (_vector(each) for _ in range(4))
    return Truth(touching, position, force, torque, Pose(origin, (_vector(each), _vector(each), _vector(each))))


def numbers_of_hand(truth: HandTruth, pull: Wrench, hand: ArmSample) -> tuple[float, ...]:
    """Return the truth of a grasp as 32 numbers and 12 for each finger.

    Args:
        truth: Of the scene.
        pull: What pulls at the object [N, N m].
        hand: Where the hand is.
    """
    fingers = (
        (float(f.touching), *f.position, *f.force, *f.torque, f.current, f.joint_position) for f in truth.fingers
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
        *chain.from_iterable(fingers),
    )


def hand_of_numbers(numbers: Sequence[float], fingers: int) -> tuple[HandTruth, Wrench]:
    """Return what `numbers_of_hand` was given."""
    each = iter(numbers)
    time, position = next(each), _vector(each)
    w, x, y, z = islice(each, 4)
    velocity, angular_velocity = _vector(each), _vector(each)
    a, b, c, d, e, f = islice(each, 6)
    hand = Pose(_vector(each), (_vector(each), _vector(each), _vector(each)))
    found = tuple(_finger(islice(each, _FINGER)) for _ in range(fingers))
    return HandTruth(time, found, position, (w, x, y, z), velocity, angular_velocity, hand), (a, b, c, d, e, f)


def _finger(each: Iterator[float]) -> FingerTruth:
    touching = next(each) > 0.0
    position, force, torque = (_vector(each) for _ in range(3))
    return FingerTruth(touching, position, force, torque, next(each), next(each))


def _vector(each: Iterator[float]) -> Vector:
    x, y, z = islice(each, 3)
    return x, y, z
