"""Joint positions and velocities of poses and twists: exact where they can be, bounded everywhere."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from palpate.kinematics import UR5E, ArmKinematics, InverseVelocity, Limit, Pose, kernel, nearest_joint_position
from palpate.kinematics.pose import rotation_from_rotvec

KINEMATICS = ArmKinematics(UR5E, pose_flange_tip=Pose((0.0, 0.02, 0.1)))
INVERSE = InverseVelocity(KINEMATICS)
SPEED = math.pi
WEIGHT = np.array([1.0 / INVERSE.length] * 3 + [1.0] * 3)

tiny = st.sampled_from([0.0, 1e-300, 1e-15, 1e-9, -1e-6, 1e-4, 0.01, -0.05, 0.1])
free = st.floats(-math.pi, math.pi)
anywhere = st.tuples(free, free, free, free, free, free)
straight_wrist = st.tuples(free, free, free, free, tiny, free)
flipped_wrist = st.tuples(free, free, free, free, tiny.map(lambda x: math.pi + x), free)
straight_elbow = st.tuples(free, free, tiny, free, free, free)
all_straight = st.tuples(free, free, tiny, free, tiny, free)
poses = st.one_of(anywhere, straight_wrist, flipped_wrist, straight_elbow, all_straight)
component = st.one_of(st.floats(-1.0, 1.0), st.sampled_from([0.0, 1e-320, 1e-12, 30.0, -1e6, 1e150, 1e307]))
twists = st.tuples(*[component] * 6)
slow = st.tuples(*[st.floats(-0.05, 0.05)] * 6)


def solve(q, twist, inverse=INVERSE):
    return inverse.solve(q, tuple(twist[:3]), tuple(twist[3:]))


WRIST = ArmKinematics(UR5E, pose_flange_tip=Pose((0.0, 0.0, -0.0996)))  # where axes 5 and 6 meet


def over_shoulder(q1, q2):
    """A pose with that point beside the axis of joint 1, so that joints 2 to 4 cannot shift it past."""

    def out(q3):
        return WRIST.pose((0.0, q2, q3, 0.0, -1.57, 0.0)).position[0]

    return (q1, q2, brentq(out, 0.0, -q2, xtol=1e-15), 0.0, -1.57, 0.0)


@pytest.mark.slow
@settings(max_examples=500)
@given(poses, twists)
def test_no_joint_exceeds_its_speed_for_any_twist_at_any_pose(q, twist):
    motion = solve(q, twist)
    assert all(abs(speed) <= SPEED for speed in motion.joint_velocity)  # false for NaN
    assert 0.0 <= motion.scale <= 1.0
    assert math.isfinite(motion.smallest_singular_value)
    assert all(map(math.isfinite, motion.velocity + motion.angular_velocity))


@pytest.mark.parametrize("q2", [-2.3, -2.0, -1.8])
def test_no_joint_exceeds_its_speed_over_the_shoulder(q2):
    q = over_shoulder(0.4, q2)
    assert solve(q, (0.0,) * 6).smallest_singular_value < 1e-9
    for twist in 1e3 * np.random.default_rng(0).normal(size=(200, 6)):
        assert max(map(abs, solve(q, twist).joint_velocity)) <= SPEED


@given(poses, slow)
def test_the_motion_reported_is_true_bounded_and_exact_away_from_singularities(q, twist):
    motion, J = solve(q, twist), KINEMATICS.jacobian(q)
    expected = np.linalg.svd(WEIGHT[:, None] * J, compute_uv=False)[-1]
    assert motion.smallest_singular_value == pytest.approx(expected, abs=1e-14)
    assert np.allclose(J @ motion.joint_velocity, motion.velocity + motion.angular_velocity, atol=1e-13)
    assert (motion.limit is Limit.NONE) == (motion.scale == 1.0) == (motion.joint is None)
    bound = 1.2991 * np.linalg.norm(WEIGHT * twist) / INVERSE.threshold
    assert np.linalg.norm(motion.joint_velocity) <= bound + 1e-300
    assert motion.pose_base_tip == KINEMATICS.pose(q)
    if expected >= INVERSE.threshold:
        assert np.allclose(J @ motion.joint_velocity, np.multiply(motion.scale, twist), atol=1e-13)


@pytest.mark.slow
@settings(suppress_health_check=[HealthCheck.filter_too_much])
@given(poses, slow)
def test_damping_loses_exactly_the_share_of_the_formula(q, twist):
    """Against numpy's singular value decomposition; where the fading towards singularities plays no part."""
    motion = solve(q, twist)
    U, s, Vt = np.linalg.svd(WEIGHT[:, None] * KINEMATICS.jacobian(q))
    x = s / INVERSE.threshold
    assume(x[-1] > 0.2)
    gain = np.where(x < 1.0, 4.0 * x / (INVERSE.threshold * (1.0 + x**2) ** 2), 1.0 / s)
    expected = Vt.T @ (gain * (U.T @ (WEIGHT * twist)))
    assert np.allclose(motion.joint_velocity, motion.scale * expected, atol=1e-10)
    lost = 1.0 - s * gain
    assert np.allclose(lost[x < 1.0], ((1.0 - x**2) / (1.0 + x**2))[x < 1.0] ** 2)


@settings(suppress_health_check=[HealthCheck.filter_too_much])  # twists of every size are drawn, also absurd ones
@given(poses, twists, st.floats(1e-3, 1e3))
def test_a_faster_twist_takes_the_same_path(q, twist, factor):
    """Scaled, not bent: the joint velocities of parallel twists are parallel, and grow with them up to a limit."""
    assume(1e-6 < max(map(abs, twist)) < 1e6)
    a, b = solve(q, twist), solve(q, np.multiply(factor, twist))
    one, other = np.array(a.joint_velocity), np.array(b.joint_velocity)
    product = np.linalg.norm(one) * np.linalg.norm(other)
    assert one @ other == pytest.approx(product, rel=1e-12, abs=1e-300)
    assert a.limit in (Limit.NONE, b.limit) or factor < 1.0
    if a.limit is b.limit:
        expected = factor * one if a.limit is Limit.NONE else one
        assert other == pytest.approx(expected, rel=1e-9, abs=1e-12 * np.abs(expected).max() + 1e-300)
        if a.limit is Limit.JOINT_SPEED:
            assert a.scale == pytest.approx(b.scale * factor, rel=1e-9)
            assert abs(a.joint_velocity[a.joint]) == pytest.approx(SPEED)


@settings(max_examples=300)
@given(poses, slow, slow, st.sampled_from([1e-5, 1e-7]))
def test_joint_velocities_are_continuous_in_twist_and_pose(q, twist, direction, step):
    """Lipschitz: the bound is what damping (1/threshold^2 in the pose) and fading (1/bend) allow."""
    here = np.array(solve(q, twist).joint_velocity)
    there = solve(q, np.add(twist, np.multiply(step, direction))).joint_velocity
    # scaling to the speed limit can turn a change by at most the ratio of its norms
    bound = 6.0 * 1.3 / INVERSE.threshold * np.linalg.norm(WEIGHT * direction)
    assert np.linalg.norm(there - here) <= bound * step + 1e-13
    s = np.linalg.svd(WEIGHT[:, None] * KINEMATICS.jacobian(q), compute_uv=False)
    assume(s[-2] > 0.2 * INVERSE.threshold or s[-2] - s[-1] > 1e-3)
    moved = np.array(solve(np.add(q, np.multiply(step, direction)), twist).joint_velocity)
    assert np.linalg.norm(moved - here) <= 2e5 * step * np.linalg.norm(WEIGHT * twist) + 1e-12


@pytest.mark.parametrize("joint", range(6))
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_joint_slows_down_before_the_end_of_its_range_and_may_come_back(joint, side):
    """Driven outward for long, it ends at the end; driven back, it returns at once."""
    rates = np.zeros(6)
    rates[joint] = side
    q = np.array([0.3, -1.2, 1.4, -0.7, 1.0, 0.2])
    q[joint] = side * (2.0 * math.pi - 0.4)
    dt, speeds = 0.01, []
    for _ in range(600):
        motion = solve(q, KINEMATICS.jacobian(q) @ rates)
        speeds.append(motion.joint_velocity[joint] * side)
        q = q + dt * np.array(motion.joint_velocity)
        assert np.all(np.abs(q) <= 2.0 * math.pi)
        if motion.limit is Limit.JOINT_POSITION:
            assert motion.joint == joint
    if motion.smallest_singular_value > INVERSE.threshold:
        assert motion.limit is Limit.JOINT_POSITION
        assert 2.0 * math.pi - abs(q[joint]) < 1e-3
        assert speeds[0] == pytest.approx(1.0)
    back = solve(q, -KINEMATICS.jacobian(q) @ rates)
    assert back.limit is Limit.NONE
    assert back.joint_velocity[joint] * side < -0.3  # the elbow's range ends where it is straight: damped


@given(anywhere, slow)
def test_at_or_beyond_its_end_a_joint_goes_no_further(q, twist):
    for end in (2.0 * math.pi, 2.0 * math.pi + 0.1):
        motion = solve((*q[:3], end, *q[4:]), twist)
        assert motion.joint_velocity[3] <= 0.0
        other = solve((*q[:3], -end, *q[4:]), twist)
        assert other.joint_velocity[3] >= 0.0
        assert min(motion.scale, other.scale) >= 0.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_values_that_are_not_finite_move_nothing(bad):
    fine = (0.1,) * 6
    for q, twist in (
        (fine, (0.0, bad, 0.0, 0.0, 0.0, 0.0)),
        ((*fine[:5], bad), fine),
        (fine, (bad, -bad, *fine[:4])),
    ):
        motion = solve(q, twist)
        assert (motion.limit, motion.joint_velocity) == (Limit.INVALID, (0.0,) * 6)


def test_solving_compiles_nothing_anew():
    compiled: tuple[Any, ...] = (kernel.joint_motion, kernel.tip_frame, kernel.tip_jacobian)
    before = [len(each.signatures) for each in compiled]
    solve([0.1] * 6, (0.1,) * 6)
    solve(np.full(6, 0.1), (0.1,) * 6)
    KINEMATICS.velocity((0.1,) * 6, np.ones(6))
    assert [len(each.signatures) for each in compiled] == before


ARM = ArmKinematics(UR5E, Pose((0.3, -0.2, 0.1), rotation_from_rotvec((0.2, -0.5, 1.0))), Pose((0.01, 0.02, 0.1)))
BARE = ArmKinematics(UR5E)
DOWN = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))


def error(kinematics, q, wanted):
    found = kinematics.pose(q)
    return max(
        np.abs(np.subtract(found.position, wanted.position)).max(),
        np.abs(np.subtract(found.rotation, wanted.rotation)).max(),
    )


@settings(deadline=None)
@given(anywhere, anywhere)
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
