"""Where the UR5e's tip is, against the DH product in 40 digits, and how it moves."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.kinematics import UR5E, ArmKinematics, DHRow, JointLimits, Pose, SerialArm, arm_of_rows
from palpate.kinematics.pose import rotation_from_rotvec

BARE = ArmKinematics(UR5E)
TURNED = ArmKinematics(
    UR5E,
    Pose((0.3, -0.2, 0.1), rotation_from_rotvec((0.2, -0.5, 1.0))),
    Pose((0.01, 0.02, 0.1), rotation_from_rotvec((3.0, 0.3, 0.1))),
)
angles = st.tuples(*[st.floats(-2.0 * math.pi, 2.0 * math.pi)] * 6)

# straight from Universal Robots' table, not from our data: a [m], d [m], alpha in quarter turns
TABLE = [
    ("0", "0.1625", 1),
    ("-0.425", "0", 0),
    ("-0.3922", "0", 0),
    ("0", "0.1333", 1),
    ("0", "0.0997", -1),
    ("0", "0.0996", 0),
]


def dh_product(q):
    """Rz(q) Tz(d) Tx(a) Rx(alpha), joint after joint, in 40 digits; alpha exactly a quarter turn."""
    with mpmath.workdps(40):
        T = mpmath.eye(4)
        for angle, (a, d, quarters) in zip(q, TABLE, strict=True):
            c, s, ca, sa = mpmath.cos(angle), mpmath.sin(angle), int(quarters == 0), quarters
            a, d = mpmath.mpf(a), mpmath.mpf(d)
            T *= mpmath.matrix(
                [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
            )
        return np.array(T.tolist(), dtype=np.float64)


def matrix(pose):
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = pose.rotation, pose.position
    return result


@pytest.mark.slow
def test_the_flange_is_where_the_dh_product_in_40_digits_has_it():
    rng = np.random.default_rng(5)
    worst = 0.0
    for q in rng.uniform(-2.0 * np.pi, 2.0 * np.pi, (1000, 6)).tolist():
        worst = max(worst, np.abs(matrix(BARE.pose(q)) - dh_product(q)).max())
    assert worst < 1e-14  # asked for: 1e-12


@pytest.mark.parametrize(
    ("degrees", "position"),
    [
        ((0, 0, 0, 0, 0, 0), (-0.8172, -0.2329, 0.0628)),
        ((0, -90, 0, -90, 0, 0), (0.0, -0.2329, 1.0794)),
        ((-90, -90, 90, -90, -90, 0), (-0.1333, 0.4919, 0.4879)),
    ],
)
def test_poses_that_can_be_read_off_the_drawing(degrees, position):
    assert BARE.pose(np.radians(degrees)).position == pytest.approx(position, abs=1e-15)


def test_the_last_of_these_points_down():
    assert np.array(BARE.pose(np.radians((-90, -90, 90, -90, -90, 0))).rotation)[:, 2] == pytest.approx((0, 0, -1))


@given(angles)
def test_base_and_tip_are_set_before_and_behind_the_arm(q):
    expected = TURNED.pose_base_robot @ BARE.pose(q) @ TURNED.pose_flange_tip
    assert np.allclose(matrix(TURNED.pose(q)), matrix(expected), atol=1e-14)


@settings(deadline=None)
@given(angles)
def test_the_jacobian_is_the_derivative_of_the_pose(q):
    J, h = TURNED.jacobian(q), 1e-5
    for k in range(6):
        ahead, behind = (
            matrix(TURNED.pose([x + sign * h * (i == k) for i, x in enumerate(q)])) for sign in (1.0, -1.0)
        )
        rate = (ahead - behind) / (2.0 * h)
        spin = rate[:3, :3] @ matrix(TURNED.pose(q))[:3, :3].T
        assert rate[:3, 3] == pytest.approx(J[:3, k], abs=1e-9)
        assert (spin[2, 1], spin[0, 2], spin[1, 0]) == pytest.approx(J[3:, k], abs=1e-9)


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


def test_what_is_no_arm_is_refused():
    with pytest.raises(InvalidValueError, match="one of each"):
        arm_of_rows("short", (DHRow(0.1, 0.0, 0.0),), UR5E.limits)
    with pytest.raises(InvalidValueError, match="no joints"):
        SerialArm("none", ())
    with pytest.raises(InvalidValueError, match="lower"):
        JointLimits(1.0, 1.0, 1.0, 1.0)
    with pytest.raises(InvalidValueError, match="speed"):
        JointLimits(-1.0, 1.0, 0.0, 1.0)
    with pytest.raises(InvalidValueError, match="DH row"):
        DHRow(math.nan, 0.0, 0.0)
    with pytest.raises(InvalidValueError, match=r"joint 3, is 7.0000 rad \(401.1 deg\)"):
        UR5E.joint_position("start", (0.0, 0.0, 7.0, 0.0, 0.0, 0.0))
    with pytest.raises(InvalidValueError, match="shape"):
        UR5E.joint_position("start", (0.0,) * 5)
