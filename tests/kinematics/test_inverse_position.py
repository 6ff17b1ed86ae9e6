"""Joint positions that hold a pose: near the seed, within the ranges, and a clear word where there are none."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.kinematics import UR5E, ArmKinematics, Pose, nearest_joint_position
from palpate.kinematics.pose import rotation_from_rotvec

ARM = ArmKinematics(UR5E, Pose((0.3, -0.2, 0.1), rotation_from_rotvec((0.2, -0.5, 1.0))), Pose((0.01, 0.02, 0.1)))
BARE = ArmKinematics(UR5E)
DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
free = st.floats(-math.pi, math.pi)
joints = st.tuples(free, free, free, free, free, free)


def error(kinematics, q, wanted):
    found = kinematics.pose(q)
    return max(
        np.abs(np.subtract(found.position, wanted.position)).max(),
        np.abs(np.subtract(found.rotation, wanted.rotation)).max(),
    )


@settings(deadline=None)
@given(joints, joints)
def test_every_pose_of_the_arm_is_held_from_any_seed_and_leads_back_to_its_joints(q, seed):
    wanted = ARM.pose(q)
    found = nearest_joint_position(ARM, wanted, seed)
    assert error(ARM, found, wanted) < 4e-12
    assert np.all(np.abs(found) <= 2.0 * math.pi)
    assert nearest_joint_position(ARM, wanted, q) == pytest.approx(q, abs=1e-12)


@given(st.tuples(*[st.floats(-2.0 * math.pi, 2.0 * math.pi)] * 6))
@settings(deadline=None)
def test_whole_turns_are_chosen_by_the_seed(seed):
    found = nearest_joint_position(BARE, Pose((-0.1333, 0.45, 0.3), DOWN), seed)
    off = np.subtract(found, seed)
    turned = found - 2.0 * math.pi * np.sign(off)  # the next one, which may be beyond the joint's range
    assert np.all((np.abs(off) <= math.pi + 1e-9) | (np.abs(turned) > 2.0 * math.pi - 1e-9))


@pytest.mark.parametrize("fifth", [0.0, 1e-9, 1e-5, -1e-3, math.pi, math.pi - 1e-8])
@pytest.mark.parametrize("third", [1.2, 1e-9, 0.0, -1e-6])
def test_singular_poses_are_held_as_well(fifth, third):
    q = (0.3, -1.0, third, -0.5, fifth, 0.4)
    near = tuple(x + 0.01 for x in q)
    assert error(ARM, nearest_joint_position(ARM, ARM.pose(q), near), ARM.pose(q)) < 4e-12
