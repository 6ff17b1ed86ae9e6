"""Poses are a group and turns its one-parameter subgroups; poses of the UR5e's tip, and of objects in a grasp."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.kinematics import UR5E, ArmKinematics, DHRow, JointLimits, Pose, arm_of_rows
from palpate.kinematics.held_frame import HeldFrame
from palpate.kinematics.pose import orthonormal, rotation_from_rotvec, rotvec_from_rotation, times

number = st.floats(-3.0, 3.0)
vectors = st.tuples(number, number, number)
axes = st.sampled_from([(1, 0, 0), (0, 1, 0), (0, 0, 1), (0.6, 0.8, 0), (0.6, 0, -0.8), (0, -0.6, 0.8)])
directions = st.one_of(vectors.filter(lambda v: math.hypot(*v) > 1e-3), axes)
poses = st.builds(Pose, vectors, vectors.map(rotation_from_rotvec))


def matrix(pose):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = pose.rotation, pose.position
    return result


@given(poses, poses)
def test_poses_compose_like_homogeneous_matrices(a, b):
    pairs = ((a @ b, matrix(a) @ matrix(b)), (a @ a.inverse(), np.eye(4)), (a.inverse() @ a, np.eye(4)))
    for found, wanted in pairs:
        np.testing.assert_allclose(matrix(found), wanted, rtol=1e-5, atol=1e-14)


@given(vectors, st.floats(0.0, 1.0))
def test_a_turn_is_a_rotation_about_its_own_axis_and_turns_about_one_axis_add(rotvec, share):
    R = np.array(rotation_from_rotvec(rotvec))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-14)
    assert np.linalg.det(R) > 0.0
    np.testing.assert_allclose(R @ rotvec, rotvec, rtol=1e-5, atol=1e-14)
    assert np.trace(R) == pytest.approx(1.0 + 2.0 * math.cos(math.hypot(*rotvec)), abs=1e-14)
    parts = [rotation_from_rotvec(tuple(part * x for x in rotvec)) for part in (share, 1.0 - share)]
    np.testing.assert_allclose(times(*parts), R, rtol=1e-5, atol=1e-14)


@given(
    directions, st.sampled_from([0.0, 1e-300, 1e-12, 1e-5, 1e-4, 0.1, 1.0, 2.0, 2.7, 3.1, math.pi - 1e-9, math.pi])
)
def test_the_turn_of_a_rotation_gives_it_back(direction, angle):
    """Half a turn has two rotation vectors."""
    rotvec = tuple(angle / math.hypot(*direction) * x for x in direction)
    R = rotation_from_rotvec(rotvec)
    found = rotvec_from_rotation(R)
    assert math.hypot(*found) <= math.pi + 1e-15
    np.testing.assert_allclose(rotation_from_rotvec(found), R, rtol=1e-5, atol=1e-14)
    if angle < 3.0:
        np.testing.assert_allclose(found, rotvec, rtol=1e-5, atol=1e-14)


@given(vectors, st.floats(-1e-6, 1e-6))
def test_rounding_is_taken_out_of_a_rotation(rotvec, error):
    R = np.array(rotation_from_rotvec(rotvec))
    spoilt = tuple(map(tuple, (R + error * np.array([[1, 0.3, 0], [0.2, -1, 0], [0, 0.5, 0.1]])).tolist()))
    again = np.array(orthonormal(spoilt))
    assert np.abs(again @ again.T - np.eye(3)).max() < 1e-11
    assert np.abs(again - R).max() < 3e-6


# --- poses of the UR5e's tip ---

BARE = ArmKinematics(UR5E)
TURNED = ArmKinematics(
    UR5E,
    Pose((0.3, -0.2, 0.1), rotation_from_rotvec((0.2, -0.5, 1.0))),
    Pose((0.01, 0.02, 0.1), rotation_from_rotvec((3.0, 0.3, 0.1))),
)
angles = st.tuples(*[st.floats(-2.0 * math.pi, 2.0 * math.pi)] * 6)


@pytest.mark.parametrize(
    ("degrees", "position"),
    [
        ((0, 0, 0, 0, 0, 0), (-0.8172, -0.2329, 0.0628)),
        ((0, -90, 0, -90, 0, 0), (0.0, -0.2329, 1.0794)),
        ((-90, -90, 90, -90, -90, 0), (-0.1333, 0.4919, 0.4879)),
    ],
)
def test_poses_that_can_be_read_off_the_drawing(degrees, position):
    pose = BARE.pose(np.radians(degrees))
    assert pose.position == pytest.approx(position, abs=1e-15)
    assert degrees[0] == 0 or np.array(pose.rotation)[:, 2] == pytest.approx((0, 0, -1))  # it looks down


@pytest.mark.slow
@given(angles, angles)
def test_base_and_tip_are_set_before_and_behind_the_arm_and_velocity_is_linear_in_the_joints(q, rates):
    expected = TURNED.pose_base_robot @ BARE.pose(q) @ TURNED.pose_flange_tip
    np.testing.assert_allclose(matrix(TURNED.pose(q)), matrix(expected), rtol=1e-5, atol=1e-14)
    v, w = TURNED.velocity(q, rates)
    np.testing.assert_allclose(v + w, TURNED.jacobian(q) @ rates, rtol=1e-5, atol=1e-13)


def test_arms_of_any_number_of_joints_and_with_offsets():
    """Two links in a plane, the second bent by its offset."""
    limits = (JointLimits(-3.0, 3.0, 1.0, 1.0),) * 2
    rows = (DHRow(0.5, 0.0, 0.0), DHRow(0.25, 0.1, 0.0, offset=math.pi / 2.0))
    planar = ArmKinematics(arm_of_rows("planar", rows, limits))
    assert planar.pose((0.0, 0.0)).position == pytest.approx((0.5, 0.25, 0.1), abs=1e-15)
    assert planar.jacobian((0.0, 0.0)).shape == (6, 2)
    assert planar.jacobian((0.0, 0.0))[:, 0] == pytest.approx((-0.25, 0.5, 0, 0, 0, 1), abs=1e-15)


# --- poses of a held object, from the fingertips ---

lengths = st.floats(-0.05, 0.05)
shifts = st.tuples(lengths, lengths, lengths)
turns = st.tuples(*[st.floats(-0.5, 0.5)] * 3)
CORNERS = [(0.03, 0.0, 0.0), (-0.02, 0.03, 0.0), (-0.01, -0.02, 0.01), (0.0, 0.0, -0.03)]
ENDS = [(0.03, 0.0, 0.0), (-0.03, 0.0, 0.0)]


def moved(pose, points):
    return [(pose @ Pose(point)).position for point in points]


@settings(max_examples=100)
@given(shifts, turns, shifts, turns, st.integers(3, 4))
def test_a_held_object_moves_rigidly_with_three_fingertips_or_more(position, rotvec, at, turned, count):
    motion, object_pose = Pose(position, rotation_from_rotvec(rotvec)), Pose(at, rotation_from_rotvec(turned))
    found = HeldFrame(CORNERS[:count], object_pose).pose(moved(motion, CORNERS[:count]))
    wanted = motion @ object_pose
    np.testing.assert_allclose(found.position, wanted.position, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(found.rotation, wanted.rotation, rtol=0.0, atol=1e-11)


@settings(max_examples=100)
@given(shifts, turns)
def test_two_fingertips_turn_it_no_more_than_their_line(position, rotvec):
    """Every point of that line moves with the fingertips."""
    motion = Pose(position, rotation_from_rotvec(rotvec))
    found = HeldFrame(ENDS, Pose()).pose(moved(motion, ENDS))
    points = [(share, 0.0, 0.0) for share in (-0.03, 0.01, 0.03)]
    np.testing.assert_allclose(moved(found, points), moved(motion, points), rtol=0.0, atol=1e-12)
    R = np.array(found.rotation)
    about = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    assert about @ (R[:, 0] + [1.0, 0.0, 0.0]) == pytest.approx(0.0, abs=1e-12)
