"""Poses are a group, turns its one-parameter subgroups."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.kinematics.pose import (
    Pose,
    orthonormal,
    rotation_from_rotvec,
    rotvec_from_rotation,
    times,
)

number = st.floats(-3.0, 3.0)
vectors = st.tuples(number, number, number)
poses = st.builds(Pose, vectors, vectors.map(rotation_from_rotvec))


def matrix(pose):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = pose.rotation, pose.position
    return result


@given(poses, poses)
def test_poses_compose_like_homogeneous_matrices(a, b):
    assert np.allclose(matrix(a @ b), matrix(a) @ matrix(b), atol=1e-14)
    assert np.allclose(matrix(a @ a.inverse()), np.eye(4), atol=1e-14)
    assert np.allclose(matrix(a.inverse() @ a), np.eye(4), atol=1e-14)


@given(vectors)
def test_a_turn_is_a_rotation_about_its_own_axis(rotvec):
    R = np.array(rotation_from_rotvec(rotvec))
    assert np.allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) > 0.0
    assert np.allclose(R @ rotvec, rotvec, atol=1e-14)
    assert np.trace(R) == pytest.approx(1.0 + 2.0 * math.cos(math.hypot(*rotvec)), abs=1e-14)


@given(vectors, st.floats(0.0, 1.0))
def test_turns_about_one_axis_add(rotvec, share):
    parts = [tuple(part * x for x in rotvec) for part in (share, 1.0 - share)]
    whole = times(rotation_from_rotvec(parts[0]), rotation_from_rotvec(parts[1]))
    assert np.allclose(whole, rotation_from_rotvec(rotvec), atol=1e-14)


@given(
    vectors, st.sampled_from([0.0, 1e-300, 1e-12, 1e-5, 1e-4, 0.1, 1.0, 2.0, 2.7, 3.1, math.pi - 1e-9, math.pi])
)
def test_the_turn_of_a_rotation_gives_it_back(direction, angle):
    length = math.hypot(*direction)
    if length < 1e-3:
        return
    rotvec = tuple(angle / length * x for x in direction)
    R = rotation_from_rotvec(rotvec)
    found = rotvec_from_rotation(R)
    assert math.hypot(*found) <= math.pi + 1e-15
    assert np.allclose(rotation_from_rotvec(found), R, atol=1e-14)
    if angle < 3.0:
        assert np.allclose(found, rotvec, atol=1e-14)


@pytest.mark.parametrize("axis", [(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0), (0.6, 0, -0.8), (0, -0.6, 0.8)])
def test_half_a_turn_has_an_axis(axis):
    R = rotation_from_rotvec(tuple(math.pi * x for x in axis))
    found = np.array(rotvec_from_rotation(R)) / math.pi
    assert np.allclose(found, axis, atol=1e-12) or np.allclose(found, np.negative(axis), atol=1e-12)


@given(vectors, st.floats(-1e-6, 1e-6))
def test_rounding_is_taken_out_of_a_rotation(rotvec, error):
    R = np.array(rotation_from_rotvec(rotvec))
    spoilt = tuple(map(tuple, (R + error * np.array([[1, 0.3, 0], [0.2, -1, 0], [0, 0.5, 0.1]])).tolist()))
    again = np.array(orthonormal(spoilt))
    assert np.abs(again @ again.T - np.eye(3)).max() < 1e-11
    assert np.abs(again - R).max() < 3e-6
