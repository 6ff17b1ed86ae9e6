"""What a regulation is made of: motions, force programs, the reference, answers to steps and sines."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import (
    CircleMotion,
    ReferenceForce,
    SineMotion,
    StepForce,
    Still,
    Tones,
    VelocityTable,
)
from palpate.errors import InvalidValueError
from palpate.experiments.regulate.response import frequency_response, step_response
from palpate.runtime.data import Phase
from palpate.runtime.touch import Touch
from runtime.puppets import sample
from support.regulate_runs import planned

sizes, rates = st.floats(1e-3, 0.05), st.floats(0.05, 5.0)


# --- motions ---


@settings(deadline=None, max_examples=30)
@given(sizes, rates)
def test_a_sine_motion_begins_at_rest_and_comes_back(amplitude, frequency):
    motion = SineMotion(amplitude, frequency, (0.0, 3.0, 0.0))
    time = np.linspace(0.0, 1.0 / frequency, 2001)
    speed = np.array([motion.velocity(t) for t in time])
    assert motion.velocity(0.0) == (0.0, 0.0, 0.0)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:, 1] + speed[:-1, 1]) * np.diff(time))])
    assert way[-1] == pytest.approx(0.0, abs=1e-6 * amplitude)
    assert np.ptp(way) == pytest.approx(2.0 * amplitude, rel=1e-3)


@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(sizes, rates, st.floats(0.0, 10.0))
def test_a_circle_has_one_speed_and_no_height(radius, frequency, time):
    x, y, z = CircleMotion(radius, frequency).velocity(time)
    assert math.hypot(x, y) == pytest.approx(2.0 * math.pi * radius * frequency)
    assert z == 0.0


def test_a_table_is_straight_between_its_lines_and_level_outside():
    table = VelocityTable((1.0, 2.0), ((0.0, 0.0, 0.0), (0.02, 0.0, -0.01)))
    assert table.velocity(0.0) == table.velocity(1.0) == (0.0, 0.0, 0.0)
    assert table.velocity(1.25) == pytest.approx((0.005, 0.0, -0.0025))
    assert table.velocity(9.0) == (0.02, 0.0, -0.01)
    assert Still().velocity(3.0) == (0.0, 0.0, 0.0)


def test_tables_that_go_back_or_lack_something_are_refused():
    with pytest.raises(InvalidValueError, match=r"times\[1\] = 1 s: must be later than 1 s"):
        VelocityTable((1.0, 1.0), ((0.0, 0.0, 0.0),) * 2)
    with pytest.raises(InvalidValueError, match="1 times and 2 velocities"):
        VelocityTable((1.0,), ((0.0, 0.0, 0.0),) * 2)


# --- programs ---


def test_steps_go_up_and_down_and_each_has_its_hold():
    steps = StepForce(2.0, 3.0, 0.5)
    assert [steps.at(t)[0] for t in (-1.0, 0.0, 0.49, 0.5, 0.99, 1.0, 1.5)] == [2.0, 2.0, 2.0, 3.0, 3.0, 2.0, 3.0]
    assert steps.steps(2.0) == (0.5, 1.0, 1.5)


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(0.2, 30.0), min_size=1, max_size=5), st.floats(0.1, 1.9))
def test_tones_join_without_a_jump_and_their_rate_is_their_slope(frequencies, amplitude):
    tones = Tones(2.0, amplitude, frequencies)
    for begin in tones.begins:
        assert tones.at(begin - 1e-9)[0] == pytest.approx(2.0, abs=1e-6)
        assert tones.at(begin + 1e-9)[0] == pytest.approx(2.0, abs=1e-6)
    for time in np.linspace(tones.begin, tones.duration - 1e-3, 50):
        if min(abs(time - begin) for begin in tones.begins) < 1e-5:
            continue
        before, after = tones.at(time - 1e-6)[0], tones.at(time + 1e-6)[0]
        assert (after - before) / 2e-6 == pytest.approx(tones.at(time)[1], abs=1e-3 * amplitude * 200.0)
        assert tones.at(time)[0] > 0.0


def test_tones_that_would_pull_are_refused():
    with pytest.raises(InvalidValueError, match=r"amplitude = 2 N.*have to pull"):
        Tones(2.0, 2.0, (1.0,))


# --- the reference ---


@settings(deadline=None, max_examples=50)
@given(st.floats(0.005, 0.1), st.floats(2e-4, 8e-3), st.floats(0.5, 5.0), st.floats(0.5, 5.0))
def test_the_reference_follows_a_step_exactly_without_overshoot_whatever_the_period(tau, period, first, second):
    reference = ReferenceForce(tau, period)
    reference.reset(first, 0.0)
    for i in range(1, 40):
        reference.step(second, 0.0)
        x = i * period / tau
        assert reference.force == pytest.approx(second + (first - second) * (1.0 + x) * math.exp(-x), abs=1e-9)
        assert reference.rate == pytest.approx((second - first) * x / tau * math.exp(-x), abs=1e-6)
        assert min(first, second) - 1e-9 <= reference.force <= max(first, second) + 1e-9


def test_the_reference_follows_a_ramp_one_time_constant_behind():
    tau, period, rate = 0.02, 1e-3, 3.0
    reference = ReferenceForce(tau, period)
    reference.reset(0.0, 0.0)
    for i in range(1, 1000):
        reference.step(rate * i * period, rate)
    assert rate * 0.999 - reference.force == pytest.approx(rate * tau, abs=2e-3 * rate)
    assert reference.rate == pytest.approx(rate, rel=1e-3)


# --- answers ---


@pytest.mark.parametrize(("first", "second"), [(2.0, 3.0), (3.0, 2.0)])
def test_the_answer_to_steps_of_a_first_order_lag_is_what_it_must_be(first, second):
    tau, time = 0.05, np.arange(0.0, 2.0, 1e-3)
    force = np.where(time < 1.0, first, second + (first - second) * np.exp(-(time - 1.0) / tau))
    found = step_response(time, force, [(1.0, first, second)], 0.9)
    assert found.rise_time == pytest.approx(tau * math.log(9.0), rel=1e-3)
    assert found.settling_time == pytest.approx(tau * math.log(20.0), abs=1.1e-3)
    assert found.overshoot == 0.0


@settings(deadline=None, max_examples=20)
@given(st.floats(0.3, 0.8))
def test_the_overshoot_of_an_oscillator_is_that_of_its_damping(damping):
    w, time = 40.0, np.arange(0.0, 2.0, 1e-3)
    wd = w * math.sqrt(1.0 - damping**2)
    since = time - 1.0
    answer = 1.0 - np.exp(-damping * w * since) * (np.cos(wd * since) + damping * w / wd * np.sin(wd * since))
    found = step_response(time, np.where(since < 0.0, 2.0, 2.0 + answer), [(1.0, 2.0, 3.0)], 0.9)
    assert found.overshoot == pytest.approx(math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2)), abs=2e-3)


def test_steps_that_are_not_whole_are_no_response():
    time = np.arange(0.0, 1.0, 1e-3)
    assert step_response(time, np.ones(1000), [(0.8, 1.0, 2.0)], 0.5) is None
    assert step_response(time, np.full(1000, np.nan), [(0.2, 1.0, 2.0)], 0.5) is None
    assert step_response(time[:1], np.ones(1), [(0.2, 1.0, 2.0)], 0.5) is None


@settings(deadline=None, max_examples=20)
@given(st.floats(0.5, 8.0), st.floats(0.0, 0.02), st.floats(-1.0, 1.0))
def test_the_answer_to_sines_of_a_lag_and_delay_is_what_it_must_be(corner, delay, offset):
    """And the bandwidth is the lag's corner, within what interpolation over an octave can do."""
    tones = Tones(2.0, 1.0, (0.5, 1.0, 2.0, 4.0, 8.0, 16.0))
    time = np.arange(0.0, tones.duration, 1e-3)
    wanted = np.array([tones.at(t)[0] for t in time])
    force = np.full_like(time, 2.0 + offset)
    for begin, end, frequency in zip(tones.begins, tones.begins[1:], tones.frequencies, strict=False):
        inside = (time >= begin) & (time < end)
        ratio = np.exp(-2j * math.pi * frequency * delay) / (1.0 + 1j * frequency / corner)
        angle = 2.0 * math.pi * frequency * (time[inside] - begin)
        force[inside] += abs(ratio) * np.sin(angle + np.angle(ratio))
    found = frequency_response(time, wanted, force, tones.begins, tones.frequencies)
    assert found.gain == pytest.approx(1.0 / np.hypot(1.0, found.frequency / corner), rel=1e-6)
    assert found.phase_deg == pytest.approx(
        -np.degrees(np.arctan(found.frequency / corner)) - 360.0 * found.frequency * delay, abs=1e-4
    )
    assert found.bandwidth == pytest.approx(corner, rel=0.06)


def test_sines_that_were_not_finished_are_no_response():
    tones = Tones(2.0, 1.0, (1.0, 2.0))
    time = np.arange(0.0, tones.begins[1] - 1.6, 1e-3)
    wanted = np.array([tones.at(t)[0] for t in time])
    assert frequency_response(time, wanted, wanted, tones.begins, tones.frequencies) is None
    time = np.arange(0.0, tones.duration - 0.9, 1e-3)
    wanted = np.array([tones.at(t)[0] for t in time])
    found = frequency_response(time, wanted, wanted, tones.begins, tones.frequencies)
    assert found.frequency.tolist() == [1.0]
    assert found.bandwidth is None


@pytest.mark.parametrize("stall", [0.01, 0.1])
def test_a_stall_while_the_force_settles_does_not_make_it_press_faster(stall):
    """The set point goes on by time meanwhile: taken for a jump in a period, it commanded four times as much."""

    def fastest(pause):
        plan, time = planned(duration=1.0, assumed_stiffness=2000.0), 0.0
        controller, touch, speeds = plan.controller(), Touch(*plan.fingers), []
        controller.start(touch.sense(sample(time)))
        for i in range(300):
            time += pause if i == 100 else 1e-3
            command = controller.step(touch.sense(sample(time, wrench=(0.0, 0.0, 0.5, 0.0, 0.0, 0.0))))
            assert command.phase is Phase.SETTLE
            speeds.append(-command.velocity_base_tip[2])
        return max(speeds)

    assert fastest(stall) < 1.3 * fastest(1e-3)
