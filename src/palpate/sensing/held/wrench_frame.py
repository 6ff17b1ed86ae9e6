"""Wrenches from one frame to another: turned, and their moment about the other origin."""

import numpy as np

from palpate.errors import FloatArray
from palpate.kinematics.pose import Pose
from palpate.spatial import Wrench, add, cross, rotate, rotate_back, subtract


def wrench_from(pose: Pose, wrench: Wrench) -> Wrench:
    """Return a wrench of frame b in and about frame a, with pose_a_b."""
    f = rotate(pose.rotation, wrench[:3])
    return (*f, *add(rotate(pose.rotation, wrench[3:]), cross(pose.position, f)))


def wrench_into(pose: Pose, wrench: Wrench) -> Wrench:
    """Return a wrench of frame a in and about frame b, with pose_a_b: undoes `wrench_from`."""
    f, m = wrench[:3], wrench[3:]
    return (
        *rotate_back(pose.rotation, f),
        *rotate_back(pose.rotation, subtract(m, cross(pose.position, f))),
    )


def into_matrix(pose: Pose) -> FloatArray:
    """Return X, shape (6, 6), that takes wrenches as `wrench_into` does."""
    R, (x, y, z) = np.array(pose.rotation), pose.position
    arm = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    X = np.zeros((6, 6))
    X[:3, :3] = X[3:, 3:] = R.T
    X[3:, :3] = -R.T @ arm
    return X
