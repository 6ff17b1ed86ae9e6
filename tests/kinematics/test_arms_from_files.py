"""Arms from files against MuJoCo's own forward kinematics, and paths that they follow."""

import math

import mujoco
import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.kinematics import (
    ArmKinematics,
    InverseVelocity,
    Limit,
    Pose,
    StandingArm,
    follow_path,
    nearest_joint_position,
)
from palpate.kinematics.velocity import THRESHOLD
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN
from support.file_arms import GANTRY, OWN, SCARA, own_arm, written

TIP = Pose((0.01, 0.02, 0.1))
PERIOD, SPEED = 1e-3, 0.05


@pytest.fixture(params=[*OWN, "scara", "gantry"])
def model(request, tmp_path):
    own = {"scara": SCARA, "gantry": GANTRY}
    return written(tmp_path, own[request.param]).read() if request.param in own else own_arm(request.param)


class Mujoco:
    """Where MuJoCo has the tip of an arm alone."""

    def __init__(self, model):
        self.model = model.spec.compile()
        self.data = mujoco.MjData(self.model)
        self.body, self.flange = model.flange, model.pose_body_flange

    def tip(self, q):
        self.data.qpos[:] = q
        mujoco.mj_kinematics(self.model, self.data)
        body = self.data.body(self.body)
        pose = Pose(tuple(body.xpos), tuple(map(tuple, body.xmat.reshape(3, 3)))) @ self.flange @ TIP
        return np.array(pose.position), np.array(pose.rotation)


def postures(model, count):
    """Anywhere; with one joint at an end of its range; with one where arms are straight."""
    rng = np.random.default_rng(0)
    lower, upper = np.array([(each.lower, each.upper) for each in model.arm.limits]).T
    for i in range(count):
        q, k = rng.uniform(lower, upper), rng.integers(len(lower))
        if i % 4 == 1:
            q[k] = rng.choice([lower[k], upper[k]])
        if i % 4 == 2:
            q[k] = np.clip(rng.choice([0.0, 1e-9, 1e-4]), lower[k], upper[k])
        direction = rng.normal(size=3)
        yield q, SPEED * direction / np.linalg.norm(direction)


def test_the_tip_moves_as_commanded_and_no_joint_beyond_its_limits(model):
    truth, kinematics = Mujoco(model), ArmKinematics(model.arm, pose_flange_tip=TIP)
    inverse = InverseVelocity(kinematics, home=model.home)
    lower, upper, speed = np.array([(each.lower, each.upper, each.speed) for each in model.arm.limits]).T
    exact = 0
    for q, v in postures(model, 400):
        motion = inverse.solve(q.tolist(), tuple(v.tolist()), (0.0, 0.0, 0.0))
        there = q + PERIOD * np.array(motion.joint_velocity)
        assert np.all(np.abs(motion.joint_velocity) <= speed)
        assert np.all((lower <= there) & (there <= upper))
        before, after = truth.tip(q), truth.tip(there)
        assert motion.pose_base_tip.position == pytest.approx(before[0], abs=1e-13)
        # also where it is not as wanted, the motion is as reported
        assert after[0] == pytest.approx(before[0] + PERIOD * np.array(motion.velocity), abs=3e-5)
        assert (motion.limit is Limit.NONE) == (motion.scale == 1.0)
        if motion.smallest_singular_value >= inverse.threshold:
            exact += 1
            assert after[0] == pytest.approx(before[0] + PERIOD * motion.scale * v, abs=1e-6)
    assert exact > 200


def test_the_jacobian_is_the_derivative_of_mujoco_s_pose(model):
    truth, kinematics = Mujoco(model), ArmKinematics(model.arm, pose_flange_tip=TIP)
    h = 1e-6
    for q, _ in postures(model, 20):
        J = kinematics.jacobian(q.tolist())
        for k in range(len(q)):
            step = h * np.eye(len(q))[k]
            (ahead, turned), (behind, back) = truth.tip(q + step), truth.tip(q - step)
            assert (ahead - behind) / (2.0 * h) == pytest.approx(J[:3, k], abs=1e-8)
            spin = (turned - back) @ truth.tip(q)[1].T / (2.0 * h)
            assert (spin[2, 1], spin[0, 2], spin[1, 0]) == pytest.approx(J[3:, k], abs=1e-8)


def test_joints_that_the_tip_leaves_free_go_home_while_it_moves_and_rest_while_it_rests():
    model = own_arm("panda.xml")
    kinematics = ArmKinematics(model.arm, pose_flange_tip=TIP)
    inverse = InverseVelocity(kinematics, home=model.home)
    J = kinematics.jacobian(model.home)
    away = np.array(model.home) + 0.3 * np.linalg.svd(J)[2][-1]
    assert inverse.solve(away.tolist(), (0.0,) * 3, (0.0,) * 3).joint_velocity == (0.0,) * 7
    q, start = away, kinematics.pose(away.tolist()).position
    for i in range(4000):
        motion = inverse.solve(q.tolist(), (0.05 if i % 2 else -0.05, 0.0, 0.0), (0.0,) * 3)
        q = q + 1e-3 * np.array(motion.joint_velocity)
    assert np.linalg.norm(q - model.home) < 0.8 * 0.3
    assert kinematics.pose(q.tolist()).position == pytest.approx(start, abs=2e-4)


def test_an_arm_of_few_joints_moves_its_tip_and_does_not_pretend_to_turn_it(tmp_path):
    model = written(tmp_path, GANTRY).read()
    inverse = InverseVelocity(ArmKinematics(model.arm))
    assert not inverse.turns
    motion = inverse.solve((0.0,) * 3, (0.01, -0.02, 0.03), (1.0, 0.0, 0.0))
    assert motion.joint_velocity == pytest.approx((0.01, -0.02, 0.03))
    assert motion.angular_velocity == (0.0, 0.0, 0.0)
    assert motion.smallest_singular_value == pytest.approx(1.0)


@pytest.fixture
def gantry(tmp_path):
    """Slides of +-0.3 m and 0.5 m/s along x, y and z, all at 0."""
    return StandingArm(ArmKinematics(written(tmp_path, GANTRY).read().arm), (0.0, 0.0, 0.0))


def test_limits_that_slides_approach_are_where_the_path_approaches_them(gantry):
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
