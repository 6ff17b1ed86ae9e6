"""Pieces of a regulation: motions, force programs, responses, damped contacts and filtered set points."""

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
    SurfaceFilter,
    SurfaceMotion,
    Tones,
    VelocityTable,
    force_gain,
)
from palpate.controllers.damped_contact import (
    MIN_GAIN_MARGIN,
    MIN_MODULUS_MARGIN,
    DampedContact,
    SpringMounting,
)
from palpate.controllers.gated_surface_motion import GatedSurfaceMotion
from palpate.controllers.regulate_parameters import RegulateParameters, live_regulation
from palpate.controllers.set_force import SetForce
from palpate.controllers.set_point_filter import SetPointFilter
from palpate.controllers.tangent_motion import PathTable
from palpate.experiments.regulate.response import frequency_response, step_response
from palpate.runtime.data import Phase
from palpate.runtime.touch import Touch
from runtime.puppets import sample
from support.regulate_runs import planned

sizes, rates = st.floats(1e-3, 0.05), st.floats(0.05, 5.0)


@settings(deadline=None, max_examples=30)
@given(sizes, rates)
def test_a_sine_motion_begins_at_rest_and_comes_back(amplitude, frequency):
    motion, circle = SineMotion(amplitude, frequency, (0.0, 3.0, 0.0)), CircleMotion(amplitude, frequency)
    time = np.linspace(0.0, 1.0 / frequency, 2001)
    speed = np.array([motion.velocity(t) for t in time])
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:, 1] + speed[:-1, 1]) * np.diff(time))])
    assert motion.velocity(0.0) == (0.0, 0.0, 0.0)
    assert way[-1] == pytest.approx(0.0, abs=1e-6 * amplitude)
    assert np.ptp(way) == pytest.approx(2.0 * amplitude, rel=1e-3)
    x, y, z = np.array([circle.velocity(t) for t in time[::400]]).T
    assert np.hypot(x, y) == pytest.approx(2.0 * math.pi * amplitude * frequency)
    assert not z.any()


def test_steps_go_up_and_down_and_each_has_its_hold():
    steps = StepForce(2.0, 3.0, 0.5)
    assert [steps.at(t)[0] for t in (-1.0, 0.0, 0.49, 0.5, 0.99, 1.0, 1.5)] == [2.0, 2.0, 2.0, 3.0, 3.0, 2.0, 3.0]
    assert steps.steps(2.0) == (0.5, 1.0, 1.5)
    table = VelocityTable((1.0, 2.0), ((0.0, 0.0, 0.0), (0.02, 0.0, -0.01)))
    assert table.velocity(0.0) == table.velocity(1.0) == Still().velocity(3.0) == (0.0, 0.0, 0.0)
    assert table.velocity(1.25) == pytest.approx((0.005, 0.0, -0.0025))
    assert table.velocity(9.0) == (0.02, 0.0, -0.01)


@settings(deadline=None, max_examples=30)
@given(st.lists(st.floats(0.2, 30.0), min_size=1, max_size=5), st.floats(0.1, 1.9))
def test_tones_join_without_a_jump_and_their_rate_is_their_slope(frequencies, amplitude):
    tones = Tones(2.0, amplitude, frequencies)
    joints = [tones.at(begin + side)[0] for begin in tones.begins for side in (-1e-9, 1e-9)]
    assert joints == pytest.approx([2.0] * len(joints), abs=1e-6)
    for time in np.linspace(tones.begin, tones.duration - 1e-3, 50):
        slope = (tones.at(time + 1e-6)[0] - tones.at(time - 1e-6)[0]) / 2e-6
        joins = min(abs(time - begin) for begin in tones.begins) < 1e-5
        assert joins or slope == pytest.approx(tones.at(time)[1], abs=1e-3 * amplitude * 200.0)
        assert joins or tones.at(time)[0] > 0.0


@pytest.mark.parametrize(("first", "second"), [(2.0, 3.0), (3.0, 2.0)])
def test_the_response_of_a_first_order_lag_to_steps_is_exact(first, second):
    tau, time = 0.05, np.arange(0.0, 2.0, 1e-3)
    force = np.where(time < 1.0, first, second + (first - second) * np.exp(-(time - 1.0) / tau))
    found = step_response(time, force, [(1.0, first, second)], 0.9)
    assert found.rise_time == pytest.approx(tau * math.log(9.0), rel=1e-3)
    assert found.settling_time == pytest.approx(tau * math.log(20.0), abs=1.1e-3)
    assert found.overshoot == 0.0
    # a step that is not over, forces of NaN, and a single sample are no response
    for times, forces, step in (time, force, 1.8), (time, np.full(2000, np.nan), 1.0), (time[:1], force[:1], 1.0):
        assert step_response(times, forces, [(step, first, second)], 0.5) is None


@settings(deadline=None, max_examples=20)
@given(st.floats(0.3, 0.8))
def test_the_overshoot_of_an_oscillator_is_that_of_its_damping(damping):
    w, time = 40.0, np.arange(0.0, 2.0, 1e-3)
    wd = w * math.sqrt(1.0 - damping**2)
    since = time - 1.0
    answer = 1.0 - np.exp(-damping * w * since) * (np.cos(wd * since) + damping * w / wd * np.sin(wd * since))
    found = step_response(time, np.where(since < 0.0, 2.0, 2.0 + answer), [(1.0, 2.0, 3.0)], 0.9)
    assert found.overshoot == pytest.approx(math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2)), abs=2e-3)


def forces_of(tones, time):
    return np.array([tones.at(t)[0] for t in time])


@settings(deadline=None, max_examples=20)
@given(st.floats(0.5, 8.0), st.floats(0.0, 0.02), st.floats(-1.0, 1.0))
def test_the_response_of_a_lag_and_delay_to_sines_is_exact(corner, delay, offset):
    """The bandwidth is the lag's corner, within the error of interpolation over an octave."""
    tones = Tones(2.0, 1.0, (0.5, 1.0, 2.0, 4.0, 8.0, 16.0))
    time = np.arange(0.0, tones.duration, 1e-3)
    force = np.full_like(time, 2.0 + offset)
    for begin, end, frequency in zip(tones.begins, tones.begins[1:], tones.frequencies, strict=False):
        inside = (time >= begin) & (time < end)
        ratio = np.exp(-2j * math.pi * frequency * delay) / (1.0 + 1j * frequency / corner)
        force[inside] += (ratio * np.exp(2j * math.pi * frequency * (time[inside] - begin))).imag
    found = frequency_response(time, forces_of(tones, time), force, tones.begins, tones.frequencies)
    assert found.gain == pytest.approx(1.0 / np.hypot(1.0, found.frequency / corner), rel=1e-6)
    assert found.phase_deg == pytest.approx(
        -np.degrees(np.arctan(found.frequency / corner)) - 360.0 * found.frequency * delay, abs=1e-4
    )
    assert found.bandwidth == pytest.approx(corner, rel=0.06)


def test_sines_that_were_not_finished_are_no_response():
    tones = Tones(2.0, 1.0, (1.0, 2.0))

    def found(until):
        time = np.arange(0.0, until, 1e-3)
        return frequency_response(time, *[forces_of(tones, time)] * 2, tones.begins, tones.frequencies)

    assert found(tones.begins[1] - 1.6) is None
    first = found(tones.duration - 0.9)
    assert (first.frequency.tolist(), first.bandwidth) == ([1.0], None)


@pytest.mark.parametrize("stall", [0.01, 0.1])
def test_a_stall_while_the_force_settles_does_not_make_it_press_faster(stall):
    """The set point goes on by time meanwhile: taken for a jump in a period, it commanded four times as much."""

    def fastest(pause):
        plan = planned(duration=1.0, assumed_stiffness=2000.0)
        controller, touch, commands = plan.controller(), Touch(*plan.fingers), []
        controller.start(touch.sense(sample(0.0)))
        for i in range(1, 301):
            now = sample(i * 1e-3 + (pause - 1e-3) * (i > 100), wrench=(0.0, 0.0, 0.5, 0.0, 0.0, 0.0))
            commands.append(controller.step(touch.sense(now)))
        assert {command.phase for command in commands} == {Phase.SETTLE}
        return -min(command.velocity_base_tip[2] for command in commands)

    assert fastest(stall) < 1.3 * fastest(1e-3)


PERIOD = 1e-3

stiffnesses, delays = st.floats(300.0, 3e5), st.floats(1.5e-3, 0.05)


@settings(deadline=None, max_examples=30)
@given(stiffnesses, delays, st.floats(0.0, 0.3), st.floats(1e4, 1e6))
def test_the_margins_are_kept_however_it_is_damped(stiffness, delay, damping, servo):
    contact = DampedContact(stiffness, damping, servo)
    found = contact.margins(contact.gain(delay))
    assert found.gain_margin >= MIN_GAIN_MARGIN * (1.0 - 1e-3)
    assert found.modulus_margin >= MIN_MODULUS_MARGIN * (1.0 - 1e-6)
    spring = DampedContact(stiffness).gain(delay)
    assert spring.loop_gain == pytest.approx(force_gain(stiffness, delay).loop_gain, rel=1e-4)


def grows(contact, gain, delay):
    """Whether the loop, simulated with a whole number of delays, ends with larger forces than it began with."""
    step, underway, forces = delay / 200.0, [0.0] * 200, []
    x, spring = 1e-3, 1e-3  # of the tip, and of the contact's spring, the rest being the servo's
    K, c, Ks = contact.stiffness, contact.stiffness * contact.damping_time, contact.servo_stiffness
    for _ in range(200 * 60):
        underway.append(-gain * Ks * (x - spring))
        x += step * underway.pop(0)
        # c spring' + K spring = Ks (x - spring), implicitly
        spring = (c * spring + step * Ks * x) / (c + step * (K + Ks))
        forces.append(abs(Ks * (x - spring)))
    return max(forces[-2000:]) > max(forces[2000:4000])


@pytest.mark.parametrize(("stiffness", "damping"), [(1e3, 0.14), (20e3, 0.03), (5e3, 0.005)])
def test_a_simulated_loop_is_unstable_just_beyond_its_gain_margin(stiffness, damping):
    contact, delay = DampedContact(stiffness, damping, 87e3), 0.02
    critical = contact.gain(delay).gain * contact.margins(contact.gain(delay)).gain_margin
    assert not grows(contact, 0.9 * critical, delay)
    assert grows(contact, 1.1 * critical, delay)


# --- set-point filter ---


@settings(deadline=None, max_examples=30)
@given(st.floats(0.005, 0.1), st.floats(2e-4, 8e-3), st.floats(0.5, 5.0), st.floats(5.1, 9.0), st.booleans())
def test_a_jump_is_gone_over_to_exactly_like_a_critically_damped_spring(tau, period, low, high, falls):
    """Set-point filter and reference follow a step along the same exact curve, without overshoot."""
    first, second = (high, low) if falls else (low, high)
    steps, reference = SetPointFilter(tau, PERIOD), ReferenceForce(tau, period)
    steps.reset(first)
    reference.reset(first, 0.0)
    for i in range(60):
        steps.step(second, 0.0)
        for moved, x in ((steps, i * PERIOD / tau), (reference, i * period / tau)):
            expected = second + (first - second) * (1.0 + x) * math.exp(-x)
            assert moved.force == pytest.approx(expected, abs=1e-9)
            assert moved.rate == pytest.approx((second - first) * x / tau * math.exp(-x), abs=1e-6)
        assert steps.stepping == (
            math.copysign(1.0, second - first) if i <= 5.0 * tau / PERIOD - 1 else steps.stepping
        )
        reference.step(second, 0.0)


@settings(deadline=None, max_examples=20)
@given(st.floats(0.005, 0.1), st.floats(0.5, 20.0))
def test_a_known_rate_passes_the_filter_unchanged(tau, frequency):
    """The reference follows a ramp one time constant behind."""
    tones = Tones(2.0, 0.5, (frequency,), begin=0.0)
    steps, ramped = SetPointFilter(tau, PERIOD), ReferenceForce(0.02, PERIOD)
    steps.reset(2.0)
    for i in range(300):
        force, rate = tones.at(i * PERIOD)
        steps.step(force, rate)
        # but where a sine turns, between two samples
        assert i * PERIOD >= tones.duration or steps.force == pytest.approx(force, abs=5e-3)
        assert steps.stepping == 0.0
    ramped.reset(0.0, 0.0)
    for i in range(1, 1000):
        ramped.step(3.0 * i * PERIOD, 3.0)
    assert 3.0 * 0.999 - ramped.force == pytest.approx(3.0 * 0.02, abs=6e-3)
    assert ramped.rate == pytest.approx(3.0, rel=1e-3)


def test_jumps_without_end_leave_half_of_the_time():
    steps, going = SetPointFilter(0.03, PERIOD), []
    steps.reset(1.0)
    for i in range(2000):
        steps.step(1.0 + (i // 10) % 2, 0.0)
        going.append(steps.stepping != 0.0)
    assert 0.4 < np.mean(going) <= 0.56


@pytest.mark.parametrize("step_time", [0.0, 0.03])
def test_a_set_force_reaches_the_profile_and_hardly_more(step_time):
    """The upper end of the live force range is accepted."""
    profile, forces = StepForce(2.0, 3.0, 1.0), []
    wanted = SetForce(0.02, 0.02, PERIOD, damping_time=0.1, step_time=step_time)
    wanted.hold(2.0)
    for i in range(2000):
        wanted.step(*profile.at(i * PERIOD))
        forces.append(wanted.force)
    assert forces[:1000] == pytest.approx([2.0] * 1000)
    assert forces[-1] == pytest.approx(3.0, abs=1e-6)
    assert max(forces) <= 3.01
    live_regulation(RegulateParameters(force_gain(20e3, 0.02), 0.02, 1.0, 2.0, (0.5, 5.0))).check("force", 5.0)


# --- a surface while the force steps ---

FILTER = SurfaceFilter(20e3, 0.02, 0.06)


@settings(deadline=None, max_examples=20)
@given(st.sampled_from([-1.0, 1.0]), st.floats(0.2, 0.9), st.floats(1.1, 4.0))
def test_a_contact_that_is_softer_than_thought_is_no_surface_that_yields_while_the_force_steps(way, soft, stiff):
    """Only a contact stiffer than assumed shows motion of the surface, against the step."""

    def followed(ratio, periods):
        gated, following, force = GatedSurfaceMotion(FILTER, PERIOD), SurfaceMotion(FILTER, PERIOD), 2.0
        for _ in range(periods):
            force += ratio * FILTER.stiffness * way * 1e-3 * PERIOD
            gated.update_in_step(way * 1e-3, force, way)
            following.update(way * 1e-3, force)
        return gated.velocity * way, following.velocity * way

    gated, following = followed(soft, 100)
    assert gated == pytest.approx(0.0, abs=1e-12)
    assert following > 0.1e-3
    gated, following = followed(stiff, 20)
    assert gated <= following + 1e-12 < 0.0


# --- recorded paths ---


@settings(deadline=None, max_examples=30)
@given(
    st.lists(
        st.tuples(st.floats(0.05, 1.0), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05)), min_size=2, max_size=8
    ),
    st.floats(-100.0, 100.0),
)
def test_a_path_leads_through_its_positions_whenever_its_clock_began(rows, begin):
    times = tuple(begin + sum(step for step, _, _ in rows[:i]) for i in range(len(rows)))
    path = PathTable(times, tuple((x, y, 0.5) for _, x, y in rows))
    at = np.zeros(3)
    for i in range(1, len(rows)):
        # Simpson's rule is exact for the derivative of a cubic
        a, b = times[i - 1] - begin, times[i] - begin
        ends = [np.array(path.velocity(t)) for t in (a + 1e-9, 0.5 * (a + b), b - 1e-9)]
        at = at + (b - a) / 6.0 * (ends[0] + 4.0 * ends[1] + ends[2])
        assert at == pytest.approx(np.array(path.positions[i]) - path.positions[0], abs=1e-6)
    assert path.velocity(0.0) == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert path.velocity(-1.0) == path.velocity(times[-1] - begin + 1.0) == (0.0, 0.0, 0.0)


def test_a_soft_mounting_lowers_the_gain():
    soft = DampedContact(20e3, 0.03, 5e4, SpringMounting(2e3, 60.0, 1.0))
    assert soft.surface_stiffness == pytest.approx(1.0 / (1.0 / 20e3 + 1.0 / 2e3))
    spring = DampedContact(soft.surface_stiffness, soft.surface_damping_time, 5e4)
    assert soft.gain(0.0215).gain < spring.gain(0.0215).gain
