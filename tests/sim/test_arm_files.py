"""Arms from files: makers' kinematics, the same in MJCF, URDF and a scene; step tests; refused files."""

import math
import warnings
from functools import partial

import mpmath
import mujoco
import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.kinematics import (
    UR5E,
    ArmKinematics,
    FollowingErrorLimit,
    InverseVelocity,
    JointKind,
    Pose,
    TipReference,
)
from palpate.sensing.compensation import SensorPayload
from palpate.sim import ArmCarrier, ArmFile, Fidelity, ServoedArm
from palpate.sim.carriers.arm_carrier import LOOKING_DOWN
from palpate.sim.carriers.arm_file import ARMS
from palpate.sim.carriers.servoed_arm import FLANGE, PREFIX
from palpate.sim.carriers.step_test import step_test
from support.arm_run import ArmRun
from support.file_arms import GANTRY, MOBILE, OWN, SCARA, own_arm, written
from support.refusals import check_refusals

PANDA = [
    ("0", "0.333", 0),
    ("0", "0", -1),
    ("0", "0.316", 1),
    ("0.0825", "0", 1),
    ("-0.0825", "0.384", -1),
    ("0", "0", 1),
    ("0.088", "0", 1),
]
"""a [m], d [m] and alpha in quarter turns, modified: straight from Franka's table, not from our file."""


def xarm6():
    """UFACTORY's table, with offsets of the joint angles [rad]."""
    a2, offset = mpmath.sqrt(mpmath.mpf("284.5") ** 2 + mpmath.mpf("53.5") ** 2) / 1000, mpmath.atan2(284.5, 53.5)
    return [
        ("0", "0.267", 0, 0),
        ("0", "0", -1, -offset),
        (a2, "0", 0, offset),
        ("0.0775", "0.3425", -1, 0),
        ("0", "0", 1, 0),
        ("0.076", "0.097", -1, 0),
    ]


def modified_dh_product(rows, q, last):
    """Rx(alpha) Tx(a) Rz(q) Tz(d), joint after joint, then the flange, in 40 digits."""
    T = mpmath.eye(4)
    for angle, (a, d, quarters, *offset) in zip(q, rows, strict=True):
        turn = mpmath.mpf(angle) + (offset[0] if offset else 0)
        c, s, ca, sa = mpmath.cos(turn), mpmath.sin(turn), int(quarters == 0), quarters
        a, d = mpmath.mpf(a), mpmath.mpf(d)
        T *= mpmath.matrix(
            [[c, -s, 0, a], [s * ca, c * ca, -sa, -d * sa], [s * sa, c * sa, ca, d * ca], [0, 0, 0, 1]]
        )
    flange = mpmath.eye(4)
    flange[2, 3] = mpmath.mpf(last)
    return np.array((T * flange).tolist(), dtype=np.float64)


def check_flange(arm, rows, last, count):
    """Check the pose of an arm's flange at joint positions within its limits against its maker's table."""
    kinematics, rng = ArmKinematics(arm), np.random.default_rng(3)
    for _ in range(count):
        q = [float(rng.uniform(max(each.lower, -6.0), min(each.upper, 6.0))) for each in arm.limits]
        found, expected = kinematics.pose(q), modified_dh_product(rows, q, last)
        assert np.column_stack([found.rotation, found.position]) == pytest.approx(expected[:3], abs=1e-14)


@pytest.mark.parametrize(("name", "flange"), [("panda.xml", "0.107"), ("xarm6.xml", "0")])
def test_the_flange_is_where_its_maker_s_table_has_it(name, flange):
    with mpmath.workdps(40):
        check_flange(own_arm(name).arm, PANDA if name == "panda.xml" else xarm6(), flange, 100)


@pytest.mark.parametrize("name", ["panda", "xarm6"])
def test_a_urdf_gives_the_joint_path_of_the_mjcf(name):
    """Through a turn and a stroke, 600 periods at 50 mm/s and 0.2 rad/s, from the same home."""
    home = own_arm(f"{name}.xml").home
    paths = []
    for ending in ("xml", "urdf"):
        model = ArmFile(ARMS / f"{name}.{ending}", "flange", home).read()
        reference = TipReference(InverseVelocity(ArmKinematics(model.arm), home=home), 1e-3)
        reference.start(np.add(home, 0.05).tolist())
        path = []
        for i in range(600):
            angle = 0.01 * i
            v = (0.05 * math.cos(angle), 0.05 * math.sin(angle), -0.01)
            reference.step(reference.joint_reference, v, (0.0, 0.2 * math.sin(angle), 0.1))
            path.append(reference.joint_reference)
        paths.append(path)
        assert model.link_inertia == own_arm(f"{name}.xml").link_inertia
        assert model.arm.limits == own_arm(f"{name}.xml").arm.limits
    assert np.abs(np.subtract(*paths)).max() < 1e-9
    assert np.abs(np.subtract(paths[0][-1], paths[0][0])).max() > 0.05


UR = {
    "ur3e": ("0.15185", "-0.24355", "-0.2132", "0.13105", "0.08535", "0.0921"),
    "ur5e": ("0.1625", "-0.425", "-0.3922", "0.1333", "0.0997", "0.0996"),
    "ur10e": ("0.1807", "-0.6127", "-0.57155", "0.17415", "0.11985", "0.11655"),
    "ur16e": ("0.1807", "-0.4784", "-0.36", "0.17415", "0.11985", "0.11655"),
    "ur20": ("0.2363", "-0.862", "-0.7287", "0.201", "0.1593", "0.1543"),
    "ur30": ("0.2363", "-0.637", "-0.5037", "0.201", "0.1593", "0.1543"),
}
"""d1, a2, a3, d4, d5, d6 [m]: straight from Universal Robots' tables, not from our files."""


@pytest.mark.parametrize("name", [*UR, "built in"])
def test_a_ur_is_what_its_maker_s_table_says(name):
    """A standard table, as one that begins with the last column of a modified one."""
    d1, a2, a3, d4, d5, d6 = UR["ur5e" if name == "built in" else name]
    rows = [("0", d1, 0), ("0", "0", 1), (a2, "0", 0), (a3, d4, 0), ("0", d5, 1), ("0", d6, -1)]
    built_in = name == "built in"
    check_flange(UR5E if built_in else own_arm(f"{name}.xml").arm, rows, "0", 100 if built_in else 20)


def in_scene(model, q):
    """The arm on a tilted stand in a scene of other units, at a joint position; and its state."""
    spec = mujoco.MjSpec()
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.timestep = 0.5e-3
    spec.option.gravity = [0.0, 0.0, -9.81]
    arm = ServoedArm(model, Pose((0.3, -0.2, 0.1), ((0.0, -0.6, -0.8), (0.0, 0.8, -0.6), (1.0, 0.0, 0.0))))
    arm.add_to(spec, q)
    compiled = spec.compile()
    return arm, compiled, mujoco.MjData(compiled)


def model_named(name, folder):
    return written(folder, SCARA).read() if name == "scara" else own_arm(name)


@pytest.mark.parametrize("name", [*OWN, "scara"])
def test_in_a_scene_it_is_the_arm_that_it_is_alone(name, tmp_path):
    """Its kinematics, and all that its joints feel; wherever it starts."""
    model = model_named(name, tmp_path)
    arm, compiled, data = in_scene(model, model.home)
    alone = model.spec.compile()
    other, n = mujoco.MjData(alone), len(model.joints)
    assert data.qpos == pytest.approx(model.home)
    assert [compiled.joint(i).name for i in range(compiled.njnt)] == list(arm.joints)
    assert not compiled.geom_contype.any()
    M, expected = np.zeros((n, n)), np.zeros((n, n))
    rng = np.random.default_rng(1)
    for _ in range(30):
        data.qpos[:] = other.qpos[:] = [rng.uniform(each.lower, each.upper) for each in model.arm.limits]
        for m, d, full in ((compiled, data, M), (alone, other, expected)):
            mujoco.mj_forward(m, d)
            mujoco.mj_fullM(m, d, full)
        pose, flange = arm.kinematics.pose(data.qpos.tolist()), data.body(FLANGE)
        placed = np.column_stack([flange.xmat.reshape(3, 3), flange.xpos])
        assert placed == pytest.approx(np.column_stack([pose.rotation, pose.position]), abs=1e-13)
        assert pytest.approx(expected, abs=1e-12) == M
        assert np.all(np.diag(M) <= np.add(model.armature, model.link_inertia) * (1.0 + 1e-9))


@pytest.mark.parametrize("name", [*OWN, "scara"])
def test_it_does_not_sag_follows_without_lag_and_keeps_to_its_speeds(name, tmp_path):
    model = model_named(name, tmp_path)
    arm, compiled, _ = in_scene(model, model.home)
    run, stroke = ArmRun(compiled, arm), np.array((0.02, -0.01, 0.005))
    first = np.array(run.tip.position)
    run.go(200)
    assert run.tip.position == pytest.approx(first, abs=1e-6)
    run.go(1000, stroke)
    assert run.tip.position - first == pytest.approx(stroke, abs=0.05e-3)
    run.go(300, (3.0, 1.0, 2.0))  # faster than any joint may be
    run.check_speeds()


def test_a_file_with_degrees_frames_defaults_and_a_gripper_is_read(tmp_path):
    model = written(tmp_path, SCARA).read()
    assert model.joints == ("a", "b", "c", "d")
    assert [joint.kind for joint in model.arm.joints].count(JointKind.SLIDE) == 1
    assert model.home == pytest.approx((0.3, 0.8, 0.12, 0.1))
    assert model.armature == (0.2,) * 4
    assert [each.torque for each in model.arm.limits] == [50.0, 50.0, 200.0, 20.0]
    assert model.arm.limits[0].upper == pytest.approx(math.radians(150.0))
    _, compiled, _ = in_scene(model, model.home)
    assert compiled.njnt == 4  # the gripper's stays where it is
    assert compiled.body(PREFIX + "jaw").mass > 0.0


MESH = '<asset><mesh name="m" file="nope.stl"/></asset><worldbody>'

WELD = "<equality>\n<weld body1='x' body2='z'/></equality></mujoco>"

BAD = {
    "missing site": (GANTRY, "tool", r"flange = 'tool': no site, body or link is called so; .*there are flange"),
    "nearly": (GANTRY, "flang", "did you mean flange"),
    "closed": (
        GANTRY.replace("</mujoco>", WELD),
        "flange",
        r"line 12: equality 1 \(weld\) makes a closed .*; must",
    ),
    "coupled": (
        GANTRY.replace("</mujoco>", '<equality><joint name="e" joint1="x" joint2="y"/></equality></mujoco>'),
        "flange",
        r"equality e \(joint\) makes a closed kinematic chain",
    ),
    "mesh": (
        GANTRY.replace("<worldbody>", MESH),
        "flange",
        r"line 3: a mesh .* cannot be opened \(nope.stl\); put",
    ),
    "zero inertia": (
        GANTRY.replace('mass="1"', 'mass="0"'),
        "flange",
        r"line \d: a moving body has no mass or no inertia \(x\); give it",
    ),
    "no range": (GANTRY.replace('range="-0.3 0.3"', ""), "flange", r"line 4: joint x has no range; give it one"),
    "no torque": (
        GANTRY.replace('actuatorfrcrange="-300 300"', ""),
        "flange",
        r"line 4: joint x has no largest torque or force; give it one",
    ),
    "no speed": (
        GANTRY.replace("joint_speed", "speed"),
        "flange",
        "joint x has no largest speed; give joint_speed",
    ),
    "few speeds": (GANTRY.replace("0.5 0.5 0.5", "0.5 0.5"), "flange", "has 2 numbers; must have 3"),
    "speed of zero": (GANTRY.replace("0.5 0.5 0.5", "0.5 0 1"), "flange", "joint y has the largest speed 0; must"),
    "millimetres": (
        GANTRY.replace("0 0 0.5", "0 0 500"),
        "flange",
        r"line 6: body z: its distance from .* is 500 m; must be at most 10 m: write metres",
    ),
    "one joint": (
        GANTRY.replace('<joint name="y" axis="0 1 0"/>', ""),
        "flange",
        "2 joints between .*; must be 3",
    ),
    "two in one": (
        GANTRY.replace('<joint name="y" axis="0 1 0"/>', '<joint name="y"/><joint name="yy" axis="0 1 0"/>'),
        "flange",
        "body y has 2 joints; must have one",
    ),
    "ball": (
        GANTRY.replace('name="y" axis="0 1 0"', 'name="y" type="ball" range="0 1"'),
        "flange",
        "line 5: joint y is a ball joint; must be",
    ),
    "floating": (
        GANTRY.replace('<joint name="x" axis="1 0 0"/>', '<freejoint name="x"/>'),
        "flange",
        "is a free joint",
    ),
    "misspelt": (GANTRY.replace("axis=", "axs="), "flange", r"line \d: .*unrecognized attribute.*; mend it there"),
    "no XML": ("<mujoco", "flange", "line 1: this is no well-formed XML"),
    "empty": ("", "flange", "the file is empty"),
}
"""Files that are refused: text, flange, message."""


URDF = (ARMS / "xarm6.urdf").read_text()

SECOND = URDF[URDF.index('  <joint name="joint2"') : URDF.index('  <link name="link3"')].replace(
    "joint2", "again", 1
)

BAD_URDF = [
    (URDF.replace("</robot>", SECOND + "</robot>"), r"line \d+: a link with two parents .* chain; must be serial"),
    (URDF.replace('lower="-6.', 'lower="9.'), "the range of a joint is empty .joint1.; give it one"),
    (URDF.replace('velocity="3.14"', ""), "joint joint1 has no largest speed"),
    (URDF.replace('velocity="3.14"', 'velocity="fast"'), "joint joint1: velocity = 'fast' is no number; mend"),
    (URDF.replace('effort="50"', ""), "joint joint1 has no largest torque"),
    (URDF.replace("</robot>", "<xacro:arm/></robot>"), "this is a xacro; must be the URDF"),
]
REFUSED = [
    *(pytest.param("arm.xml", *row, id=name) for name, row in BAD.items()),
    *(("arm.urdf", text, "flange", message) for text, message in BAD_URDF),
]


@pytest.mark.parametrize(("name", "text", "flange", "message"), REFUSED)
def test_a_file_that_describes_no_arm_is_refused_in_one_line(name, text, flange, message, tmp_path):
    with pytest.raises(InvalidValueError, match=message) as refused:
        written(tmp_path, text, name, flange).read()
    assert str(refused.value).startswith(str(tmp_path / name))
    assert "\n" not in str(refused.value)
    assert ";" in str(refused.value)


def test_an_arm_on_a_mobile_base_with_a_hand_is_read_from_its_root_to_its_flange(tmp_path):
    """Free base, hand that is a closed chain, mocap handle, motors and joints without end, names left out."""
    model = ArmFile(written(tmp_path, MOBILE).path, "flange", joint_torque=(9.0,) * 3, root="stand").read()
    assert [(each.lower, each.upper, each.torque) for each in model.arm.limits] == [
        (-2.0 * math.pi, 2.0 * math.pi, 9.0)
    ] * 3
    text = "; ".join(model.assumptions)
    assert "left where the file has them: unnamed-joint-0, grip_a, grip_b" in text
    assert "taken to turn by 360 deg to either side: a, b, c" in text
    assert "made the same about all axes: hand" in text
    with warnings.catch_warnings(action="error"):  # of options in conflict
        _, compiled, _ = in_scene(model, (0.1, 0.2, 0.3))
    assert compiled.njnt == 3
    assert compiled.joint(0).range == pytest.approx((-2.0 * math.pi, 2.0 * math.pi))
    motors = ArmFile(tmp_path / "arm.xml", "flange", root="stand").read()
    assert [each.torque for each in motors.arm.limits] == [40.0] * 3
    rooted = partial(ArmFile, tmp_path / "arm.xml", "flange")
    check_refusals(
        ("is a free joint; must be .* as root", lambda: rooted(root="").read()),
        ("did you mean stand", lambda: rooted(root="stnd").read()),
        (r"line \d+: root = 'other' does not carry the flange; must", lambda: rooted(root="other").read()),
    )


def test_a_urdf_finds_the_meshes_of_its_package_and_leaves_out_what_cannot_be_read(tmp_path):
    shape = '<collision><geometry><mesh filename="package://arms/{}"/></geometry></collision>'
    meshes = URDF.replace(
        '<link name="link6">', f'<link name="link6">{shape.format("look/a.obj")}{shape.format("b.dae")}'
    )
    endless = meshes.replace('"revolute"', '"continuous"', 1).replace("<limit", '<limit other:jerk="1"', 1)
    for folder in ("urdf", "look"):
        (tmp_path / "arms" / folder).mkdir(parents=True)
    arm = written(tmp_path / "arms" / "urdf", endless, "arm.urdf")
    with pytest.raises(InvalidValueError, match=r"line \d+: a mesh cannot be found \(package://arms/look/a"):
        arm.read()
    (tmp_path / "arms" / "look" / "a.obj").write_text(
        "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n"
    )
    model = arm.read()
    assert model.spec.compile().nmesh == 1
    assert model.arm.limits[0].upper == 2.0 * math.pi
    assert "does not read such meshes: b" in "; ".join(model.assumptions)


TIP = SensorPayload(0.03, (0.0, 0.0, 0.01))

HEAVY = GANTRY.replace('mass="1"', 'mass="60"').replace("-300 300", "-3000 3000")


def step_tested(model, behind, start, bandwidth, period=1e-3):
    """What the step test finds; stiffness by the servos' gains [N/m] and 2 / w [s]."""
    limit = FollowingErrorLimit(0.002)
    arm = ServoedArm(model, Pose((behind, 0.0, 0.0)), Pose((0.0, 0.0, 0.1), LOOKING_DOWN), bandwidth, limit)
    carrier = ArmCarrier(arm)
    joints = carrier.joint_start(start)
    computed = [arm.push(joints, tuple(axis)) / limit.distance for axis in np.eye(3).tolist()]
    return step_test(carrier, TIP, start, Fidelity(), period), computed, 2.0 / bandwidth


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "behind", "start", "bandwidth"),
    [
        ("panda.xml", -0.45, (0.0, 0.0, 0.03), 130.0),
        ("xarm6.xml", -0.45, (0.02, -0.01, 0.03), 60.0),
        ("sluggish", 0.0, (0.1, -0.1, 0.55), 6.0),
    ],
)
def test_it_finds_what_the_servos_gains_give(name, behind, start, bandwidth, tmp_path):
    """Three slides that carry 180 kg at 6 rad/s are twenty times as slow as the Panda."""
    model = written(tmp_path, HEAVY).read() if name == "sluggish" else own_arm(name)
    servos, stiffness, response = step_tested(model, behind, start, bandwidth)
    assert servos.stiffness == pytest.approx(stiffness, rel=0.006)  # of three digits, and how far it leans
    assert servos.response == pytest.approx([response] * 3, abs=0.4e-3, rel=0.005)
    assert servos.lag == (0.0, 0.0, 0.0)
    assert "N/mm along x, y and z, response" in str(servos)


def test_motors_that_do_not_hold_their_own_weight_are_refused(tmp_path):
    weak = GANTRY.replace("-300 300", "-5 5")
    with pytest.raises(InvalidValueError, match=r"gantry, pushed with .* does not come to rest: .*;"):
        step_tested(written(tmp_path, weak).read(), 0.0, (0.1, -0.1, 0.55), 30.0)
