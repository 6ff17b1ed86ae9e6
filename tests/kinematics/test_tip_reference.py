"""The reference of a tip: where it is wanted, never far from where the arm is, never beyond what joints may do."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.kinematics import UR5E, ArmKinematics, FollowingErrorLimit, InverseVelocity, Limit, Pose, TipReference
from palpate.kinematics.pose import rotation_from_rotvec, rotvec_from_rotation, times, transposed
from palpate.kinematics.reference_kernel import MAX_LEAD

KINEMATICS = ArmKinematics(UR5E, pose_flange_tip=Pose((0.0, 0.0, 0.1)))
INVERSE = InverseVelocity(KINEMATICS)
START = (-1.57, -1.6, 1.8, -1.8, -1.57, 0.2)
STILL = (0.0, 0.0, 0.0)
DT = 1e-3


def started(start=START, following_error_limit=None, dt=DT):
    reference = TipReference(INVERSE, dt, following_error_limit)
    reference.start(start)
    return reference


def angle_between(a, b):
    return math.hypot(*rotvec_from_rotation(times(a, transposed(b))))


def test_an_arm_that_follows_is_led_along_the_integral_of_the_twist():
    """A circle with a swing of the wrist: the joints hold what the tip's reference says, without drift."""
    reference = started()
    position, rotation = np.array(reference.pose_base_tip.position), reference.pose_base_tip.rotation
    for i in range(2000):
        a = 2.0 * math.pi * i / 1000
        v = (0.05 * math.cos(a), 0.05 * math.sin(a), 0.01)
        w = (0.3 * math.cos(a), 0.0, 0.3 * math.sin(a))
        reference.step(reference.joint_reference, v, w)
        position += DT * np.array(v)
        rotation = times(rotation_from_rotvec(tuple(DT * x for x in w)), rotation)
    assert reference.pose_base_tip.position == pytest.approx(position, abs=1e-12)
    assert angle_between(reference.pose_base_tip.rotation, rotation) < 1e-12
    held = KINEMATICS.pose(reference.joint_reference)
    assert math.dist(held.position, position) < 5e-6
    assert angle_between(held.rotation, rotation) < 2e-5


@pytest.mark.parametrize(
    "following_error_limit", [FollowingErrorLimit(0.0005, 0.005), FollowingErrorLimit(0.002, 0.02)]
)
def test_the_reference_runs_ahead_of_an_arm_held_fast_by_the_leash_and_comes_back_at_once(following_error_limit):
    reference, stuck = started(following_error_limit=following_error_limit), KINEMATICS.pose(START)
    for _ in range(1000):
        reference.step(START, (0.0, 0.03, -0.04), (0.1, 0.0, 0.0))
    held = KINEMATICS.pose(reference.joint_reference)
    assert math.dist(held.position, stuck.position) == pytest.approx(following_error_limit.distance, rel=0.01)
    assert angle_between(held.rotation, stuck.rotation) == pytest.approx(following_error_limit.angle, rel=0.01)
    assert reference.joint_feed_forward == pytest.approx((0.0,) * 6, abs=1e-3)
    periods = math.ceil(2.0 * following_error_limit.distance / 0.05 / DT) + 5
    for _ in range(periods):
        reference.step(START, (0.0, -0.03, 0.04), STILL)
    back = np.subtract(KINEMATICS.pose(reference.joint_reference).position, stuck.position)
    assert back @ (0.0, -0.6, 0.8) > 0.9 * following_error_limit.distance


@settings(deadline=None)
@given(st.lists(st.tuples(*[st.floats(-1.0, 1.0)] * 6), min_size=1, max_size=30))
def test_no_twist_takes_it_off_the_limit(twists):
    reference, stuck = started(dt=0.01), KINEMATICS.pose(START)
    limit = reference.following_error_limit
    for twist in twists:
        reference.step(START, twist[:3], twist[3:])
        assert all(abs(speed) <= math.pi for speed in reference.motion.joint_velocity)
        lead = math.dist(reference.pose_base_tip.position, stuck.position)
        assert lead <= MAX_LEAD * limit.distance * 1.000001
        assert angle_between(reference.pose_base_tip.rotation, stuck.rotation) <= limit.angle * 1.000001


def test_an_arm_that_is_pushed_away_takes_its_reference_along_without_feed_forward():
    reference, q = started(), np.array(START)
    for _ in range(500):
        q = q + DT * np.array((0.1, 0.0, 0.0, 0.0, 0.0, 0.0))
        reference.step(tuple(q.tolist()), STILL, STILL)
        assert reference.joint_feed_forward == (0.0,) * 6
    off = math.dist(KINEMATICS.pose(reference.joint_reference).position, KINEMATICS.pose(q).position)
    assert off < 1.01 * MAX_LEAD * reference.following_error_limit.distance


def test_where_joints_are_too_slow_the_tip_keeps_to_its_line():
    """Close past a straight wrist, at a speed that joints cannot make."""
    start = (0.0, -1.3, 1.7, -1.0, 0.35, 0.0)
    reference = started(start, FollowingErrorLimit(0.02, 0.2))  # long: a taut one pulls sideways too
    begin, line = np.array(reference.pose_base_tip.position), np.array((0.0, -0.6, 0.8))
    slowed, ahead = [], []
    for _ in range(400):
        reference.step(reference.joint_reference, tuple(1.5 * line), STILL)
        slowed.append(reference.motion.limit is Limit.JOINT_SPEED)
        assert max(map(abs, reference.motion.joint_velocity)) <= math.pi
        held = KINEMATICS.pose(reference.joint_reference).position
        ahead.append(math.dist(reference.pose_base_tip.position, held))
    assert sum(slowed) > 50
    # it waits for the joints, not for its following-error limit
    assert max(ahead) < 0.25 * reference.following_error_limit.distance
    way = np.subtract(reference.pose_base_tip.position, begin)
    assert np.linalg.norm(way - (way @ line) * line) < 1e-12
    assert 0.05 < way @ line < 0.6 * 0.99


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_values_that_are_not_finite_leave_the_reference_where_it_is(bad):
    reference = started()
    reference.step(START, (0.0, 0.0, -0.05), STILL)
    before = reference.joint_reference, reference.pose_base_tip
    for bad_input in (
        (START, (bad, 0.0, 0.0), STILL),
        (START, STILL, (0.0, bad, 0.0)),
        ((bad,) * 6, STILL, STILL),
    ):
        reference.step(*bad_input)
        assert (reference.motion.limit, reference.motion.joint_velocity) == (Limit.INVALID, (0.0,) * 6)
        assert reference.joint_feed_forward == (0.0,) * 6
        assert (reference.joint_reference, reference.pose_base_tip) == before
    for _ in range(1000):
        reference.step(START, (0.0, 0.0, -0.05), STILL)
    assert reference.motion.limit is Limit.NONE
    # an obstacle that stops the tip does not turn it
    assert reference.pose_base_tip.rotation == KINEMATICS.pose(START).rotation


def test_a_reference_beyond_the_end_of_a_range_does_not_hold_the_arm_there():
    """A reference left outside pulls harder than a slow way back: it has to be forgotten."""
    start = (2.0 * math.pi, *START[1:])
    reference = started(start)
    J = KINEMATICS.jacobian(start)[:, 0]
    here = reference.pose_base_tip
    outside = tuple((np.array(here.position) + 0.9e-3 * J[:3] / np.linalg.norm(J[:3])).tolist())
    reference.state[12:15] = outside
    for _ in range(1000):
        v, w = tuple((-0.02 * J[:3]).tolist()), tuple((-0.02 * J[3:]).tolist())
        reference.step(reference.joint_reference, v, w)
    assert reference.joint_reference[0] == pytest.approx(2.0 * math.pi - 0.02, abs=2e-3)
