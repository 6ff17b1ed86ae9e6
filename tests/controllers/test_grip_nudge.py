"""How a nudge moves: from rest to rest, over all of its way, within the supervisor's limits."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.grip.nudge import NudgeController, NudgeParameters, Ramped
from palpate.runtime import Limits, Touch
from palpate.runtime.touch import Finger
from palpate.sensing.compensation import SensorPayload
from palpate.sim import Box, TurningStage
from palpate.sim.hand.backend import HandBackend
from palpate.sim.hand.hand import two_finger_hand
from palpate.sim.hand.scene import HeldObject, build_grasp_scene
from palpate.sim.objects.table import Table
from palpate.spatial import norm, subtract

PERIOD = 1e-3
sizes = st.floats(1e-3, 1e2)


@settings(max_examples=200)
@given(sizes, sizes, sizes, st.floats(0.0, 1.0))
def test_the_distance_is_the_integral_of_the_speed(way, speed, acceleration, share):
    """By trapezoids, exact on each straight piece."""
    motion = Ramped(way, speed, acceleration)
    end = share * motion.duration
    corners = (motion.corner, motion.duration - motion.corner)
    times = sorted({0.0, end, *(t for t in corners if 0.0 < t < end)})
    gone = sum(0.5 * (b - a) * (motion.speed(a) + motion.speed(b)) for a, b in pairwise(times))
    assert gone == pytest.approx(way * motion.progress(end), rel=1e-9, abs=1e-12 * way)
    assert motion.progress(motion.duration) == pytest.approx(1.0)
    assert motion.speed(0.0) == 0.0
    assert motion.speed(motion.duration) == pytest.approx(0.0, abs=1e-9 * speed)


@settings(max_examples=200)
@given(sizes, sizes, sizes, st.floats(0.0, 1.0), st.floats(0.0, 0.5))
def test_neither_speed_nor_acceleration_exceed_theirs(way, speed, acceleration, share, step):
    motion = Ramped(way, speed, acceleration)
    t, dt = share * motion.duration, step * motion.duration
    assert 0.0 <= motion.speed(t) <= speed * (1.0 + 1e-12)
    assert abs(motion.speed(t + dt) - motion.speed(t)) <= acceleration * dt + 1e-9 * speed


def test_a_distance_too_short_for_its_speed_takes_no_longer_than_it_must():
    """From rest to rest with one acceleration takes 2 sqrt(way / acceleration), whatever the speed."""
    for speed in (1.0, 100.0):
        assert Ramped(0.01, speed, 1.0).duration == pytest.approx(0.2)


def test_a_nudge_as_it_is_by_default_keeps_the_supervisors_limits():
    """Of speeds and of their change from period to period, at the tip as at the hand, with room to spare."""
    hand, limits = two_finger_hand(), Limits()
    scene = build_grasp_scene(
        hand, HeldObject(Box((0.06, 0.05, 0.06)), 0.1), carrier=TurningStage(), table=Table(-0.03)
    )
    backend = HandBackend(scene, PERIOD)
    finger = Finger(hand.tip.surface, SensorPayload(hand.tip.mass, hand.tip.center_of_mass))
    touch = Touch(finger, finger)
    parameters = NudgeParameters(2.0, (0.0, 0.0, -(hand.depth + hand.tip_along)))
    nudge = NudgeController(2, PERIOD, parameters)
    now = touch.sense(backend.start())
    nudge.start(now)
    velocity = turning = (0.0, 0.0, 0.0)
    fastest, touched, turned, lowered = 0.0, math.inf, 0.0, 0.0
    while not nudge.done:
        if all(each.touching for each in now.fingers):
            touched = min(touched, now.time)
        command = nudge.step(now)
        assert norm(subtract(command.velocity_base_tip, velocity)) <= 0.5 * limits.acceleration * PERIOD
        twisted = subtract(command.angular_velocity_base_tip, turning)
        assert norm(twisted) <= 0.5 * limits.angular_acceleration * PERIOD
        velocity, turning = command.velocity_base_tip, command.angular_velocity_base_tip
        assert norm(velocity) <= limits.speed
        fastest = max(fastest, norm(turning))
        turned += abs(turning[0]) * PERIOD
        if turning == (0.0, 0.0, 0.0):
            lowered -= velocity[2] * PERIOD
        now = touch.sense(backend.step(command))
    assert fastest == pytest.approx(parameters.spin, rel=0.02)
    assert turned == pytest.approx(2.0 * parameters.angle, rel=0.01)
    assert lowered == pytest.approx(parameters.stroke, rel=0.01)
    assert norm(turning) == norm(velocity) == 0.0
    assert now.time - touched == pytest.approx(parameters.duration, abs=0.02)
