"""Set forces over time: rates are derivatives, bounds are kept, and their feed-forward takes the lag away."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import ConstantForce, DirectForce, NormalForce, RampForce, SineForce, force_gain
from palpate.errors import InvalidValueError

PROFILES = [ConstantForce(2.0), RampForce(1.0, 4.0, 0.7, 0.5), RampForce(4.0, 1.0, 2.0), SineForce(3.0, 2.0, 0.8)]


@pytest.mark.parametrize("profile", PROFILES, ids=repr)
def test_the_rate_is_the_force_s_derivative(profile):
    times = np.linspace(0.0, 6.0, 6001)
    forces, rates = np.array([profile.at(t) for t in times]).T
    # trapezia: exact but at the two bends of a ramp
    gathered = forces[0] + np.concatenate([[0.0], np.cumsum(0.5e-3 * (rates[1:] + rates[:-1]))])
    assert np.abs(gathered - forces).max() < 3e-3
    assert forces.min() > 0.0


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.floats(0.1, 20.0), st.floats(0.1, 20.0), st.floats(0.01, 100.0), st.floats(0.0, 100.0))
def test_a_ramp_stays_between_its_ends_and_gets_there(first, last, rate, time):
    ramp = RampForce(first, last, rate)
    force, _ = ramp.at(time)
    assert min(first, last) * (1 - 1e-12) <= force <= max(first, last) * (1 + 1e-12)
    assert ramp.at(0.0)[0] == first
    assert ramp.at(abs(last - first) / rate * 1.001 + 1e-9) == (last, 0.0)


@pytest.mark.parametrize("feed_forward", [True, False])
def test_with_the_rate_fed_forward_a_sine_is_followed_without_lag(feed_forward):
    """On a delayed spring: F' = K v(t - T), so v = F_set'(t + T) / K is all that it takes."""
    stiffness, steps, period = 10e3, 20, 1e-3
    gain = force_gain(stiffness, (steps + 0.5) * period)
    control = NormalForce(DirectForce(gain), stiffness, gain.delay, period)
    profile, felt, underway, errors = SineForce(3.0, 1.0, 1.0), 3.0, [0.0] * steps, []
    for i in range(3000):
        wanted, _ = profile.at(i * period)
        rate = profile.at(i * period + gain.delay)[1] if feed_forward else 0.0
        underway.append(control.step(wanted, felt, gain.gain, 1.0, rate))
        errors.append(wanted - felt)
        felt += period * stiffness * underway.pop(0)
    worst = np.abs(errors[1000:]).max()
    proportional = 2.0 * math.pi / (gain.gain * stiffness)  # F_set' / (k K)
    assert worst < 0.01 if feed_forward else worst == pytest.approx(proportional, rel=0.1)


def test_a_profile_that_would_pull_is_refused():
    with pytest.raises(InvalidValueError, match="pull"):
        SineForce(1.0, 1.0, 1.0)
    with pytest.raises(InvalidValueError, match="rate"):
        RampForce(1.0, 2.0, -1.0)
