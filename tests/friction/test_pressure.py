"""Limit surfaces from pressure: against the integral over the area, and what the fit promises."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from palpate.friction.pressure import (
    fitted_limit_surface,
    limit_curve,
    load_about_centre,
    spin_radius,
)

PRESSURES = st.sampled_from([1.0, 2.0, 3.0, 8.0, math.inf]) | st.floats(1.0, 30.0)


def over_the_area(k, d):
    """f_t and tau of the definition: the integral over rings of pressure, each over its angle."""
    t = math.pi * (np.arange(20000) + 0.5) / 20000
    cosine = np.cos(t)

    def ring(r, lever):
        rho = np.sqrt((r - d) ** 2 + 2 * r * d * (1 - cosine))
        return np.mean(((d - r * cosine) if lever == 0 else (r * r - r * d * cosine)) / rho)

    def pressure(r):
        return r if k == math.inf else r * (1 - r**k) ** (1 / k)

    def integral(function):
        parts = [0.0, d, 1.0] if d < 1.0 else [0.0, 1.0]
        return sum(quad(function, *pair, epsabs=1e-9, epsrel=1e-9, limit=200)[0] for pair in pairwise(parts))

    whole = integral(pressure)
    return [integral(lambda r, lever=lever: pressure(r) * ring(r, lever)) / whole for lever in (0, 1)]


@pytest.mark.parametrize(("k", "d"), [(2.0, 0.05), (2.0, 0.7), (math.inf, 0.5), (5.0, 1.0), (3.0, 4.0)])
def test_it_is_the_integral_over_the_area(k, d):
    assert load_about_centre(k, d) == pytest.approx(over_the_area(k, d), abs=1e-6)


def test_the_spin_radius_of_known_pressures():
    assert spin_radius(2.0) == pytest.approx(3.0 * math.pi / 16.0, rel=1e-14)  # Hertz
    assert spin_radius(math.inf) == pytest.approx(2.0 / 3.0)
    assert spin_radius(300.0) == pytest.approx(2.0 / 3.0, rel=1e-4)
    assert spin_radius(1.0) == pytest.approx(0.5, rel=1e-14)  # a cone: (1/3 - 1/4) / (1/2 - 1/3)


@settings(deadline=None, max_examples=30)
@given(PRESSURES)
def test_a_centre_in_the_middle_spins_and_a_far_one_slides(k):
    assert load_about_centre(k, 1e-6) == pytest.approx((0.0, spin_radius(k)), abs=1e-5)
    assert load_about_centre(k, 1e6) == pytest.approx((1.0, 0.0), abs=1e-5)


@settings(deadline=None, max_examples=30)
@given(PRESSURES, st.floats(0.01, 10.0), st.floats(0.01, 10.0))
def test_a_slip_takes_more_power_from_its_own_load_than_from_that_of_another_slip(k, d, other):
    """Maximum dissipation: about a centre at d the slip is (d, 1) times its spin."""
    (force, torque), (also, too) = load_about_centre(k, d), load_about_centre(k, other)
    assert force * d + torque >= (also * d + too) * (1.0 - 1e-9)


@settings(deadline=None, max_examples=20)
@given(PRESSURES)
def test_the_curve_is_convex_and_between_diamond_and_circle(k):
    curve = limit_curve(k)
    steps = np.diff(curve, axis=0)
    assert (steps[:, 0] > 0.0).all()
    assert (steps[:, 1] < 0.0).all()
    assert (np.diff(steps[:, 1] / steps[:, 0]) < 1e-9).all()
    assert (curve.sum(axis=1) >= 1.0 - 1e-9).all()
    assert (np.hypot(*curve.T) <= 1.0 + 1e-9).all()


@settings(deadline=None, max_examples=20)
@given(PRESSURES, st.floats(1e-3, 0.02), st.floats(0.1, 1.5))
def test_the_fit_is_within_one_percent_and_its_error_is_what_it_says(k, radius, friction):
    fitted = fitted_limit_surface(k, radius, 0.25, friction)
    surface = fitted.surface
    assert fitted.largest_error < 0.0095 < 0.05 < fitted.error_of_ellipse < 0.066
    assert surface.spin_length == pytest.approx(radius * spin_radius(k))
    fine = limit_curve(k, 333)
    e = surface.spin_length_at(3.0)
    ratios = [surface.load_ratio(3.0, 3 * friction * x, 3 * friction * e * y) for x, y in fine]
    assert np.abs(np.array(ratios) - 1.0).max() == pytest.approx(fitted.largest_error, rel=1e-2)


@settings(deadline=None, max_examples=10)
@given(PRESSURES)
def test_no_other_exponent_fits_better(k):
    fitted, curve = fitted_limit_surface(k, 0.005, 0.0, 0.5), limit_curve(k)
    for p in (fitted.surface.norm_exponent - 0.01, fitted.surface.norm_exponent + 0.01):
        assert np.abs(np.sum(curve**p, axis=1) ** (1.0 / p) - 1.0).max() > fitted.largest_error
