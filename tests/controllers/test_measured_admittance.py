"""The admittance that a measured response asks for: its margins are true, damping does not limit it."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers.measured_admittance import MIN_PHASE_MARGIN, STIFFER, measured_admittance
from palpate.controllers.measured_loop import ForceResponse

PERIOD = 1e-3


def response(stiffness, damping_time, delay, servo=0.0):
    """Of a contact K + c s behind a pure delay, and a servo with a lag."""
    w = 2.0 * math.pi * np.geomspace(2.0, 200.0, 14)
    P = stiffness * (1.0 + 1j * w * damping_time) * np.exp(-1j * w * delay) / (1.0 + 1j * w * servo)
    return ForceResponse(w, P, PERIOD)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(1e3, 1e5), st.floats(0.015, 0.15), st.floats(0.5e-3, 3e-3))
def test_a_damped_contact_bears_a_larger_gain_with_a_lag_and_keeps_the_margins(stiffness, damping_time, delay):
    felt = response(stiffness, damping_time, delay)
    found = measured_admittance(felt, stiffness)
    assert found is not None
    gain, lag = found.gain.gain, found.body.lag
    assert gain > 2.0 * felt.gain()
    # the loop itself, not what the code says of it
    w = np.geomspace(2.0, 200.0, 20000) * 2.0 * math.pi
    P = stiffness * (1.0 + 1j * w * damping_time) * np.exp(-1j * w * (delay + 0.5 * PERIOD))
    L = gain * P / (1j * w * (1.0 + 1j * w * lag))
    for share, least in ((1.0, 90.0 - math.degrees(0.5)), (STIFFER, MIN_PHASE_MARGIN)):
        over = np.flatnonzero(share * np.abs(L) >= 1.0)
        if len(over) and over[-1] < len(w) - 1:
            # 14 measured frequencies are interpolated: a degree or two
            assert 180.0 + math.degrees(np.unwrap(np.angle(L))[over[-1]]) > least - 3.0
    beyond = np.flatnonzero(np.unwrap(np.angle(L)) <= -math.pi)
    if len(beyond):
        assert 1.0 / np.abs(L[beyond[0]]) >= math.pi - 0.1
    # even if the contact should lose all its damping the loop is stable
    assert found.body.gain_margin > 1.0


@pytest.mark.parametrize("delay", [0.005, 0.02])
def test_where_delay_is_what_limits_there_is_nothing_to_gain(delay):
    assert measured_admittance(response(20e3, 0.0, delay), 20e3) is None


def test_scaling_the_stiffness_scales_the_gain_alone():
    soft, stiff = (measured_admittance(response(K, 0.03, 1e-3), K) for K in (1e3, 1e5))
    assert stiff.gain.gain == pytest.approx(0.01 * soft.gain.gain, rel=1e-9)
    assert stiff.body.lag == pytest.approx(soft.body.lag)
    assert stiff.phase_margin_deg == pytest.approx(soft.phase_margin_deg)
