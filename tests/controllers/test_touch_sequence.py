"""Touches one after the other, on a made-up plane: where the tip rests, with which force, and what is told."""

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
from palpate.errors import InvalidValueError
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
    controller, record, _ = touched(step(0.0, 0.0, (1.0, 3.0)), step(0.01, 0.3, (2.0,)))
    assert controller.outcomes == [TouchOutcome.FELT] * 2
    assert [(span.touch, span.force) for span in controller.spans] == [(0, 1.0), (0, 3.0), (1, 2.0)]
    assert record[-1][1].phase is Phase.DONE
    for span in controller.spans:
        for begin, end, force in ((*span.air, 0.0), (*span.held, span.force)):
            held = [now for now, _ in record if begin <= now.time < end]
            assert len(held) >= round(0.03 / PERIOD) - 1
            felt = [now.fingers[0].contact.normal_force if now.fingers[0].touching else 0.0 for now in held]
            np.testing.assert_allclose(felt, force, atol=0.05)
            assert max(math.hypot(*now.arm.velocity_base_tip) for now in held) == 0.0


def test_the_tip_is_turned_as_wanted_where_it_touches():
    controller, record, _ = touched(step(0.0, 0.4))
    (span,) = controller.spans
    held = next(now for now, _ in record if now.time >= span.held[0])
    off = Rotation.from_matrix(held.arm.rotation_base_tip).inv() * Rotation.from_rotvec((0, 0.4, 0))
    assert off.magnitude() <= ALIGNED


def test_it_passes_no_lower_than_it_may_and_is_back_up_at_the_end():
    _, record, _ = touched(step(0.0), step(0.02))
    across = [now.arm.position_base_tip for now, _ in record if 0.003 < now.arm.position_base_tip[0] < 0.017]
    assert min(z for _, _, z in across) >= HIGH - 1e-3
    assert record[-1][0].arm.position_base_tip[2] >= HIGH - 1e-3


def test_what_is_not_there_is_told_and_the_next_touch_follows():
    deep = RubbedPlane()
    far = replace(step(0.0), standoff=(0.0, 0.0, RADIUS + 0.02), height=RADIUS + 0.02)
    controller, _, _ = touched(far, step(0.01), plane=deep)
    assert controller.outcomes == [TouchOutcome.NOTHING, TouchOutcome.FELT]


def test_what_is_in_the_way_is_told_and_three_in_a_row_end_the_run():
    below = replace(step(0.0), standoff=(0.0, 0.0, RADIUS - 0.002))
    controller, record, plane = touched(*[below] * 6)
    assert controller.outcomes == [TouchOutcome.OBSTRUCTED] * MOST_OBSTRUCTED
    assert record[-1][1].phase is Phase.LOST
    assert max(math.hypot(*now.fingers[0].force) for now, _ in record) < 0.3 + STIFFNESS * 0.05 * 0.02
    assert plane.force == 0.0


def test_what_sinks_in_is_told():
    controller, _, _ = touched(step(0.0, 0.0, (3.0,)), parameters=replace(WANTED, press_distance=2e-4))
    assert controller.outcomes == [TouchOutcome.SLID]


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


def test_nothing_to_touch_and_no_force_are_refused():
    with pytest.raises(InvalidValueError, match="there are no touches"):
        TouchSequence(WANTED, (), PERIOD)
    with pytest.raises(InvalidValueError, match="there are none"):
        step(0.0, 0.0, ())


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
