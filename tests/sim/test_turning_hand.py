"""The hand whose fingers also move sideways: geometry, servos, what it refuses, determinism."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.runtime.data import Command
from palpate.sim import Lift, SphereObject
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.hand.servo import Servo
from palpate.sim.hand.sideways import MAX_LEAD, SidewaysRack
from palpate.sim.hand.turning_hand import sideways_name, turning_hand
from palpate.sim.objects.table import Table

HAND = turning_hand()
BALL = HeldObject(SphereObject(0.03))
SCENE = build_grasp_scene(HAND, BALL, carrier=Lift(), table=Table(-0.03))
CLEAR = build_grasp_scene(HAND, HeldObject(SphereObject(0.01)), palm=(0.1, -0.2, 0.3))
"""Nothing in the fingers' way."""

joints = st.lists(st.floats(-0.012, 0.012), min_size=6, max_size=6).map(tuple)


def started(scene=CLEAR, **options):
    backend = HandBackend(scene, **options)
    backend.start()
    return backend


def sideways(*speeds):
    return tuple((0.0, speed, 0.0) for speed in speeds) or None


def go(backend, periods, *speeds, force=None):
    for _ in range(periods):
        sample = backend.step(Command(finger_velocity=sideways(*speeds), grip_force=force))
    return sample.hand.joint_position[3:]


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
    backend = started()
    first = go(backend, 300, 0.006, -0.003, 0.0)
    later = go(backend, 300, 0.006, -0.003, 0.0)
    assert np.subtract(later, first) == pytest.approx([1.8e-3, -0.9e-3, 0.0], abs=2e-5)
    go(backend, 300)
    still = backend.truth().joint_position[3:]
    go(backend, 300)
    assert backend.truth().joint_position[3:] == pytest.approx(still, abs=1e-6)


def test_the_travel_ends_where_the_rack_does():
    backend = started(
        build_grasp_scene(replace(HAND, rack=SidewaysRack(travel=0.003)), BALL, palm=(0.0, 0.0, 0.3))
    )
    ends = go(backend, 1200, 0.02, -0.02, 0.02)
    assert np.abs(ends) == pytest.approx(0.003, abs=1e-4)
    assert max(map(abs, ends)) < 0.003 + 2e-5


def test_the_goal_does_not_run_away_from_a_finger_that_is_held():
    backend = started()
    model = backend.scene.model
    dof = int(model.joint(sideways_name(0)).dofadr[0])
    model.dof_damping[dof] = 1e9
    try:
        go(backend, 1000, 0.01, 0.01, 0.01)
        assert abs(backend.truth().joint_position[3]) < 1e-4
        assert backend.truth().joint_position[4] > 4.0 * MAX_LEAD
    finally:
        model.dof_damping[dof] = 0.0
    most = 0.0
    for _ in range(300):
        go(backend, 1)
        most = max(most, backend.truth().joint_position[3])
    assert most < 1.1 * MAX_LEAD


@pytest.mark.parametrize("force", [2.0, 4.0])
def test_a_push_from_the_side_yields_by_the_servos_stiffness(force):
    """What friction in the gear does not bear, the proportional gain does: torque per error of the servo alone."""
    backend = started()
    rack = HAND.rack
    servo = Servo(rack.servo, 1e-3)
    servo.start(0.0)
    for _ in range(200):
        torque = servo.step(-1e-2, 0.0)
    stiffness = (torque + rack.servo.coulomb) / 1e-2 / rack.pinion**2 / (1.0 + rack.servo.load_friction)
    dof = int(backend.scene.model.joint(sideways_name(0)).dofadr[0])
    backend._data.qfrc_applied[dof] = -force
    go(backend, 1500)
    given = -backend.truth().joint_position[3]
    # friction helps to hold: by up to the Coulomb part and the share of the load
    friction = rack.servo.coulomb / rack.pinion
    least = max(0.0, force / (1.0 + rack.servo.load_friction) - friction) / stiffness
    assert least - 2e-5 <= given <= 1.2 * force / stiffness + 2e-5
    assert given < 1e-3


def test_a_finger_that_follows_a_surface_sideways_keeps_its_force():
    """Friction in the gear takes nothing from it on the way in, and adds no more than its band on the way out."""
    backend = started(SCENE)
    go(backend, 2500, force=(2.0,) * 3)
    band = HAND.grip_band(2.0)
    for speed in (0.006, -0.006, -0.006, 0.006):
        for _ in range(900):
            go(backend, 1, *(speed,) * 3, force=(2.0,) * 3)
            for finger in backend.truth().fingers:
                assert 0.97 * 2.0 < math.hypot(*finger.force[:2]) < 2.0 + 1.2 * band
