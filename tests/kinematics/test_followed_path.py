"""A path that is followed beforehand: what joints come near to, where, and what cannot be followed."""

import math

import pytest

from palpate.errors import InvalidValueError
from palpate.kinematics import ArmKinematics, Pose, StandingArm, follow_path, nearest_joint_position
from palpate.kinematics.velocity import THRESHOLD
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN
from support.file_arms import GANTRY, SCARA, own_arm, written


@pytest.fixture
def gantry(tmp_path):
    """Slides of +-0.3 m and 0.5 m/s along x, y and z, all at 0."""
    return StandingArm(ArmKinematics(written(tmp_path, GANTRY).read().arm), (0.0, 0.0, 0.0))


def test_what_slides_come_near_to_is_where_the_path_says(gantry):
    """0.1 m along x and back, then 0.2 m askew along y and z, at 0.1 m/s."""
    path = [(0.1, 0.0, 0.5), (0.0, 0.0, 0.5), (0.0, -0.12, 0.66)]
    found = follow_path(gantry, path, 0.1)
    assert found.room.value == pytest.approx(0.14, abs=2e-3)
    assert found.room.joint == 3
    assert found.room.time == pytest.approx(4.0, abs=0.02)
    assert found.room.position == pytest.approx(path[-1], abs=2e-3)
    assert found.speed.value == pytest.approx(0.2, rel=1e-3)
    assert found.speed.joint == 1
    assert found.singular_value.value == pytest.approx(1.0)


def test_a_path_that_is_too_fast_is_reported(gantry):
    assert follow_path(gantry, [(0.1, 0.0, 0.5)], 0.75).speed.value == pytest.approx(1.5, rel=0.02)


def test_a_path_to_the_end_of_a_range_is_refused(gantry):
    with pytest.raises(
        InvalidValueError,
        match=r"gantry cannot follow the path: 0.02 of joint 2, after 2.8 s of it, at \(0.0, -28.*, 500.0\) mm is "
        r"left to the end of the range, -0.3 to 0.3 .*, must be at least 0.02; place .* smaller region",
    ):
        follow_path(gantry, [(0.0, -0.35, 0.5)], 0.1)


@pytest.mark.parametrize("name", ["ur5e.xml", "panda.xml", "scara"])
def test_the_joints_go_along_without_drift_until_the_arm_is_stretched(name, tmp_path):
    """Back where it began the room is what it was; straight out it ends at a singularity, whose value is named."""
    model = written(tmp_path, SCARA).read() if name == "scara" else own_arm(name)
    kinematics = ArmKinematics(model.arm, Pose(), Pose((0.0, 0.0, 0.05), LOOKING_DOWN))
    joints = model.home
    if name != "scara":
        joints = nearest_joint_position(kinematics, Pose((0.45, 0.0, 0.1)), model.home)
    arm = StandingArm(kinematics, joints)
    x, y, z = arm.position
    there_and_back = [(x + 0.02, y, z), (x, y + 0.02, z), (x, y, z)]
    once = follow_path(arm, there_and_back, 0.05)
    twice = follow_path(arm, there_and_back * 2, 0.05)
    assert twice.room.value == pytest.approx(once.room.value, abs=1e-3)
    assert once.singular_value.value > THRESHOLD
    norm = math.hypot(x, y)
    with pytest.raises(InvalidValueError, match=r"cannot follow the path: .*(singularity after|is left)"):
        follow_path(arm, [(x + 2.0 * x / norm, y + 2.0 * y / norm, z)], 0.05)
