"""Laws of force control against the delayed, sampled integrator: margins are where it begins to oscillate."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.controllers import Admittance, DirectForce, VirtualBody, force_gain
from palpate.controllers.force_law import least_damping
from palpate.controllers.margins import loop_margins, whole_delays
from palpate.errors import InvalidValueError

PERIOD, STIFFNESS, DELAY = 1e-3, 15e3, 0.0205
STEPS = whole_delays(DELAY, PERIOD)


def closed(law, stiffness, seconds=6.0, force=1.0):
    """Force over time of a law on a spring, commands acting `STEPS` periods late, from contact without force."""
    law.start(0.0)
    underway, felt, forces = [0.0] * STEPS, 0.0, []
    for _ in range(round(seconds / PERIOD)):
        underway.append(law.step(force - felt, law.gain.gain))
        felt += PERIOD * stiffness * underway.pop(0)
        forces.append(felt)
    return np.array(forces)


LAWS = {
    "direct": lambda: DirectForce(force_gain(STIFFNESS, DELAY)),
    "admittance": lambda: Admittance(VirtualBody(10.0, 1.2e3, STIFFNESS, DELAY), PERIOD),
}


@pytest.mark.parametrize("name", LAWS)
def test_a_steady_force_is_reached_exactly(name):
    assert closed(LAWS[name](), STIFFNESS)[-1] == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("name", LAWS)
def test_the_gain_margin_is_where_it_begins_to_oscillate(name):
    margin = LAWS[name]().margins(PERIOD).gain_margin
    assert margin > 1.5
    for factor, decays in ((0.98, True), (1.02, False)):
        force = closed(LAWS[name](), margin * factor * STIFFNESS)
        early, late = np.ptp(force[1500:2500]), np.ptp(force[-1000:])
        assert bool(late < early) is decays


def test_the_direct_law_s_sampled_margins_are_those_of_the_gain():
    """At 20 periods of delay, sampling changes little."""
    gain = force_gain(STIFFNESS, DELAY)
    margins = DirectForce(gain).margins(PERIOD)
    assert margins.gain_margin == pytest.approx(gain.gain_margin, rel=0.002)
    assert margins.phase_margin_deg == pytest.approx(gain.phase_margin_deg, abs=0.3)
    assert 0.5 < margins.modulus_margin < 1.0


def test_an_admittance_s_margin_in_continuous_time_is_that_of_the_sampled_one():
    body = VirtualBody(10.0, 1.2e3, STIFFNESS, DELAY)
    # the sampled body answers within the period: its exact solution leads the continuous one by half of it
    assert Admittance(body, PERIOD).margins(PERIOD).gain_margin == pytest.approx(body.gain_margin, rel=0.05)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.floats(0.01, 100.0), st.floats(1e2, 1e6), st.floats(1e-3, 0.1))
def test_least_damping_separates_stable_bodies_from_others(mass, stiffness, delay):
    least = least_damping(mass, stiffness, delay)
    assert VirtualBody(mass, 1.001 * least, stiffness, delay).gain_margin == pytest.approx(1.0, abs=0.01)
    with pytest.raises(InvalidValueError, match="at least"):
        VirtualBody(mass, 0.99 * least, stiffness, delay)


def test_a_light_body_is_the_direct_law_and_a_heavy_one_asks_for_more_damping():
    # k K T = pi/2 without a mass
    assert least_damping(1e-9, STIFFNESS, DELAY) == pytest.approx(STIFFNESS * DELAY / (math.pi / 2), rel=1e-3)
    dampings = [least_damping(mass, STIFFNESS, DELAY) for mass in (0.1, 1.0, 10.0, 100.0)]
    assert np.all(np.diff(dampings) > 0.0)


@settings(max_examples=50, deadline=None, derandomize=True)
@given(st.floats(0.1, 50.0), st.floats(200.0, 5e3), st.floats(-5.0, 5.0))
def test_the_body_s_velocity_is_the_exact_solution_of_its_equation(mass, damping, error):
    body = VirtualBody(mass, damping, 1.0, 1e-3)  # next to no stiffness: always stable
    law = Admittance(body, PERIOD)
    law.start(0.02)
    for i in range(1, 50):
        velocity = law.step(error, law.gain.gain)
        exact = error / damping + (0.02 - error / damping) * math.exp(-i * PERIOD * damping / mass)
        assert velocity == pytest.approx(exact, abs=1e-12)


def test_noise_moves_an_admittance_less():
    noise = np.random.default_rng(1).normal(0.0, 0.01, 5000)
    moved = {name: np.std([make().step(e, make().gain.gain) for e in noise]) for name, make in LAWS.items()}
    law = LAWS["admittance"]()
    law.start(0.0)
    moved["admittance"] = np.std([law.step(e, law.gain.gain) for e in noise])
    gains = {name: make().gain.gain for name, make in LAWS.items()}
    assert moved["admittance"] / gains["admittance"] < 0.5 * moved["direct"] / gains["direct"]


def test_margins_of_a_loop_with_known_ones():
    """L = a / (z - 1) is stable for a < 2, and the modulus margin is 1 - a/2, at the Nyquist frequency."""
    margins = loop_margins(lambda z: 0.5 / (z - 1.0))
    assert margins.gain_margin == pytest.approx(4.0, rel=0.01)
    assert margins.modulus_margin == pytest.approx(0.75, rel=0.01)
    # |L| = 1 where 2 sin(w/2) = 0.5; the phase there is -90 degrees - w/2
    assert margins.phase_margin_deg == pytest.approx(90.0 - math.degrees(math.asin(0.25)), abs=0.2)


def test_no_loop_is_faster_than_its_sampling():
    assert whole_delays(1.5e-3, PERIOD) == 1
    with pytest.raises(InvalidValueError, match="one and a half periods"):
        whole_delays(0.5e-3, PERIOD)
