"""Where the UR5e's tip is, read off its drawing, and how it moves."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.kinematics import UR5E, ArmKinematics, DHRow, JointLimits, Pose, arm_of_rows
from palpate.kinematics.pose import rotation_from_rotvec

BARE = ArmKinematics(UR5E)
TURNED = ArmKinematics(
    UR5E,
    Pose((0.3, -0.2, 0.1), rotation_from_rotvec((0.2, -0.5, 1.0))),
    Pose((0.01, 0.02, 0.1), rotation_from_rotvec((3.0, 0.3, 0.1))),
)
angles = st.tuples(*[st.floats(-2.0 * math.pi, 2.0 * math.pi)] * 6)


def matrix(pose):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = pose.rotation, pose.position
    return result


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


@given(angles)
def test_base_and_tip_are_set_before_and_behind_the_arm(q):
    expected = TURNED.pose_base_robot @ BARE.pose(q) @ TURNED.pose_flange_tip
    assert np.allclose(matrix(TURNED.pose(q)), matrix(expected), atol=1e-14)


@pytest.mark.slow
@given(angles, angles)
def test_the_velocity_of_the_tip_is_linear_in_the_joints(q, rates):
    v, w = TURNED.velocity(q, rates)
    assert np.allclose(v + w, TURNED.jacobian(q) @ rates, atol=1e-13)


def test_arms_of_any_number_of_joints_and_with_offsets():
    """Two links in a plane, the second bent by its offset."""
    limits = (JointLimits(-3.0, 3.0, 1.0, 1.0),) * 2
    rows = (DHRow(0.5, 0.0, 0.0), DHRow(0.25, 0.1, 0.0, offset=math.pi / 2.0))
    planar = ArmKinematics(arm_of_rows("planar", rows, limits))
    assert planar.pose((0.0, 0.0)).position == pytest.approx((0.5, 0.25, 0.1), abs=1e-15)
    assert planar.jacobian((0.0, 0.0)).shape == (6, 2)
    assert planar.jacobian((0.0, 0.0))[:, 0] == pytest.approx((-0.25, 0.5, 0, 0, 0, 1), abs=1e-15)
