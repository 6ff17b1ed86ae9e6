"""Fingers that move: of any joints, from MJCF files, and on racks sideways."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.kinematics.pose import Pose
from palpate.runtime.data import Command
from palpate.sim import CylinderObject, Lift, SphereObject
from palpate.sim.hand.contact import GraspContact
from palpate.sim.hand.hand_file import HandFile
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.servo import Servo
from palpate.sim.hand.sideways import MAX_LEAD, SidewaysRack
from palpate.sim.hand.turning_hand import sideways_name, turning_hand
from palpate.sim.objects.table import Table
from palpate.sim.tip import Tip
from palpate.surfaces import Sphere
from support.simulated import started

TIP = Tip(Sphere(0.008), mass=0.015)

BALL = HeldObject(SphereObject(0.025), mass=0.2)

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


def in_air(hand):
    """A hand whose object is far below, and falls."""
    return started(build_grasp_scene(hand, BALL, palm=(0.0, 0.0, 1.0)))


def go(backend, periods, force=None, velocity=None):
    """Press with one force [N] and move the fingers [m/s]; return the last sample."""
    grip = None if force is None else (force,) * backend.scene.hand.fingers
    for _ in range(periods):
        sample = backend.step(Command(grip_force=grip, finger_velocity=velocity))
    return sample


def around_roller(tmp_path, n, joints):
    return started(build_grasp_scene(made(tmp_path, n, joints), ROLLER, SMOOTH, table=Table(-0.0301)))


@pytest.mark.slow
@pytest.mark.parametrize(("n", "joints"), [(2, 4), (3, 1), (5, 2), (3, 3)])
def test_each_finger_presses_with_its_grip_force(tmp_path, n, joints):
    """At rest, in the direction in which it closes, whatever its joints; friction alone would bear more."""
    backend = around_roller(tmp_path, n, joints)
    hand, sample, truth = backend.scene.hand, go(backend, 3000, 3.0), backend.truth()
    sensors = hand.sensor_poses(truth.joint_position)
    for i, (felt, pose, load) in enumerate(zip(truth.fingers, sensors, sample.wrenches, strict=True)):
        along = np.array(pose.rotation).T @ felt.force
        closing = hand.closing_axes(i) @ felt.force  # pyright: ignore[reportAttributeAccessIssue]
        assert closing[0] == pytest.approx(-3.0, abs=0.02)
        weight = hand.tips[0].mass * np.array(load.acceleration)
        assert np.array(load.wrench[:3]) + weight == pytest.approx(along, abs=1e-6)


@pytest.mark.parametrize("joints", [3, 4])
def test_a_free_tip_moves_as_commanded_in_its_sensor_frame_and_returns(tmp_path, joints):
    """The other finger stands still; a finger that neither presses nor moves goes back to its start."""
    hand = made(tmp_path, 2, joints)
    backend = in_air(hand)
    first = hand.sensor_poses(backend.truth().joint_position)
    velocity, pose, expected = (0.01, 0.004 if joints == 4 else 0.0, -0.012), first[0], np.array(first[0].position)
    for _ in range(800):
        expected += 1e-3 * np.array(pose.rotation) @ velocity
        pose, other = hand.sensor_poses(go(backend, 1, velocity=(velocity, None)).hand.joint_position)
    assert pose.position == pytest.approx(expected, abs=3e-4)
    assert other.position == pytest.approx(first[1].position, abs=1e-6)
    back = hand.sensor_poses(go(backend, 3000).hand.joint_position)
    assert back[0].position == pytest.approx(first[0].position, abs=1e-5)


def test_a_tip_that_presses_is_moved_sideways_on_the_object(tmp_path):
    backend = around_roller(tmp_path, 2, 4)
    go(backend, 2000, 2.0)
    poses = [backend.scene.hand.sensor_poses(backend.truth().joint_position)]
    go(backend, 300, 2.0, ((0.0, 0.0, 0.01), None))
    poses.append(backend.scene.hand.sensor_poses(backend.truth().joint_position))
    assert math.dist(*(pose[0].position for pose in poses)) == pytest.approx(0.003, rel=0.15)
    assert np.linalg.norm(backend.truth().fingers[0].force) == pytest.approx(2.0, abs=0.1)


TEXT = hand_text()

BALL_JOINT = TEXT.replace('name="f1j1" axis="0 1 0" range="-1.5 1.5"', 'name="f1j1" type="ball" range="0 1"')

COUPLED = hand_text(extra='<equality><joint joint1="f0j1" joint2="f0j2"/></equality>')

SITES = ("s0", "s1", "s2")

BAD = {
    "five joints": (hand_text(2, 5), SITES[:2], "5 joints between base and flange; must be 1 to 4"),
    "no such site": (TEXT.replace('"s2"', '"tip"'), SITES, "is called 's2'; there are s0, s1, tip"),
    "a ball": (BALL_JOINT, SITES, "f1j1 is a ball joint"),
    "no torque": (TEXT.replace('actuatorfrcrange="-3 3" ', ""), SITES, "no largest torque"),
    "no speed": (TEXT.replace("joint_speed", "other"), SITES, "no largest speed"),
    "no range": (TEXT.replace('limited="true"', 'limited="false"'), SITES, "has no range"),
    "coupled": (COUPLED, SITES, "closed kinematic chain"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_file_that_describes_no_hand_is_refused_in_one_line(tmp_path, name):
    text, sites, match = BAD[name]
    path = tmp_path / "hand.xml"
    path.write_text(text)
    with pytest.raises(InvalidValueError, match=match) as refusal:
        HandFile(path, sites).read([TIP] * 3)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


HAND = turning_hand()

SPHERE = HeldObject(SphereObject(0.03))

CLEAR = build_grasp_scene(HAND, HeldObject(SphereObject(0.01)), palm=(0.1, -0.2, 0.3))
"""Nothing in the fingers' way."""

joints = st.lists(st.floats(-0.012, 0.012), min_size=6, max_size=6).map(tuple)


def sideways(*speeds):
    return tuple((0.0, speed, 0.0) for speed in speeds) or None


def slide(backend, periods, *speeds, force=None):
    return go(backend, periods, force, sideways(*speeds)).hand.joint_position[3:]


@settings(max_examples=30, deadline=None)
@given(joints)
def test_tips_never_turn_and_sideways_is_y_of_the_sensor(joints):
    at_zero = HAND.sensor_poses((0.0,) * 6)
    for i, (pose, middle) in enumerate(zip(HAND.sensor_poses(joints), at_zero, strict=True)):
        assert pose.rotation == middle.rotation
        way = np.array(pose.rotation).T @ np.subtract(pose.position, middle.position)
        assert way == pytest.approx([joints[i], joints[3 + i], 0.0], abs=1e-15)


def test_a_turn_of_all_fingers_is_anticlockwise_about_the_hands_axis():
    """w x p along y of the sensor is positive for a positive turn about z."""
    for pose in HAND.sensor_poses((0.0,) * 6):
        x, y, _ = pose.position
        assert np.array(pose.rotation)[:, 1] @ (-y, x, 0.0) == pytest.approx(HAND.opening)


def test_fingers_go_sideways_as_fast_as_commanded_and_stop():
    backend = started(CLEAR)
    first = slide(backend, 300, 0.006, -0.003, 0.0)
    later = slide(backend, 300, 0.006, -0.003, 0.0)
    assert np.subtract(later, first) == pytest.approx([1.8e-3, -0.9e-3, 0.0], abs=2e-5)
    slide(backend, 300)
    still = backend.truth().joint_position[3:]
    slide(backend, 300)
    assert backend.truth().joint_position[3:] == pytest.approx(still, abs=1e-6)


def test_the_travel_ends_where_the_rack_does():
    backend = started(
        build_grasp_scene(replace(HAND, rack=SidewaysRack(travel=0.003)), SPHERE, palm=(0.0, 0.0, 0.3))
    )
    ends = slide(backend, 1200, 0.02, -0.02, 0.02)
    assert np.abs(ends) == pytest.approx(0.003, abs=1e-4)
    assert max(map(abs, ends)) < 0.003 + 2e-5


def test_the_goal_does_not_run_away_from_a_finger_that_is_held():
    backend = started(build_grasp_scene(HAND, SPHERE, palm=(0.0, 0.0, 1.0)))  # a model of its own
    damping = backend.scene.model.dof_damping
    dof = int(backend.scene.model.joint(sideways_name(0)).dofadr[0])
    damping[dof] = 1e9
    slide(backend, 1000, 0.01, 0.01, 0.01)
    assert abs(backend.truth().joint_position[3]) < 1e-4
    assert backend.truth().joint_position[4] > 4.0 * MAX_LEAD
    damping[dof] = 0.0
    assert max(slide(backend, 1)[0] for _ in range(300)) < 1.1 * MAX_LEAD


@pytest.mark.parametrize("force", [2.0, 4.0])
def test_a_push_from_the_side_yields_by_the_servos_stiffness(force):
    """What friction in the gear does not bear, the proportional gain does: torque per error of the servo alone."""
    backend = started(CLEAR)
    rack = HAND.rack
    servo = Servo(rack.servo, 1e-3)
    servo.start(0.0)
    for _ in range(200):
        torque = servo.step(-1e-2, 0.0)
    stiffness = (torque + rack.servo.coulomb) / 1e-2 / rack.pinion**2 / (1.0 + rack.servo.load_friction)
    dof = int(backend.scene.model.joint(sideways_name(0)).dofadr[0])
    backend._data.qfrc_applied[dof] = -force
    slide(backend, 1500)
    given = -backend.truth().joint_position[3]
    # friction helps to hold: by up to the Coulomb part and the share of the load
    friction = rack.servo.coulomb / rack.pinion
    least = max(0.0, force / (1.0 + rack.servo.load_friction) - friction) / stiffness
    assert least - 2e-5 <= given <= 1.2 * force / stiffness + 2e-5
    assert given < 1e-3


def test_a_finger_that_follows_a_surface_sideways_keeps_its_force():
    """Friction in the gear takes nothing from it on the way in, and adds no more than its band on the way out."""
    backend = started(build_grasp_scene(HAND, SPHERE, carrier=Lift(), table=Table(-0.03)))
    slide(backend, 2500, force=2.0)
    for speed in (0.006, -0.006, -0.006, 0.006):
        for _ in range(900):
            slide(backend, 1, *(speed,) * 3, force=2.0)
            forces = [math.hypot(*finger.force[:2]) for finger in backend.truth().fingers]
            assert 0.97 * 2.0 < min(forces) <= max(forces) < 2.0 + 1.2 * HAND.grip_band(2.0)
