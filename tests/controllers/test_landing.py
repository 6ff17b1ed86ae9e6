"""Landing: the promised peak is kept by a mass on a spring, whatever the numbers; the transfer is bumpless."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import BumplessTransfer, LandingModel, series_stiffness
from palpate.controllers.landing import meeting_speed
from palpate.errors import InvalidValueError


def knock(speed, servo, contact, mass, damping_ratio, delay):
    """Peak of the contact force: a mass on a servo that goes on for a delay, then stops, meets a spring."""
    dt = min(2e-5, 0.02 * math.sqrt(mass / (contact + servo)))
    position = reference = 0.0
    velocity, peak, time = speed, 0.0, 0.0
    servo_damping = 2.0 * math.sqrt(servo * mass)
    damping = 2.0 * damping_ratio * math.sqrt(contact * mass)
    # a steady ramp: the servo trails so far that its spring balances its damping
    reference = speed * servo_damping / servo
    while time < 0.2:
        force = max(contact * position + damping * velocity, 0.0)
        peak = max(peak, force)
        velocity += dt / mass * (servo * (reference - position) - servo_damping * velocity - force)
        position += dt * velocity
        reference += dt * speed if time < delay else 0.0
        time += dt
    return peak


@settings(max_examples=40, deadline=None, derandomize=True)
@given(
    st.floats(2e3, 5e5),
    st.floats(0.5, 10.0),
    st.floats(60.0, 200.0),
    st.sampled_from([0.0, 0.3, 1.0]),
    st.floats(0.5, 5.0),
)
def test_the_speed_of_landing_keeps_the_peak(contact, mass, bandwidth, damping_ratio, force):
    """The servo goes on for one and a half periods, and then for its own lag."""
    servo, delay = mass * bandwidth**2, 1.5e-3
    model = LandingModel(series_stiffness(contact, servo), delay + 2.0 / bandwidth, contact, mass)
    speed = model.speed(force)
    assert knock(speed, servo, contact, mass, damping_ratio, delay) <= (force + 1.0) * (1.0 + 1e-9)
    assert model.peak(speed) == pytest.approx(force + 1.0)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.floats(1e2, 1e6), st.floats(1.01, 10.0))
def test_stiffer_means_slower(stiffness, factor):
    soft, stiff = (LandingModel(k, 0.02, k, 5.0).speed(2.0) for k in (stiffness, factor * stiffness))
    assert stiff < soft


def test_a_touch_noticed_too_late_is_refused():
    with pytest.raises(InvalidValueError, match="touch_force"):
        LandingModel(1e4, 0.02, 1e4).speed(1.0, touch_force=2.0)


def test_the_bumpless_transfer_begins_with_what_is_felt_and_ends_with_what_is_wanted():
    transfer = BumplessTransfer(0.2)
    assert transfer.force(5.0, 0.7, 2.0) == pytest.approx(0.7)
    forces = [transfer.force(5.0 + 1e-3 * i, 9.9, 2.0) for i in range(200)]
    assert np.all(np.diff(forces) >= 0.0)
    assert np.diff(forces).max() < 0.014
    assert forces[100:] == pytest.approx([2.0] * 100)
    transfer.reset()
    assert transfer.force(6.0, 3.5, 2.0) == 2.0  # a knock is not held


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(0.0001, 0.005), st.floats(0.002, 0.05), st.floats(0.002, 0.03), st.floats(0.0, 1.0))
def test_what_goes_up_and_down_is_met_no_faster_than_stated(landing, fastest, amplitude, phase):
    """A tip that comes down steadily on a sine, wherever that begins."""
    rate = fastest / amplitude
    time = np.linspace(0.0, 2.0 * math.pi / rate * 3.0 + 2.2 * amplitude / landing, 400_001)
    surface = amplitude * np.sin(rate * time + 2.0 * math.pi * phase)
    tip = 1.05 * amplitude - landing * time
    first = int(np.argmax(tip <= surface))
    upward = amplitude * rate * math.cos(rate * time[first] + 2.0 * math.pi * phase)
    assert landing + upward <= meeting_speed(landing, fastest) * 1.001


@settings(max_examples=40, deadline=None, derandomize=True)
@given(st.floats(4.0, 20.0), st.floats(0.001, 0.05))
def test_the_speed_of_landing_on_motion_keeps_the_force(most, fastest):
    model = LandingModel(14e3, 0.0215, 20e3, 5.0)
    speed = model.speed_on_motion(most, fastest)
    assert model.peak(meeting_speed(speed, fastest)) == pytest.approx(most, rel=1e-6)
