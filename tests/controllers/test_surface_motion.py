"""Motion of the surface and stiffness of the contact, estimated while the loop runs, and the guard of the loop."""

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
from palpate.controllers.contact_stiffness import MAX_RATIO, ContactStiffness
from palpate.controllers.force_guard import MIN_SHARE
from palpate.controllers.gains import MAX_LIVE_LOOP_GAIN
from palpate.controllers.surface_motion import closed_loop
from support.delayed_spring import delayed_loop

PERIOD, STIFFNESS, STEPS = 1e-3, 20e3, 21

GAIN = force_gain(STIFFNESS, (STEPS + 0.5) * PERIOD)

FILTER = surface_filter(STIFFNESS, GAIN, GAIN.delay)

SPEED, AMPLITUDE = 0.02, 0.01
"""Of the surface's sine [m/s, m]."""


FORCE, DELAY = 2.0, 0.0215


def pressed(ratio=1.0, surface=None, follow=FILTER, seconds=6.0, knock=0.0, noise=0.0):
    """Force of a tip on a surface with `ratio` times the assumed stiffness, and its control."""
    control, stiffness = NormalForce(DirectForce(GAIN), STIFFNESS, GAIN.delay, PERIOD, follow), ratio * STIFFNESS
    draws, before = iter(np.random.default_rng(1).normal(0.0, noise, round(seconds / PERIOD)).tolist()), 0.0
    control.start()

    def step(time, force, velocity):
        nonlocal before
        if force == 0.0 < before:
            control.lose()
        before, sensed = force, force + next(draws)
        control.watch(velocity, sensed)
        return control.step(FORCE, sensed, GAIN.gain, 0.02)

    depth, periods = FORCE / stiffness + knock, round(seconds / PERIOD)
    forces = delayed_loop(step, stiffness, STEPS, periods, depth=depth, surface=surface, least=0.0)
    return forces, control


def sine(time):
    return AMPLITUDE * (1.0 - math.cos(SPEED / AMPLITUDE * time))


@settings(max_examples=30, deadline=None, derandomize=True)
@given(st.floats(-0.02, 0.02), st.floats(-0.05, 0.05), st.floats(-0.05, 0.05))
def test_a_parabola_of_velocity_is_predicted_exactly(value, slope, curve):
    """Whatever the force does meanwhile: n.v = s' + F'/K."""
    seen, bounded = (
        SurfaceMotion(SurfaceFilter(STIFFNESS, 0.02, 0.03, fastest=10.0), PERIOD),
        SurfaceMotion(FILTER, PERIOD),
    )
    rng, before = np.random.default_rng(2), 0.0

    def velocity(t):
        return value + slope * t + curve * t * t

    for i in range(1000):
        force = float(rng.uniform(1.0, 3.0)) if i else 0.0
        seen.update(velocity(i * PERIOD) + (force - before) / (STIFFNESS * PERIOD), force)
        bounded.update(1.0, 2.0)
        before = force
    assert seen.velocity == pytest.approx(velocity(0.999), abs=1e-6)
    assert seen.predicted == pytest.approx(velocity(0.999 + 0.02), abs=1e-6)
    assert bounded.predicted == FILTER.fastest


def test_a_surface_that_moves_as_a_sine_is_followed():
    """Without the forward feed the error is 20 mm/s / k = 12 N: the contact is lost and slammed."""
    forces, control = pressed(surface=sine, noise=3.1e-3)
    assert np.sqrt(np.mean((forces[1000:] - 2.0) ** 2)) < 0.06
    assert control.guard.trips == 0
    unfed, _ = pressed(surface=sine, follow=None)
    assert np.ptp(unfed[1000:]) > 12.0


def test_the_closed_loop_s_matrix_is_the_loop():
    """Its eigenvalues are the decay of the simulated loop's swings, until they are rounding."""
    for ratio in (0.6, 1.5):
        forces, _ = pressed(ratio, knock=1e-6)
        error = np.abs(forces - 2.0)
        decay = (error[1000:1500].max() / error[400:900].max()) ** (1 / 600)
        assert decay == pytest.approx(largest_eigenvalue(ratio), abs=0.003)


def test_the_range_of_stiffnesses_ends_where_the_loop_begins_to_oscillate():
    """Half of the forward feed widens the range; without it the range ends at the gain's margin."""
    found, half = stiffness_range(GAIN, FILTER, PERIOD), stiffness_range(GAIN, FILTER, PERIOD, share=0.5)
    unfed = stiffness_range(GAIN, None, PERIOD)
    assert 0.3 < found.softest < 0.5
    assert 1.6 < found.stiffest < 1.9
    assert largest_eigenvalue(found.softest * 1.1) < 1.0 < largest_eigenvalue(found.softest / 1.1)
    assert largest_eigenvalue(found.stiffest / 1.1) < 1.0 < largest_eigenvalue(found.stiffest * 1.1)
    assert largest_eigenvalue(2.5) > 1.005  # the guard is needed
    assert half.softest < 0.1
    assert half.stiffest > 2.7
    assert stiffness_range(GAIN, FILTER, PERIOD, share=0.25).stiffest > 3.0
    assert unfed.softest == 0.0
    assert unfed.stiffest == pytest.approx(GAIN.gain_margin, rel=0.05)


@pytest.mark.slow
@settings(max_examples=20, deadline=None, derandomize=True)
@given(st.floats(0.1, 3.0), st.booleans())
def test_with_a_stiffness_wrong_by_three_or_ten_the_force_settles(ratio, moving):
    """On the ideal delayed integrator, without any damping; the guard falls back where it must."""
    forces, control = pressed(ratio, sine if moving else None, seconds=12.0, knock=0.2e-3)
    # what a halved forward feed leaves of a moving surface is no instability: 6 N and more at 20 mm/s
    assert np.abs(forces[-3000:] - FORCE).max() < (30.0 if moving else 1.0)
    assert moving or np.ptp(forces[-2000:]) < max(0.5 * np.ptp(forces[4000:6000]), 0.1)
    if moving and 0.6 < ratio < 1.5:
        assert control.guard.trips == 0
        assert np.sqrt(np.mean((forces[3000:] - FORCE) ** 2)) < 0.3


def swings(lengths, peaks):
    """A guard after half waves of so many periods and such peaks, their signs in turn."""
    guard, sign = ForceGuard(GuardSettings(GAIN.delay, PERIOD)), 1.0
    for length, peak in zip(lengths, peaks, strict=True):
        for i in range(length):
            guard.step(sign * peak * math.sin(math.pi * (i + 0.5) / length), FORCE)
        sign = -sign
    return guard


SWINGS = {
    "decaying": ([40] * 30, [3.0 * 0.8**i for i in range(30)], 0),
    "as slow as a surface": ([400] * 30, [1.0] * 30, 0),
    "small": ([40] * 30, [0.2] * 30, 0),
    "noise": ([1] * 5000, np.random.default_rng(3).normal(0.0, 0.01, 5000).tolist(), 0),
    "slowly growing": ([300] * 7, [0.1 * 1.6**i for i in range(7)], 1),
}


@pytest.mark.parametrize("name", SWINGS)
def test_the_guard_lets_decaying_slow_and_small_swings_pass(name):
    lengths, peaks, trips = SWINGS[name]
    assert swings(lengths, peaks).trips == trips


def fed(watch, depth, stiffness, damping_time, seconds=1.0, surface=lambda _: 0.0, scale=1.0):
    """Feed the force of a spring and damper under a tip that moves as `depth` says [m], times `scale`."""
    before = depth(0.0) - surface(0.0)
    for i in range(1, round(seconds / PERIOD) + 1):
        time = i * PERIOD
        inside, velocity = depth(time) - surface(time), (depth(time) - depth(time - PERIOD)) / PERIOD
        force = stiffness * (inside + damping_time * (inside - before) / PERIOD)
        watch.update(velocity, scale * force, scale * FORCE)
        before = inside
    return watch


def swinging(time):
    """A swing of a loop that is too strong, about 11 Hz, with another one on it."""
    return 1e-4 * (1.0 + math.sin(70.0 * time) + 0.4 * math.sin(110.0 * time))


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(2e3, 150e3), st.floats(0.0, 0.03), st.floats(0.2, 5.0))
def test_a_spring_and_damper_that_swing_are_found(stiffness, damping_time, wrong):
    watch = fed(ContactStiffness(stiffness * wrong, DELAY, PERIOD), swinging, stiffness, damping_time)
    assert watch.known
    assert watch.stiffness == pytest.approx(stiffness, rel=0.03)
    assert watch.damping_time == pytest.approx(damping_time, abs=1.5e-3)
    bounded = fed(ContactStiffness(1e3, DELAY, PERIOD), swinging, 200e3, 0.0)
    assert bounded.stiffness == MAX_RATIO * 1e3
    bounded.reset()
    assert (bounded.known, bounded.stiffness) == (False, 1e3)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.floats(0.1, 10.0))
def test_forces_and_their_limit_scale_together(scale):
    """The estimate is force per depth: all forces times as large, the stiffness times as large."""
    one = fed(ContactStiffness(20e3, DELAY, PERIOD), swinging, 30e3, 0.01)
    many = fed(ContactStiffness(20e3 * scale, DELAY, PERIOD), swinging, 30e3, 0.01, scale=scale)
    assert many.stiffness == pytest.approx(scale * one.stiffness, rel=1e-6)


@pytest.mark.parametrize("angular", [10.0, 30.0, 60.0])
def test_the_reaction_of_control_to_a_fast_surface_is_not_taken_for_the_contact(angular):
    """Closed loop on a surface that swings: force against depth is the controller's inverse, not a spring."""
    law, watch = DirectForce(GAIN), ContactStiffness(STIFFNESS, DELAY, PERIOD)

    def step(time, force, velocity):
        watch.update(velocity, force, FORCE)
        return law.step(FORCE - force, GAIN.gain)

    def surface(time):
        return 3e-5 * math.sin(angular * time)

    delayed_loop(step, STIFFNESS, STEPS, 4000, depth=FORCE / STIFFNESS, surface=surface, least=0.0)
    assert watch.stiffness == pytest.approx(STIFFNESS, rel=0.5)


def test_the_guard_halves_without_a_jump_and_not_for_ever():
    tripped, worst = swings([40] * 8, [1.0] * 8), swings([40] * 200, [1.0] * 200)
    shares = [tripped.share, *(tripped.step(0.0, FORCE) for _ in range(300))]
    assert (tripped.trips, shares[-1], worst.share) == (1, 0.5, MIN_SHARE)
    assert np.abs(np.diff(shares)).max() < 0.01
    worst.reset()
    assert worst.share == 1.0


def followed(frequency):
    """The tip moves with the surface: the rest of the force is small and slow."""
    return (
        lambda t: 0.01 * math.sin(frequency * (t - 0.002)) + 1e-4,
        0.0,
        6.0,
        lambda t: 0.01 * math.sin(frequency * t),
        0.0,
    )


def approaching(speed):
    """A surface that came at the tip, which yields ever faster: force and depth belong together by accident."""
    return (
        lambda t: 1e-4 - speed * t + speed * 0.05 * (1.0 - math.exp(-t / 0.05)),
        0.03,
        0.5,
        lambda t: -speed * t,
        0.2,
    )


ROUGH = np.random.default_rng(1).uniform([30.0, 0.0], [200.0, 6.0], (12, 2))

UNINFORMATIVE = {
    "followed at 1 rad/s": followed(1.0),
    "followed at 2 rad/s": followed(2.0),
    "followed at 4 rad/s": followed(4.0),
    "approaching at 5 mm/s": approaching(0.005),
    "approaching at 10 mm/s": approaching(0.01),
    "approaching at 25 mm/s": approaching(0.025),
    "rough, half of the force": (
        swinging,
        0.0,
        3.0,
        lambda time: 3e-5 * np.sin(ROUGH[:, 0] * time + ROUGH[:, 1]).sum(),
        0.1,
    ),
}


@pytest.mark.parametrize("name", UNINFORMATIVE)
def test_motion_of_the_surface_is_not_taken_for_the_contact(name):
    """No estimate is made, or a right one."""
    depth, damping_time, seconds, surface, bound = UNINFORMATIVE[name]
    watch = fed(ContactStiffness(20e3, DELAY, PERIOD), depth, 20e3, damping_time, seconds, surface)
    assert watch.stiffness == pytest.approx(20e3, rel=bound)
    assert not watch.known or bound > 0.0


@pytest.mark.parametrize("ratio", [1.0, 1.8, 2.0, 2.2])
def test_a_loop_that_swings_is_calmed_to_its_bound(ratio):
    """Before the guard has to halve it; a gain that the contact allows is left alone. Unstable from 1.77 on."""
    forces, control = pressed(ratio, knock=0.05 * FORCE / (ratio * STIFFNESS))
    assert control.guard.trips == 0
    assert control.stiffness.known == (ratio > 1.0)
    assert np.abs(forces[-1000:] - FORCE).max() < 0.05
    assert forces.min() > 0.0
    if ratio == 1.0:
        assert control._lowered == 1.0
    else:
        assert control.stiffness.stiffness == pytest.approx(ratio * STIFFNESS, rel=0.1)
        lowered = control._lowered * GAIN.gain * ratio * STIFFNESS * GAIN.delay
        assert lowered == pytest.approx(MAX_LIVE_LOOP_GAIN, rel=0.1)


def largest_eigenvalue(ratio):
    return np.abs(np.linalg.eigvals(closed_loop(GAIN, FILTER, PERIOD, 1.0, ratio))).max()
