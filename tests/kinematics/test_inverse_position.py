"""Joint angles that hold a pose: all of them, the nearest first, and a clear word where there are none."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.kinematics import (
    UR5E,
    ArmKinematics,
    DHRow,
    InverseVelocity,
    JointLimits,
    Pose,
    all_joint_positions,
    nearest_joint_position,
)
from palpate.kinematics.pose import rotation_from_rotvec

ARM = ArmKinematics(UR5E, Pose((0.3, -0.2, 0.1), rotation_from_rotvec((0.2, -0.5, 1.0))), Pose((0.01, 0.02, 0.1)))
BARE = ArmKinematics(UR5E)
HOME = (0.0, -1.5, 1.6, -1.7, -1.57, 0.0)
DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
free = st.floats(-math.pi, math.pi)
joints = st.tuples(free, free, free, free, free, free)


def error(kinematics, q, wanted):
    found = kinematics.pose(q)
    return max(
        np.abs(np.subtract(found.position, wanted.position)).max(),
        np.abs(np.subtract(found.rotation, wanted.rotation)).max(),
    )


@given(joints)
def test_every_solution_holds_the_pose_and_the_nearest_comes_first(q):
    wanted = ARM.pose(q)
    answers = all_joint_positions(ARM, wanted, q)
    assert 1 <= len(answers) <= 8
    assert max(error(ARM, each, wanted) for each in answers) < 3e-12
    distances = [math.dist(each, q) for each in answers]
    assert distances == sorted(distances)


@given(joints)
def test_a_pose_taken_from_the_arm_leads_back_to_its_joints(q):
    """Where they are determined: away from singular poses. Then answers come in pairs and fours too."""
    assume(InverseVelocity(ARM).solve(q, (0.0,) * 3, (0.0,) * 3).smallest_singular_value > 1e-3)
    answers = all_joint_positions(ARM, ARM.pose(q), q)
    assert answers[0] == pytest.approx(q, abs=1e-8)
    assert len(answers) % 2 == 0


def test_all_eight_postures_are_found():
    wanted = Pose((-0.1333, 0.45, 0.3), DOWN)
    answers = all_joint_positions(BARE, wanted, HOME)
    assert len(answers) == 8
    postures = {(round(math.sin(q[0]), 6), math.sin(q[2]) > 0.0, math.sin(q[4]) > 0.0) for q in answers}
    assert len(postures) == 8


@given(st.tuples(*[st.floats(-2.0 * math.pi, 2.0 * math.pi)] * 6))
def test_whole_turns_are_chosen_by_the_seed_within_the_ranges(seed):
    wanted = Pose((-0.1333, 0.45, 0.3), DOWN)
    for q in all_joint_positions(BARE, wanted, seed):
        assert np.all(np.abs(q) <= 2.0 * math.pi)
        assert np.all(np.abs(np.subtract(q, seed)) <= 2.0 * math.pi)
        assert error(BARE, q, wanted) < 3e-12


@pytest.mark.parametrize("fifth", [0.0, 1e-9, 1e-5, -1e-3, math.pi, math.pi - 1e-8])
@pytest.mark.parametrize("third", [1.2, 1e-9, 0.0, -1e-6])
def test_singular_poses_are_held_as_well(fifth, third):
    """What the pose leaves open is taken from the seed."""
    q = (0.3, -1.0, third, -0.5, fifth, 0.4)
    answer = nearest_joint_position(ARM, ARM.pose(q), q)
    assert error(ARM, answer, ARM.pose(q)) < 3e-12
    assert answer == pytest.approx(q, abs=1e-3 if abs(third) < 1e-3 else 1e-5)


def test_out_of_reach_says_how_far_and_what_the_reach_is():
    with pytest.raises(
        InvalidValueError, match=r"wrist would be 1\.\d+ m from the shoulder, and reaches .* 0\.8172"
    ):
        nearest_joint_position(BARE, Pose((1.5, 0.2, 0.1), DOWN), HOME)
    with pytest.raises(InvalidValueError, match=r"axis of joint 1, which passes it at 0\.1333 m or more"):
        nearest_joint_position(BARE, Pose((0.05, 0.0, 0.5), DOWN), HOME)


def test_ranges_count_as_reach():
    limits = tuple(JointLimits(-0.1, 0.1, 1.0, 1.0) for _ in range(6))
    narrow = ArmKinematics(replace(UR5E, limits=limits))
    with pytest.raises(InvalidValueError, match="only with joints beyond their ranges"):
        nearest_joint_position(narrow, Pose((-0.1333, 0.45, 0.3), DOWN), (0.0,) * 6)


def test_other_builds_and_bad_values_are_refused():
    calibrated = replace(UR5E, rows=(replace(UR5E.rows[0], a=1e-4), *UR5E.rows[1:]))
    with pytest.raises(InvalidValueError, match="build"):
        nearest_joint_position(ArmKinematics(calibrated), Pose((0.4, 0.2, 0.3), DOWN), HOME)
    rows = (*UR5E.rows[:5], DHRow(0.0, 0.1, 0.0, offset=0.1))
    with pytest.raises(InvalidValueError, match="build"):
        nearest_joint_position(ArmKinematics(replace(UR5E, rows=rows)), Pose((0.4, 0.2, 0.3), DOWN), HOME)
    with pytest.raises(InvalidValueError, match="seed"):
        nearest_joint_position(BARE, Pose((0.4, 0.2, 0.3), DOWN), (9.0,) * 6)
    with pytest.raises(InvalidValueError, match="pose_base_tip"):
        nearest_joint_position(BARE, Pose((math.nan, 0.2, 0.3), DOWN), HOME)
