"""Touches one after the other on a made-up plane: rest, force and orientation of the tip, and outcomes."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from palpate.controllers.pose_motion import ALIGNED, PoseMotion, PoseMotionLimits
from palpate.controllers.touch_sequence import (
    MOST_OBSTRUCTED,
    TouchOutcome,
    TouchParameters,
    TouchSequence,
    TouchStep,
)
from palpate.runtime.data import ArmSample, Phase
from palpate.testing import check_controller
from support.rubbed_plane import GAIN, PERIOD, RADIUS, STIFFNESS, RubbedPlane, rub

TRAVEL = PoseMotionLimits.stable(0.05, 1.0, 0.5, 0.0015)

WANTED = TouchParameters(
    GAIN, TRAVEL, 0.005, air_time=0.03, rest_time=0.02, hold_time=0.04, settle_time=0.15, force_rate=40.0
)

HIGH = RADIUS + 0.006


def rows(rotation):
    a, b, c = rotation.as_matrix().tolist()
    return (tuple(a), tuple(b), tuple(c))


def step(x, tilt=0.0, forces=(1.0,), above=0.002):
    """A touch from above at x, with the tip tilted about y."""
    return TouchStep(
        (x, 0.0, RADIUS + above), rows(Rotation.from_rotvec((0, tilt, 0))), (0, 0, -1.0), forces, HIGH
    )


def touched(*steps, plane=None, parameters=WANTED, **when):
    """The sequence after its run, observations and commands of it, and the plane."""
    plane, record = plane or RubbedPlane(), []
    controller = TouchSequence(parameters, steps, PERIOD)
    rub(plane, controller, observers=(lambda _, now, command: record.append((now, command)),), **when)
    return controller, record, plane


def test_it_rests_at_each_force_and_in_the_air_before():
    """The tip has the commanded orientation where it touches, passes no lower than allowed and ends back up."""
    controller, record, _ = touched(step(0.0, 0.0, (1.0, 3.0)), step(0.02, 0.3, (2.0,)))
    assert controller.outcomes == [TouchOutcome.FELT] * 2
    assert [(span.touch, span.force) for span in controller.spans] == [(0, 1.0), (0, 3.0), (1, 2.0)]
    assert record[-1][1].phase is Phase.DONE
    assert controller.spans[0].air[1] <= controller.spans[1].air[0], "errors of both zeros are independent"
    for span in controller.spans:
        for begin, end, force in ((*span.air, 0.0), (*span.held, span.force)):
            held = [now for now, _ in record if begin <= now.time < end]
            felt = [now.fingers[0].contact.normal_force if now.fingers[0].touching else 0.0 for now in held]
            assert len(held) >= round(0.03 / PERIOD) - 1
            np.testing.assert_allclose(felt, force, atol=0.05)
            assert max(math.hypot(*now.arm.velocity_base_tip) for now in held) == 0.0
    turned = Rotation.from_matrix(held[0].arm.rotation_base_tip).inv() * Rotation.from_rotvec((0, 0.3, 0))
    assert turned.magnitude() <= ALIGNED
    places = [now.arm.position_base_tip for now, _ in record]
    assert min(z for x, _, z in places if 0.003 < x < 0.017) >= HIGH - 1e-3
    assert places[-1][2] >= HIGH - 1e-3


@pytest.mark.slow
@settings(deadline=None, max_examples=10, derandomize=True)
@given(st.floats(-0.4, 0.4), st.sampled_from([(1.0,), (0.5, 2.0), (3.0, 1.0)]))
def test_no_touch_presses_much_harder_than_wanted(tilt, forces):
    plane = RubbedPlane(tilt=0.1)
    controller, record, _ = touched(step(0.0, tilt, forces, above=0.004), plane=plane)
    assert controller.outcomes == [TouchOutcome.FELT]
    assert max(math.hypot(*now.fingers[0].force) for now, _ in record) <= max(forces) + 1.0


def test_it_is_a_pure_step_function():
    check_controller(lambda: TouchSequence(WANTED, (step(0.0, 0.0, (1.0, 2.0)), step(0.002)), PERIOD))


@settings(deadline=None, max_examples=20, derandomize=True)
@given(st.tuples(*[st.floats(-0.03, 0.03)] * 3), st.tuples(*[st.floats(-1.0, 1.0)] * 3))
def test_a_motion_arrives_within_its_limits(position, rotvec):
    limits = PoseMotionLimits.stable(0.05, 1.0, 0.5, 4 * PERIOD)
    period, motion = 4 * PERIOD, PoseMotion(limits, 4 * PERIOD)
    place, turn, before = np.zeros(3), Rotation.identity(), np.zeros(3)

    def arm():
        return ArmSample(0.0, tuple(place.tolist()), rows(turn), (0.0, 0.0, 0.0))

    motion.begin(arm(), 0.0, position, rows(Rotation.from_rotvec(rotvec)))
    for i in range(4000):
        velocity, rate = (np.array(each) for each in motion.step(arm(), i * period))
        if motion.arrived:
            break
        assert np.linalg.norm(velocity) <= limits.speed * (1 + 1e-9)
        assert np.linalg.norm(rate) <= limits.turning * (1 + 1e-9)
        assert np.linalg.norm(velocity - before) <= limits.acceleration * period * (1 + 1e-9)
        place, turn, before = place + period * velocity, Rotation.from_rotvec(period * rate) * turn, velocity
    assert motion.arrived
    assert not motion.late


@pytest.mark.slow
def test_outcomes_say_what_a_touch_met():
    """After nothing the next touch follows; three obstructions end the run; a contact that yields slid."""
    far = replace(step(0.0), standoff=(0.0, 0.0, RADIUS + 0.02), height=RADIUS + 0.02)
    assert touched(far, step(0.01))[0].outcomes == [TouchOutcome.NOTHING, TouchOutcome.FELT]
    yielding = replace(WANTED, press_distance=2e-4)
    assert touched(step(0.0, 0.0, (3.0,)), parameters=yielding)[0].outcomes == [TouchOutcome.SLID]
    below = replace(step(0.0), standoff=(0.0, 0.0, RADIUS - 0.002))
    controller, record, plane = touched(*[below] * 6)
    assert controller.outcomes == [TouchOutcome.OBSTRUCTED] * MOST_OBSTRUCTED
    assert record[-1][1].phase is Phase.LOST
    assert max(math.hypot(*now.fingers[0].force) for now, _ in record) < 0.3 + STIFFNESS * 0.05 * 0.02
    assert plane.force == 0.0
