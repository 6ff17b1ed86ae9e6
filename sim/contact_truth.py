"""Ground truth at a single fingertip's contact, and its form in logs and between processes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, islice

from palpate.kinematics.pose import Pose
from palpate.spatial import ZERO, Vector, rotate_back, subtract

TOUCHING = "touching"
POSITION = ("contact_x_m", "contact_y_m", "contact_z_m")
FORCE = ("force_x_n", "force_y_n", "force_z_n")
"""What the object exerts on the tip, base frame."""
TORQUE = ("torque_x_nm", "torque_y_nm", "torque_z_nm")
"""Likewise, about the contact's position."""
OBJECT_POSITION = ("object_x_m", "object_y_m", "object_z_m")
HELD_POSITION = ("held_x_m", "held_y_m", "held_z_m")
"""Of the end of a tool that a hand holds, tip frame; not in every truth."""
OBJECT_ROTATION = tuple(f"object_r{i}{j}" for i in range(3) for j in range(3))
"""Object to base, row by row."""

CONTACT_COLUMNS = (TOUCHING, *POSITION, *FORCE, *TORQUE, *OBJECT_POSITION, *OBJECT_ROTATION)
"""Names of the numbers of a `Truth`."""


@dataclass(frozen=True, slots=True)
class Truth:
    """Ground truth at the contact, for checks; no controller sees it.

    Attributes:
        touching: Whether tip and object are in contact.
        position: Force-weighted centroid of the contacts, base frame [m].
        force: What the object exerts on the tip, base frame [N].
        torque: Likewise, about `position` [N m].
        pose_base_object: Where the object is.
    """

    touching: bool
    position: Vector
    force: Vector
    torque: Vector
    pose_base_object: Pose

    @property
    def position_object(self) -> Vector:
        """Where on the object the contact is: `position` in the object's frame [m]."""
        pose = self.pose_base_object
        return rotate_back(pose.rotation, subtract(self.position, pose.position))


UNKNOWN = Truth(False, ZERO, ZERO, ZERO, Pose())
"""Before anything is known."""


def numbers_of_truth(truth: Truth) -> tuple[float, ...]:
    """Return a truth as the numbers of `CONTACT_COLUMNS`."""
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
    """Return what `numbers_of_truth` was given; what is unknown of no numbers, or of NaN."""
    if not numbers or math.isnan(numbers[0]):
        return UNKNOWN
    each = iter(numbers)
    touching = next(each) > 0.0
    vectors = (_vector(list(islice(each, 3))) for _ in range(7))
    position, force, torque, origin = (next(vectors) for _ in range(4))
    return Truth(touching, position, force, torque, Pose(origin, (next(vectors), next(vectors), next(vectors))))


def _vector(three: Sequence[float]) -> Vector:
    x, y, z = three
    return (x, y, z)
