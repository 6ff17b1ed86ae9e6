"""The contact's stiffness as it shows itself: right where it counts, silent where nothing can be told."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import DirectForce, NormalForce, force_gain, surface_filter
from palpate.controllers.contact_stiffness import MAX_RATIO, ContactStiffness
from palpate.controllers.gains import MAX_LIVE_LOOP_GAIN

PERIOD, DELAY, FORCE = 1e-3, 0.0215, 2.0
STEPS = 21


def told(watch, depth, stiffness, damping_time, seconds=1.0, surface=lambda _: 0.0):
    """Feed it the force of a spring and damper under a tip that moves as `depth` says [m]."""
    before = depth(0.0)
    for i in range(1, round(seconds / PERIOD) + 1):
        time = i * PERIOD
        x, s = depth(time), surface(time)
        velocity = (x - before) / PERIOD
        rate = velocity - (s - surface(time - PERIOD)) / PERIOD
        force = stiffness * (x - s + damping_time * rate)
        watch.update(velocity, force, FORCE)
        before = x
    return watch


def swinging(time):
    """A swing of a loop that is too strong, about 11 Hz, with another one on it."""
    return 1e-4 * (1.0 + math.sin(70.0 * time) + 0.4 * math.sin(110.0 * time))


@settings(max_examples=25, deadline=None, derandomize=True)
@given(st.floats(2e3, 150e3), st.floats(0.0, 0.03), st.floats(0.2, 5.0))
def test_a_spring_and_damper_that_swing_are_found(stiffness, damping_time, wrong):
    watch = told(ContactStiffness(stiffness * wrong, DELAY, PERIOD), swinging, stiffness, damping_time)
    assert watch.known
    assert watch.stiffness == pytest.approx(stiffness, rel=0.03)
    assert watch.damping_time == pytest.approx(damping_time, abs=1.5e-3)


@settings(max_examples=15, deadline=None, derandomize=True)
@given(st.floats(0.1, 10.0))
def test_forces_and_their_limit_scale_together(scale):
    """What it finds is force per depth: all forces times as large, the stiffness times as large."""
    one = told(ContactStiffness(20e3, DELAY, PERIOD), swinging, 30e3, 0.01)
    many = ContactStiffness(20e3 * scale, DELAY, PERIOD)
    before = swinging(0.0)
    for i in range(1, 1001):
        x = swinging(i * PERIOD)
        velocity = (x - before) / PERIOD
        many.update(velocity, scale * 30e3 * (x + 0.01 * velocity), scale * FORCE)
        before = x
    assert many.stiffness == pytest.approx(scale * one.stiffness, rel=1e-6)


@pytest.mark.parametrize("frequency", [1.0, 2.0, 4.0])
def test_a_surface_that_is_followed_is_no_excitation(frequency):
    """The tip goes with it, and what is left of the force is small and slow."""

    def surface(time):
        return 0.01 * math.sin(frequency * time)

    def followed(time):
        return surface(time - 0.002) + 1e-4

    watch = told(ContactStiffness(20e3, DELAY, PERIOD), followed, 20e3, 0.0, 6.0, surface)
    assert not watch.known
    assert watch.stiffness == 20e3


@pytest.mark.parametrize("angular", [10.0, 30.0, 60.0])
def test_the_reaction_of_control_to_a_fast_surface_is_not_taken_for_the_contact(angular):
    """Closed loop on a surface that swings: force against depth is the controller's inverse, not a spring."""
    gain = force_gain(20e3, DELAY)
    law, watch = DirectForce(gain), ContactStiffness(20e3, DELAY, PERIOD)
    position, velocity, underway = FORCE / 20e3, 0.0, [0.0] * STEPS
    for i in range(4000):
        felt = max(20e3 * (position - 3e-5 * math.sin(angular * i * PERIOD)), 0.0)
        watch.update(velocity, felt, FORCE)
        underway.append(law.step(FORCE - felt, gain.gain))
        velocity = underway.pop(0)
        position += PERIOD * velocity
    assert watch.stiffness == pytest.approx(20e3, rel=0.5)


def test_it_is_bounded_and_begins_anew():
    watch = told(ContactStiffness(1e3, DELAY, PERIOD), swinging, 200e3, 0.0)
    assert watch.stiffness == MAX_RATIO * 1e3
    watch.reset()
    assert (watch.known, watch.stiffness) == (False, 1e3)


@pytest.mark.parametrize("speed", [0.005, 0.01, 0.025])
def test_what_began_with_the_touch_does_not_count(speed):
    """The tip gives way to a surface that came at it, ever faster: force and depth belong together by accident."""

    def surface(time):
        return -speed * time

    def giving_way(time):
        return surface(time) + speed * 0.05 * (1.0 - math.exp(-time / 0.05)) + 1e-4

    watch = told(ContactStiffness(20e3, DELAY, PERIOD), giving_way, 20e3, 0.03, 0.5, surface)
    assert watch.stiffness == pytest.approx(20e3, rel=0.2)


def test_what_a_rough_surface_does_is_not_the_contact():
    """Half of the force is the surface's: nothing is told, or what is right."""
    rng = np.random.default_rng(1)
    rough = [(rng.uniform(30.0, 200.0), rng.uniform(0.0, 6.0)) for _ in range(12)]

    def surface(time):
        return 3e-5 * sum(math.sin(w * time + phase) for w, phase in rough)

    watch = told(ContactStiffness(20e3, DELAY, PERIOD), swinging, 20e3, 0.0, 3.0, surface)
    assert watch.stiffness == pytest.approx(20e3, rel=0.1)


def pressed(ratio, seconds=6.0):
    """A loop on a contact of `ratio` times the assumed stiffness, hardly knocked; unstable from 1.77 on."""
    gain = force_gain(20e3, DELAY)
    control = NormalForce(DirectForce(gain), 20e3, DELAY, PERIOD, surface_filter(20e3, gain, DELAY))
    control.start()
    stiffness, forces = ratio * 20e3, []
    position, velocity, underway = 1.05 * FORCE / stiffness, 0.0, [0.0] * STEPS
    for _ in range(round(seconds / PERIOD)):
        felt = max(stiffness * position, 0.0)
        forces.append(felt)
        control.watch(velocity, felt)
        underway.append(control.step(FORCE, felt, gain.gain, 0.02))
        velocity = underway.pop(0)
        position += PERIOD * velocity
    return forces, control, gain


@pytest.mark.parametrize("ratio", [1.8, 2.0, 2.2])
def test_a_loop_that_swings_is_calmed_to_its_bound(ratio):
    forces, control, gain = pressed(ratio)
    assert control.stiffness.known
    assert control.stiffness.stiffness == pytest.approx(ratio * 20e3, rel=0.1)
    assert max(abs(force - FORCE) for force in forces[-1000:]) < 0.05
    assert min(forces) > 0.0
    assert control.guard.trips == 0, "before the guard has to halve it"
    lowered = control._lowered * gain.gain * ratio * 20e3 * DELAY
    assert lowered == pytest.approx(MAX_LIVE_LOOP_GAIN, rel=0.1)


def test_a_gain_that_the_contact_bears_is_left_alone():
    _, control, _ = pressed(1.0)
    assert control._lowered == 1.0
    assert control.guard.trips == 0
