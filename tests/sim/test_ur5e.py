"""The simulated UR5e: where it is, what it weighs, how it follows, how it pushes, and what it refuses to do."""

import math

import mujoco
import numpy as np
import pytest

from palpate.kinematics import UR5E, FollowingErrorLimit, Pose, nearest_joint_position
from palpate.kinematics.reference_kernel import MAX_LEAD
from palpate.sim import ArmCarrier, Box, ContactLaw, Fidelity, MujocoBackend, Tip, build_scene
from palpate.sim.carriers.ur5e import ur5e
from palpate.surfaces import Sphere
from support.arm_run import ArmRun
from support.simulated import angle_between, move

TIP = Tip(Sphere(0.008))
GRAVITY = 9.80665
STILL, DOWN = (0.0, 0.0, 0.0), (0.0, 0.0, -0.01)
UPRIGHT = ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
ARM = ur5e(
    pose_flange_tip=Pose((0.0, 0.0, 0.1), UPRIGHT)
)  # the tip frame stands upright while the flange looks down
HOME = tuple(np.radians((-90.0, -90.0, 90.0, -90.0, -90.0, 0.0)).tolist())
ABOVE = nearest_joint_position(ARM.kinematics, Pose((-0.1333, 0.45, 0.3)), HOME)


def model_of(arm=ARM, start=ABOVE, tip=TIP, gravity=GRAVITY):
    """A scene of arm and tip."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 0.5e-3
    spec.option.gravity = [0.0, 0.0, -gravity]
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    flange = arm.add_to(spec, start)
    if tip is not None:
        tip.add_to(flange).gravcomp = 1.0
    return spec.compile()


def turned(a, b):
    """Angle between two orientations [rad]."""
    return float(np.linalg.norm(np.subtract(a.rotation, b.rotation))) / math.sqrt(2.0)


@pytest.mark.parametrize("degree", [True, False])
def test_joint_angles_mean_the_same_whatever_unit_the_scene_is_written_in(degree):
    spec = mujoco.MjSpec()
    spec.compiler.degree = degree
    ARM.add_to(spec, ABOVE)
    model = spec.compile()
    assert model.qpos0 == pytest.approx(ABOVE, abs=1e-14)
    assert model.jnt_range == pytest.approx(np.tile((-2.0 * np.pi, 2.0 * np.pi), (6, 1)))


@pytest.mark.parametrize(
    ("tip", "gravity", "torque"),
    [
        (TIP, 9.81, (0.0, -59.997, -18.555, 0.0, 0.0, 0.0)),
        (None, GRAVITY, (0.0, -59.736, -18.433, 0.0, 0.0, 0.0)),
    ],
)
def test_gravity_torques_are_the_known_ones(tip, gravity, torque):
    """Computed once from the official masses, for 9.81 m/s^2."""
    model = model_of(ur5e(), (0.0,) * 6, tip, gravity)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert data.qfrc_bias == pytest.approx(torque, abs=6e-4)


def test_no_joint_ever_feels_more_of_the_links_than_its_servo_is_made_for():
    model = model_of(ur5e(), HOME, None)
    data, M = mujoco.MjData(model), np.zeros((6, 6))
    rng = np.random.default_rng(3)
    largest = np.zeros(6)
    slowest, fastest = math.inf, 0.0
    stretched = [(0.0, 0.0, 0.0, x, y, 0.0) for x in (0.0, np.pi / 2, np.pi) for y in (0.0, np.pi / 2, np.pi)]
    for q in [*stretched, *rng.uniform(-np.pi, np.pi, (3000, 6))]:
        data.qpos[:] = q
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fullM(model, data, M)
        largest = np.maximum(largest, np.diag(M) - ARM.model.armature)
        frequencies = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, np.diag(ARM.stiffness))).real)
        slowest, fastest = min(slowest, frequencies.min()), max(fastest, frequencies.max())
    assert np.all(largest <= ARM.model.link_inertia)
    assert np.all(largest >= 0.8 * np.array(ARM.model.link_inertia))
    # critically damped by themselves
    damping = -model.actuator_biasprm[:, 2]
    inertia = np.add(ARM.model.armature, ARM.model.link_inertia)
    assert damping / (2.0 * np.sqrt(np.array(ARM.stiffness) * inertia)) == pytest.approx(np.ones(6))
    # joints move one another: damping ratios are these over the bandwidth
    assert slowest > 0.75 * ARM.bandwidth
    assert fastest < 2.3 * ARM.bandwidth


def test_motors_carry_gravity_and_end_at_their_limits():
    model = model_of(ur5e(), (0.0,) * 6, None)
    data = mujoco.MjData(model)
    data.ctrl[:] = data.qpos
    mujoco.mj_forward(model, data)
    assert data.qfrc_actuator[1] == pytest.approx(-59.736, abs=1e-3)
    for sign in (1.0, -1.0):
        data.ctrl[:] = data.qpos + sign
        mujoco.mj_forward(model, data)
        assert data.qfrc_actuator == pytest.approx([sign * limits.torque for limits in UR5E.limits])


def test_a_circle_is_followed_with_its_orientation_kept():
    """50 mm/s, radius 50 mm, from rest. Asked for: 0.5 mm; lag counts."""
    run = ArmRun(model_of(), ARM)
    radius, speed = 0.05, 0.05
    first = run.tip
    center = np.array(first.position) - (radius, 0.0, 0.0)
    following, path, turn = [], [], []
    periods = round(2.0 * math.pi * radius / speed / 1e-3)
    for i in range(periods):
        angle, next_angle = 1e-3 * i * speed / radius, 1e-3 * (i + 1) * speed / radius
        run.period((-speed * math.sin(angle), speed * math.cos(angle), 0.0))
        out = np.subtract(run.tip.position, center)
        wanted = (radius * math.cos(next_angle), radius * math.sin(next_angle), 0.0)
        following.append(np.linalg.norm(out - wanted))
        path.append(math.hypot(math.hypot(out[0], out[1]) - radius, out[2]))
        turn.append(turned(run.tip, first))
    assert max(following) < 0.13e-3  # while it gathers speed
    assert max(following[500:]) < 0.035e-3  # of which 0.025 is that a command holds for a period
    assert max(path) < 0.035e-3
    assert max(turn) < 0.15e-3
    assert following[-1] < 0.035e-3


def sideways(psi, tilt):
    """The flange looks along the axes of joints 2 to 4 (q5 = 0) at q1 = psi, and by `tilt` above them."""
    z = np.array((math.sin(psi) * math.cos(tilt), -math.cos(psi) * math.cos(tilt), math.sin(tilt)))
    x = np.cross((0.0, 0.0, 1.0), z)
    x /= np.linalg.norm(x)
    columns = np.stack([x, np.cross(z, x), z], axis=1).tolist()
    return Pose((-0.5, -0.33, 0.4), tuple(map(tuple, columns)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("tilt", "speed", "error"),
    [(0.0, 0.05, 0.15e-3), (0.003, 0.05, 0.25e-3), (0.02, 0.05, None), (0.02, 1.0, None)],
)
def test_a_straight_wrist_is_passed_with_every_joint_within_its_speed(tilt, speed, error):
    """Nearest to the singularity: right through, 0.2 deg and 1 deg beside; with the true joint speeds."""
    arm = ur5e(pose_flange_tip=Pose((0.0, 0.0, 0.1)))
    near = tuple(np.radians((0.0, -80.0, 100.0, -20.0, 8.0, 0.0)).tolist())
    start = nearest_joint_position(arm.kinematics, sideways(math.radians(10.0), tilt), near)
    run = ArmRun(model_of(arm, start), arm)
    first, smallest, way = run.tip, math.inf, np.zeros(3)
    worst = 0.0
    for _ in range(round(0.2 / speed / 1e-3)):
        motion = run.period((0.0, -speed, 0.0))
        smallest = min(smallest, motion.smallest_singular_value)
        way += (0.0, -1e-3 * speed, 0.0)
        worst = max(worst, float(np.linalg.norm(np.subtract(run.tip.position, first.position) - way)))
    run.check_speeds()
    if speed < 0.1:
        assert smallest < 0.3 * run.drive.reference.inverse.threshold
        assert (
            run.tip.position[1] - first.position[1] < -0.17
        )  # it came through; the following-error limit waited where it had to
        assert turned(run.tip, first) < 1e-4
    if error is not None:
        assert worst < error


def test_the_edge_of_the_reach_is_met_and_left_with_every_joint_within_its_speed():
    arm = ur5e(pose_flange_tip=Pose((0.0, 0.0, 0.1)))
    start = tuple(np.radians((0.0, -60.0, 25.0, -40.0, -90.0, 0.0)).tolist())
    run = ArmRun(model_of(arm, start), arm)
    out = np.subtract(run.tip.position, (0.0, run.tip.position[1], 0.1625))
    out *= 0.05 / np.linalg.norm(out)
    run.go(2500, out)
    before = np.array(run.tip.position)
    still = run.go(100, out)
    assert np.linalg.norm(run.tip.position - before) < 0.1e-3  # at rest, not swinging to and fro
    assert max(map(abs, still.joint_velocity)) < 0.05
    run.go(1000, -out)
    assert (run.tip.position - before) @ out < -0.8 * 0.05**2
    run.check_speeds()


def test_wild_commands_keep_every_joint_within_its_speed():
    run, rng = ArmRun(model_of(), ARM), np.random.default_rng(0)
    for _ in range(15):
        v, w = rng.normal(size=3) * 0.7, rng.normal(size=3) * 4.0
        run.go(100, v, w)
    run.check_speeds()


def pushed(limit, friction, periods):
    """A tip that an arm pushes on a box for some periods, with the sample before and after; its arm and start."""
    arm = ur5e(Pose((0.1333, -0.45, 0.0)), ARM.pose_flange_tip, following_error_limit=limit)
    carrier, start = ArmCarrier(arm), (0.0, 0.0, 0.0283)
    law = ContactLaw(stiffness=100e3, friction=friction)
    backend = MujocoBackend(build_scene(TIP, Box(), law, start, carrier, Fidelity(0.5e-3)), 1e-3)
    first = backend.start().arm
    return backend, first, move(backend, periods, DOWN).arm, carrier, carrier.joint_start(start)


def test_the_following_error_limit_bounds_the_push_against_an_obstacle():
    backend, first, last, carrier, joints = pushed(FollowingErrorLimit(0.0005, 0.005), 0.05, 3000)
    largest = carrier.arm.push(joints, (0.0, 0.0, -1.0))
    assert backend.truth().force[2] == pytest.approx(largest, rel=0.05)
    assert angle_between(last.rotation_base_tip, first.rotation_base_tip) < 0.01
    # no wind-up: backing off frees the tip after following-error limit and depth are taken back
    freed = move(backend, 300, (0.0, 0.0, 0.01)).arm
    assert not backend.truth().touching
    assert math.dist(freed.position_base_tip[:2], first.position_base_tip[:2]) < 2e-3


def test_a_tip_that_pushes_for_long_stays_where_it_is():
    """An arm yields askew; the tip settles, and does not skate along the wall."""
    backend, _, settled, carrier, joints = pushed(FollowingErrorLimit(), 0.3, 2000)
    assert math.dist(move(backend, 1500, DOWN).arm.position_base_tip, settled.position_base_tip) < 0.2e-3
    # the following-error limit allows at most this push, in the stiffest direction
    stiffest = np.linalg.svd(carrier.arm.tip_compliance(joints)[:3, :3], compute_uv=False)[-1]
    assert backend.truth().force[2] < MAX_LEAD * carrier.arm.following_error_limit.distance / stiffest


def test_the_tip_yields_by_its_compliance():
    """A wrench on the tip, at rest: MuJoCo against J K^-1 J'."""
    model = model_of()
    run = ArmRun(model, ARM)
    wrench = np.array((3.0, -2.0, 5.0, 0.1, 0.2, -0.1))
    run.data.body("tip").xfrc_applied[:3] = wrench[:3]
    # MuJoCo applies forces at the centre of mass, which is the tip frame's origin here
    run.data.body("tip").xfrc_applied[3:] = wrench[3:]
    first = run.tip
    run.go(500)
    expected = ARM.tip_compliance(ABOVE) @ wrench
    assert np.subtract(run.tip.position, first.position) == pytest.approx(expected[:3], abs=2e-6)
    spin = np.array(run.tip.rotation) @ np.array(first.rotation).T
    turn = (spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1])
    assert np.divide(turn, 2.0) == pytest.approx(expected[3:], abs=2e-6)
