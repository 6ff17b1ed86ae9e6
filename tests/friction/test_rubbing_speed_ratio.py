"""mu at a speed at which nobody rubbed: a twist's mu and speed together, and an interval that holds the truth."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.friction.rubbing.estimate import Estimate
from palpate.friction.rubbing.speed_curve import SpeedPoint, fit_speed_curve
from palpate.friction.rubbing.speed_ratio import friction_ratio, spin_friction

SPEEDS = (0.0025, 0.005, 0.01, 0.02, 0.04)


def points_of(law, speeds=SPEEDS, noise=1e-5):
    return [SpeedPoint(v, Estimate(law(v), noise, 0.0)) for v in speeds]


def stribeck(mu, rise, speed, power=2.0):
    return lambda v: mu + rise * math.exp(-((v / speed) ** power))


@settings(deadline=None, max_examples=25)
@given(st.floats(0.3, 0.8), st.floats(0.0, 0.3), st.floats(0.004, 0.02), st.floats(0.003, 0.035))
def test_on_the_law_itself_a_twist_gets_its_own_mu_and_speed(mu, rise, v_s, speed):
    law = stribeck(mu, rise, v_s)
    points = points_of(law)
    curve = fit_speed_curve(points)
    found, slow = spin_friction(curve, points, speed * law(speed), Estimate(law(0.01), 0.0, 0.0), 0.01)
    low, high = found.interval()
    assert low - 2e-3 * mu <= law(speed) <= high + 2e-3 * mu
    assert found.value == pytest.approx(law(speed), rel=0.02)
    assert slow * found.value == pytest.approx(speed * law(speed), rel=1e-6)


@pytest.mark.parametrize("speeds", [SPEEDS, (0.0025, 0.01), (0.003, 0.01, 0.03)])
@pytest.mark.parametrize("power", [1.0, 0.7, 3.0])
def test_what_follows_another_law_stays_within_the_interval(power, speeds):
    """A drop of any shape between two speeds: the interval of mu there is as wide as that leaves open."""
    law = stribeck(0.5, 0.2, 0.006, power)
    points = points_of(law, speeds)
    curve = fit_speed_curve(points)
    for speed in np.geomspace(max(0.003, speeds[0]), 0.0099, 6).tolist():
        ratio = friction_ratio(curve, points, speed, 0.01)
        low, high = ratio.interval()
        assert low - 2e-3 <= law(speed) / law(0.01) <= high + 2e-3


def test_at_a_rubbed_speed_it_is_what_was_measured_and_as_sure():
    points = [SpeedPoint(v, Estimate(mu, 1e-3, 0.0)) for v, mu in ((0.002, 0.7), (0.01, 0.5))]
    curve = fit_speed_curve(points)  # two speeds: a constant, which goes through neither
    ratio = friction_ratio(curve, points, 0.002, 0.01)
    assert ratio.value == pytest.approx(1.4)
    assert ratio.model == pytest.approx(0.0, abs=1e-9)
    between = friction_ratio(curve, points, 0.0045, 0.01)
    assert 1.0 < between.value < 1.4
    assert between.model > 0.05
    beyond = friction_ratio(curve, points, 0.001, 0.01)
    assert beyond.model > 0.02


def test_constant_friction_is_taken_as_it_is():
    points = points_of(lambda v: 0.5)
    curve = fit_speed_curve(points)
    found, slow = spin_friction(curve, points, 0.5 * 0.006, Estimate(0.5, 1e-3, 2e-3), 0.01)
    assert (found.value, slow) == (pytest.approx(0.5), pytest.approx(0.006))
    assert found.standard_deviation == pytest.approx(math.hypot(1e-3, 2e-3), rel=0.01)


def test_speeds_that_crept_do_not_count():
    points = points_of(lambda v: 0.5, (0.005, 0.01, 0.02))
    creeping = [SpeedPoint(0.001, Estimate(0.2, 1e-5, 0.0)), *points]
    curve = fit_speed_curve(creeping)
    assert curve.creeping == (0.001,)
    assert friction_ratio(curve, creeping, 0.006, 0.01).value == pytest.approx(1.0)
