"""Hands of any fingers, from MJCF files: where they are, how hard they press, how they move."""

import math

import numpy as np
import pytest

from palpate.errors import InvalidValueError
from palpate.kinematics.pose import Pose
from palpate.runtime.data import Command
from palpate.sim import CylinderObject, SphereObject
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand_file import HANDS, HandFile
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.sim.tip import Tip
from palpate.spatial import ZERO
from palpate.surfaces import Sphere

TIP = Tip(Sphere(0.008), mass=0.015)
BALL = HeldObject(SphereObject(0.025), mass=0.2)
SENSORS = ("index_sensor", "left_sensor", "right_sensor")
LINK = 0.04
BEND = {1: (0.0,), 2: (-0.3, 0.3), 3: (-0.5, 0.6, -0.1), 4: (-0.5, 0.6, -0.1, 0.2)}
"""[rad] Posture of fingers of one to four hinges, which then close square to the hand's axis."""
UPRIGHT = Pose(rotation=((0.0, 0.0, -1.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)))
ROLLER = HeldObject(CylinderObject(0.025, 0.06), 1.0, UPRIGHT)
SMOOTH = GraspContact(friction=0.005)


def finger(i, n, joints):
    """One of n fingers around the hand's axis: hinges that close it, the last of four turns it sideways."""
    azimuth = 2.0 * math.pi * i / n
    c, s = 0.055 * math.cos(azimuth), 0.055 * math.sin(azimuth)
    text, end = f'<body name="f{i}" pos="{c} {s} 0" euler="0 0 {azimuth}">', ""
    for k in range(joints):
        axis = "1 0 0" if k == 3 else "0 1 0"
        at = "0 0 0" if k == 0 else f"0 0 {-LINK}"
        text += f'<body name="f{i}l{k}" pos="{at}"><joint name="f{i}j{k}" axis="{axis}" range="-1.5 1.5"/>'
        text += f'<geom type="capsule" fromto="0 0 0 0 0 {-LINK}" size="0.004" mass="0.02"/>'
        end += "</body>"
    # x towards the axis, z along the finger
    return f'{text}<site name="s{i}" pos="0 0 {-LINK}" quat="0 0 1 0"/>{end}</body>'


def hand_text(n=3, joints=3, extra=""):
    return f"""<mujoco model="made"><compiler angle="radian"/>
      <default><joint armature="0.001" actuatorfrcrange="-3 3" limited="true"/></default>
      <custom><numeric name="joint_speed" data="{"8 " * n * joints}"/></custom>
      <worldbody><body name="base"><geom type="box" size="0.03 0.03 0.01" mass="0.2"/>
      {"".join(finger(i, n, joints) for i in range(n))}</body></worldbody>{extra}</mujoco>"""


def made(tmp_path, n=3, joints=3, **options):
    path = tmp_path / "hand.xml"
    path.write_text(hand_text(n, joints))
    return HandFile(path, tuple(f"s{i}" for i in range(n)), BEND[joints] * n, **options).read([TIP] * n)


@pytest.fixture(scope="module")
def pinch():
    return HandFile(HANDS / "pinch-and-index.xml", SENSORS).read([TIP] * 3)


def in_air(hand):
    """With an object far below, which falls."""
    backend = HandBackend(build_grasp_scene(hand, BALL, palm=(0.0, 0.0, 1.0)))
    return backend, backend.start()


@pytest.mark.parametrize(("n", "joints"), [(2, 4), (3, 1), (5, 2), (3, 3)])
def test_each_finger_presses_with_its_grip_force(tmp_path, n, joints):
    """At rest, in the direction in which it closes, whatever its joints; friction alone would bear more."""
    hand = made(tmp_path, n, joints)
    scene = build_grasp_scene(hand, ROLLER, SMOOTH, table=Table(-0.0301))
    backend = HandBackend(scene)
    backend.start()
    for _ in range(3000):
        sample = backend.step(Command(grip_force=(3.0,) * n))
    truth = backend.truth()
    sensors = hand.sensor_poses(truth.joint_position)
    for i, (felt, pose, load) in enumerate(zip(truth.fingers, sensors, sample.wrenches, strict=True)):
        along = np.array(pose.rotation).T @ felt.force
        assert (hand.closing_axes(i) @ felt.force)[0] == pytest.approx(-3.0, abs=0.02)
        weight = hand.tips[0].mass * np.array(load.acceleration)
        assert np.array(load.wrench[:3]) + weight == pytest.approx(along, abs=1e-6)


@pytest.mark.parametrize("joints", [3, 4])
def test_a_free_tip_moves_as_commanded_in_its_sensor_frame(tmp_path, joints):
    hand = made(tmp_path, 2, joints)
    backend, first = in_air(hand)
    velocity = (0.01, 0.004 if joints == 4 else 0.0, -0.012)
    turned = [hand.sensor_poses(first.hand.joint_position)[0]]
    wanted = np.array(turned[0].position)
    for _ in range(800):
        wanted += 1e-3 * np.array(turned[-1].rotation) @ velocity
        sample = backend.step(Command(finger_velocity=(velocity, None)))
        turned.append(hand.sensor_poses(sample.hand.joint_position)[0])
    assert turned[-1].position == pytest.approx(wanted, abs=3e-4)
    # the other stands where it stood
    still = hand.sensor_poses(first.hand.joint_position)[1].position
    assert hand.sensor_poses(sample.hand.joint_position)[1].position == pytest.approx(still, abs=1e-6)


def test_a_tip_that_presses_is_moved_sideways_on_the_object(tmp_path):
    hand = made(tmp_path, 2, 4)
    scene = build_grasp_scene(hand, ROLLER, SMOOTH, table=Table(-0.0301))
    backend = HandBackend(scene)
    backend.start()
    for _ in range(2000):
        backend.step(Command(grip_force=(2.0, 2.0)))
    before = np.array(hand.sensor_poses(backend.truth().joint_position)[0].position)
    for _ in range(300):
        backend.step(Command(grip_force=(2.0, 2.0), finger_velocity=((0.0, 0.0, 0.01), None)))
    after = hand.sensor_poses(backend.truth().joint_position)[0]
    assert np.linalg.norm(after.position - before) == pytest.approx(0.003, rel=0.15)
    assert np.linalg.norm(backend.truth().fingers[0].force) == pytest.approx(2.0, abs=0.1)


def test_a_finger_that_neither_presses_nor_moves_returns_to_its_start(pinch):
    backend, first = in_air(pinch)
    for _ in range(300):
        backend.step(Command(finger_velocity=((0.0, 0.01, 0.01), None, None)))
    for _ in range(1500):
        sample = backend.step(Command())
    assert sample.hand.joint_position == pytest.approx(first.hand.joint_position, abs=1e-5)


@pytest.mark.parametrize(
    "command",
    [
        Command(grip_force=(1.0, 1.0)),
        Command(grip_force=(1.0, -1.0, 1.0)),
        Command(finger_velocity=(ZERO, ZERO)),
        Command(finger_velocity=((math.nan, 0.0, 0.0), None, None)),
    ],
)
def test_commands_that_cannot_be_are_refused(pinch, command):
    with pytest.raises(InvalidValueError, match=r"grip_force|finger_velocity"):
        in_air(pinch)[0].step(command)


TEXT = hand_text()
BALL_JOINT = TEXT.replace('name="f1j1" axis="0 1 0" range="-1.5 1.5"', 'name="f1j1" type="ball" range="0 1"')
COUPLED = hand_text(extra='<equality><joint joint1="f0j1" joint2="f0j2"/></equality>')
BAD = {
    "five joints": (hand_text(2, 5), "5 joints between base and flange; must be 1 to 4"),
    "no such site": (TEXT.replace('"s2"', '"tip"'), "no site, body or link is called 's2'; there are s0, s1, tip"),
    "a ball": (BALL_JOINT, "f1j1 is a ball joint"),
    "no torque": (TEXT.replace('actuatorfrcrange="-3 3" ', ""), "no largest torque"),
    "no speed": (TEXT.replace("joint_speed", "other"), "no largest speed"),
    "no range": (TEXT.replace('limited="true"', 'limited="false"'), "has no range"),
    "coupled": (COUPLED, "closed kinematic chain"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_describes_no_hand_is_refused_in_one_line(tmp_path, name):
    text, match = BAD[name]
    path = tmp_path / "hand.xml"
    path.write_text(text)
    with pytest.raises(InvalidValueError, match=match) as refusal:
        HandFile(path, ("s0", "s1", "s2")[: 2 if "joints" in name else 3]).read([TIP] * 3)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_joint_moves_one_finger(tmp_path):
    path = tmp_path / "hand.xml"
    path.write_text(hand_text(2))
    with pytest.raises(InvalidValueError, match="moves two fingers"):
        HandFile(path, ("s0", "s0")).read([TIP] * 2)
