"""Following a surface: what it does is seen without lag, and a wrong stiffness is stable where promised."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import (
    DirectForce,
    ForceGuard,
    GuardSettings,
    NormalForce,
    SurfaceFilter,
    SurfaceMotion,
    force_gain,
    stiffness_range,
    surface_filter,
)
from palpate.controllers.force_guard import MIN_SHARE
from palpate.controllers.surface_motion import closed_loop

PERIOD, STIFFNESS, STEPS = 1e-3, 20e3, 21
GAIN = force_gain(STIFFNESS, (STEPS + 0.5) * PERIOD)
FILTER = surface_filter(STIFFNESS, GAIN, GAIN.delay)
SPEED, AMPLITUDE = 0.02, 0.01
"""Of the surface's sine [m/s, m]."""


def still(_):
    return 0.0


def sine(time):
    return AMPLITUDE * (1.0 - math.cos(SPEED / AMPLITUDE * time))


def pressed(ratio=1.0, surface=still, follow=FILTER, seconds=6.0, knock=0.0, noise=0.0, steps=STEPS):
    """Force of a tip on a surface with `ratio` times the assumed stiffness, and its control."""
    control = NormalForce(DirectForce(GAIN), GAIN.stiffness, GAIN.delay, PERIOD, follow)
    control.start()
    stiffness, wanted = ratio * STIFFNESS, 2.0
    draws = np.random.default_rng(1).normal(0.0, noise, round(seconds / PERIOD)) if noise else None
    position, velocity, underway, forces = wanted / stiffness + knock, 0.0, [0.0] * steps, []
    for i in range(round(seconds / PERIOD)):
        force = max(stiffness * (position - surface(i * PERIOD)), 0.0)
        if force == 0.0 and forces and forces[-1] > 0.0:
            control.lose()
        forces.append(force)
        felt = force + (0.0 if draws is None else float(draws[i]))
        control.watch(velocity, felt)
        underway.append(control.step(wanted, felt, GAIN.gain, 0.02))
        velocity = underway.pop(0)
        position += PERIOD * velocity
    return np.array(forces), control


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.floats(-0.02, 0.02), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_a_parabola_of_velocity_is_predicted_exactly(value, slope, curve):
    """Whatever the force does meanwhile: n.v = s' + F'/K."""
    seen = SurfaceMotion(SurfaceFilter(STIFFNESS, 0.02, 0.03, fastest=10.0), PERIOD)
    rng, before = np.random.default_rng(2), 0.0

    def velocity(t):
        return value + slope * t + curve * t * t

    for i in range(1000):
        force = float(rng.uniform(1.0, 3.0)) if i else 0.0
        seen.update(velocity(i * PERIOD) + (force - before) / (STIFFNESS * PERIOD), force)
        before = force
    assert seen.velocity == pytest.approx(velocity(0.999), abs=1e-6)
    assert seen.predicted == pytest.approx(velocity(0.999 + 0.02), abs=1e-6)


def test_what_is_fed_forward_is_bounded():
    seen = SurfaceMotion(FILTER, PERIOD)
    for _ in range(1000):
        seen.update(1.0, 2.0)
    assert seen.predicted == FILTER.fastest


def test_a_surface_that_moves_as_a_sine_is_followed():
    """Without the forward feed the error is 20 mm/s / k = 12 N: the contact is lost and slammed."""
    forces, control = pressed(surface=sine, noise=3.1e-3)
    assert np.sqrt(np.mean((forces[1000:] - 2.0) ** 2)) < 0.06
    assert control.guard.trips == 0
    unfed, _ = pressed(surface=sine, follow=None)
    assert np.ptp(unfed[1000:]) > 12.0


def test_the_closed_loop_s_matrix_is_the_loop():
    """Its eigenvalues tell how fast the simulated loop's swings decay, until they are rounding."""
    for ratio in (0.6, 1.5):
        growth = np.abs(np.linalg.eigvals(closed_loop(GAIN, FILTER, PERIOD, 1.0, ratio))).max()
        forces, _ = pressed(ratio, knock=1e-6)
        error = np.abs(forces - 2.0)
        early, late = error[400:900].max(), error[1000:1500].max()
        assert (late / early) ** (1 / 600) == pytest.approx(growth, abs=0.003)


def test_the_range_of_stiffnesses_ends_where_the_loop_begins_to_oscillate():
    found = stiffness_range(GAIN, FILTER, PERIOD)
    assert 0.3 < found.softest < 0.5
    assert 1.6 < found.stiffest < 1.9
    for end, inward in ((found.softest, 1.1), (found.stiffest, 1.0 / 1.1)):
        stable, unstable = (
            np.abs(np.linalg.eigvals(closed_loop(GAIN, FILTER, PERIOD, 1.0, end * factor))).max()
            for factor in (inward, 1.0 / inward)
        )
        assert stable < 1.0 < unstable


def test_half_of_it_bears_a_tenth_of_the_stiffness_and_almost_three_times_it():
    found = stiffness_range(GAIN, FILTER, PERIOD, share=0.5)
    assert found.softest < 0.1
    assert found.stiffest > 2.7
    assert stiffness_range(GAIN, FILTER, PERIOD, share=0.25).stiffest > 3.0


def test_without_forward_feed_the_range_is_the_gain_s_margin():
    found = stiffness_range(GAIN, None, PERIOD)
    assert found.softest == 0.0
    assert found.stiffest == pytest.approx(GAIN.gain_margin, rel=0.05)


@pytest.mark.slow
@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.floats(0.1, 3.0), st.booleans())
def test_with_a_stiffness_wrong_by_three_or_ten_the_force_settles(ratio, moving):
    """On the ideal delayed integrator, without any damping; the guard falls back where it must."""
    forces, control = pressed(ratio, sine if moving else still, seconds=12.0, knock=0.2e-3)
    # what a halved forward feed leaves of a moving surface is no instability: 6 N and more at 20 mm/s
    bound = 30.0 if moving else 1.0
    assert np.abs(forces[-3000:] - 2.0).max() < bound
    if not moving:
        early, late = np.ptp(forces[4000:6000]), np.ptp(forces[-2000:])
        assert late < max(0.5 * early, 0.1)
    if moving and 0.6 < ratio < 1.5:
        assert control.guard.trips == 0
        assert np.sqrt(np.mean((forces[3000:] - 2.0) ** 2)) < 0.3


@pytest.mark.parametrize("ratio", [2.5, 3.0])
def test_without_the_guard_it_would_not_settle(ratio):
    growth = np.abs(np.linalg.eigvals(closed_loop(GAIN, FILTER, PERIOD, 1.0, ratio))).max()
    assert growth > 1.005


def swings(lengths, peaks, guard, force=2.0):
    sign = 1.0
    for length, peak in zip(lengths, peaks, strict=True):
        for i in range(length):
            guard.step(sign * peak * math.sin(math.pi * (i + 0.5) / length), force)
        sign = -sign
    return guard


def guard():
    return ForceGuard(GuardSettings(GAIN.delay, PERIOD))


def test_the_guard_lets_decaying_slow_and_small_swings_pass():
    decaying = [3.0 * 0.8**i for i in range(30)]
    assert swings([40] * 30, decaying, guard()).trips == 0
    steady = [1.0] * 30
    assert swings([400] * 30, steady, guard()).trips == 0  # a surface's own
    assert swings([40] * 30, [0.2] * 30, guard()).trips == 0
    noise = np.random.default_rng(3).normal(0.0, 0.01, 5000)
    quiet = guard()
    for e in noise:
        quiet.step(float(e), 2.0)
    assert quiet.trips == 0


def test_the_guard_halves_without_a_jump_and_not_for_ever():
    tripped = swings([40] * 8, [1.0] * 8, guard())
    assert tripped.trips == 1
    before = tripped.share
    shares = [tripped.step(0.0, 2.0) for _ in range(300)]
    assert shares[-1] == 0.5
    assert np.abs(np.diff([before, *shares])).max() < 0.01
    worst = swings([40] * 200, [1.0] * 200, guard())
    assert worst.share == MIN_SHARE
    worst.reset()
    assert worst.share == 1.0


def test_the_guard_sees_what_grows_slowly():
    assert swings([300] * 7, [0.1 * 1.6**i for i in range(7)], guard()).trips == 1
