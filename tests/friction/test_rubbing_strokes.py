"""mu and e from strokes there and back: what they depend on, what not, and when they are only bounds."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.friction.rubbing.estimate import Estimate
from palpate.friction.rubbing.slip_test import Resistance, slip_evidence
from palpate.friction.rubbing.stroke import TwoWay, steady_part
from palpate.friction.rubbing.twisting import SpinBound, SpinUncertainty, measure_spin, torque_share
from support.closed_strokes import (
    Sensed,
    bounded,
    changed,
    elastic_pair,
    elastic_turns,
    gives_way,
    measured,
    nothing,
    rubbed,
    slips,
    spun,
)

seeds = st.integers(0, 2**32 - 1)
coefficients = st.floats(0.05, 1.5)


def level(value):
    return lambda s: np.where(s > 0.0, value, 0.0)


def moved_origin(stroke, offset):
    """The same contact, moments told about a point `offset` off, sensor frame."""
    wrench = stroke.wrench.copy()
    wrench[:, 3:] -= np.cross(offset, wrench[:, :3])
    return changed(stroke, wrench=wrench, centroid=stroke.centroid - offset)


@settings(max_examples=30, deadline=None)
@given(seeds, coefficients, st.floats(0.5, 5.0), st.floats(0.5, 5.0))
def test_mu_and_the_normal_are_exact_whatever_the_pose_and_the_two_normal_forces(seed, mu, first, second):
    sensed = Sensed(np.random.default_rng(seed))
    found = rubbed(sensed, mu, forces=(first, second))
    assert found.friction.value == pytest.approx(mu, rel=1e-9)
    assert np.allclose(found.normal, sensed.normal, atol=1e-9)
    # weighed as directions, not as forces: the mean force would be tilted by mu (a - b) / (a + b)
    assert found.normal_force == pytest.approx(0.5 * (first + second), rel=1e-9)


@settings(max_examples=20, deadline=None)
@given(seeds, coefficients, st.tuples(*[st.floats(-0.01, 0.01)] * 3))
def test_the_sensors_origin_does_not_matter(seed, mu, offset):
    """Torque by the pitch of the wrench axis: half a millimetre off or a centimetre, there or not."""
    sensed = Sensed(np.random.default_rng(seed))
    # 0.3 of mu f_n slides along: the worst that an arm can do to a torque
    twists = sensed.two_way(nothing, slips(0.002 * mu, 0.1), spin=2.0, aside=0.3 * mu)
    pairs = [sensed.two_way(slips(mu, 1e-4), nothing, 0.02), twists]
    moved = [TwoWay(*(moved_origin(each, np.array(offset)) for each in pair.both)) for pair in pairs]
    found, other = measured(pairs[0]), measured(moved[0])
    here, there = spun(pairs[1], known=found), spun(moved[1], known=found)
    assert other.friction.value == pytest.approx(found.friction.value, rel=1e-12)
    assert there.torque_ratio.value == pytest.approx(here.torque_ratio.value, rel=1e-9)
    assert here.spin_length.value == pytest.approx(0.002 / math.sqrt(1.0 - 0.3**2), rel=1e-6)
    assert here.slide == pytest.approx(0.3, rel=1e-6)


def test_a_tilted_normal_moves_the_torque_by_its_square_and_the_tangential_share_only():
    sensed = Sensed()
    stroke = sensed.two_way(nothing, level(0.002), spin=2.0, aside=0.1).there
    tilted = sensed.normal + 0.035 * sensed.frame[:, 0]  # along the force's own plane it would be 0.1 * 0.035
    true, seen = (stroke.spin_torque(n / np.linalg.norm(n))[-1] for n in (sensed.normal, tilted))
    assert seen == pytest.approx(true, rel=1e-3)


@pytest.mark.parametrize("p", [1.0, 1.3, 2.0])
@pytest.mark.parametrize("x", [0.0, 0.2, 0.7])
def test_the_torque_beside_a_tangential_force_is_on_the_limit_surface(x, p):
    assert x**p + torque_share(x, p) ** p == pytest.approx(1.0)


@settings(max_examples=15, deadline=None)
@given(seeds, st.floats(0.1, 1.2), st.floats(1e-3, 8e-3), st.floats(1.0, 2.0), st.floats(0.0, 0.6))
def test_e_is_exact_on_any_norm_when_the_finger_slides_as_it_turns(seed, mu, e, p, slide):
    sensed = Sensed(np.random.default_rng(seed))
    known = rubbed(sensed, mu)
    twists = sensed.two_way(nothing, slips(mu * e * torque_share(slide, p), 0.1), spin=2.0, aside=slide * mu)
    assert spun(twists, known=known, norm_exponent=p).spin_length.value == pytest.approx(e, rel=1e-6)
    # an uncertain p widens the interval as far as the slide matters
    low, high = spun(twists, known=known, norm_exponent=2.0, norm_exponent_error=1.0).spin_length.interval()
    assert low <= e * torque_share(slide, p) / torque_share(slide, 2.0) <= high


def test_an_interval_widens_with_noise_model_and_level_and_with_few_samples():
    known, seen = Estimate(1.0, 0.1, 0.0), Estimate(1.0, 0.1, 0.0, 3.0)
    assert known.interval()[1] == pytest.approx(1.196, abs=1e-3)
    assert seen.interval()[1] == pytest.approx(1.318, abs=1e-3)  # Student's t of 3: 3.182
    assert Estimate(1.0, 0.03, 0.04).standard_deviation == pytest.approx(0.05)
    assert known.interval(0.99)[1] > known.interval()[1]


@settings(max_examples=40, deadline=None)
@given(seeds, st.floats(0.02, 2.0), st.floats(-0.5, 1.5))
def test_elastic_motion_is_never_friction_wherever_it_began(seed, level, rest):
    """The bound keeps to the forces carried: the cone through both ends, at most."""
    sensed = Sensed(np.random.default_rng(seed), noise=1.0)
    found = bounded(elastic_pair(sensed, level / 0.01, rest * 0.01, 0.02))
    assert 0.0 <= found.least_friction <= max(abs(rest), abs(1.0 - rest)) * level * 1.02 + 0.01
    # without a normal: from -0.2 to 0.4 of the normal force is 2 * 15.0 degrees wide at least
    found = bounded(elastic_pair(Sensed(), 60.0, 1.0 / 300.0, 0.02, duration=0.52))
    narrowest = math.tan(0.5 * (math.atan(0.4) + math.atan(0.2)))
    assert 0.9 * narrowest <= found.least_friction < narrowest


@settings(max_examples=25, deadline=None)
@given(seeds, st.floats(1e-4, 5e-3), st.floats(-0.5, 1.5))
def test_an_elastic_twist_is_a_bound_of_the_torque(seed, torque, rest):
    """So is a twist too far beside the contact, with its reason."""
    sensed = Sensed(np.random.default_rng(seed), noise=1.0)
    turned = measure_spin([elastic_turns(sensed, torque, rest, 2.0)], rubbed(sensed))
    assert isinstance(turned, SpinBound)
    assert turned.doubt is SpinUncertainty.NEVER_SLIPPED
    # torque runs over `torque` per radian times 0.96 rad: half of it, whatever the preload
    assert 0.4 * torque - 3e-4 <= turned.least_torque_ratio <= 0.5 * torque * 0.97 + 2e-5
    exact = Sensed()
    slid = measure_spin([exact.two_way(nothing, slips(5e-4, 0.1), spin=2.0, aside=0.49)], rubbed(exact))
    assert isinstance(slid, SpinBound)
    assert slid.doubt is SpinUncertainty.SLID
    assert slid.least_torque_ratio == pytest.approx(5e-4, rel=1e-6)


@pytest.mark.parametrize(
    "skin",
    [gives_way(0.5, 0.01, 0.0, -0.4), gives_way(0.5, 0.01, 0.0, 0.5), slips(0.5, 0.0085), slips(0.5, 0.02)],
    ids=["softening", "hardening", "slips too late", "slips at its end"],
)
def test_skins_that_bend_or_slip_within_less_than_twice_their_travel_are_bounds(skin):
    assert bounded(Sensed(noise=1.0).two_way(skin, nothing, 0.02)).least_friction > 0.0


@pytest.mark.parametrize("travel", [2e-4, 1e-3, 2e-3, 3e-3])
def test_a_skin_that_slips_late_shows_the_mu_of_slip_not_of_elastic_motion(travel):
    """The resistance turns from -mu to mu within `travel`: as long as that passes for slip, mu is that of slip."""
    pairs = [
        Sensed(np.random.default_rng(seed), noise=1.0).two_way(slips(0.5, travel), nothing, 0.02)
        for seed in range(10)
    ]
    found = [measured(pair).friction for pair in pairs]
    assert [each.value for each in found] == pytest.approx([0.5] * 10, rel=0.01)
    assert sum(low <= 0.5 <= high for low, high in (each.interval() for each in found)) >= 9


def test_evidence_has_no_unit():
    """The same curves in other units, and stiffer by any factor, rise alike.

    Noise does not make slip of elastic motion: resistance just above it has a rise of 1 with a deviation of 0.3.
    """

    def evidence(s, r, other=None):
        return slip_evidence([Resistance(s, r), Resistance(s, r if other is None else other)])

    s = np.linspace(0.1, 1.0, 100)
    r = np.minimum(1.0, 0.5 + s)
    rises = [evidence(scale * s, r / scale).rise for scale in (1.0, 1e-6, 1e6)]
    assert rises == pytest.approx([rises[0]] * 3)
    assert evidence(s, 3.0 * s).rise == pytest.approx(1.0)
    assert evidence(s, np.full(100, 3.0)).rise == pytest.approx(0.0, abs=1e-12)
    assert not evidence(s, np.full(100, -3.0)).slipped
    s = np.linspace(0.2, 1.0, 160)
    noise = 1.2 * np.random.default_rng(12).normal(size=(300, 2, 160))
    assert not any(evidence(s, s + there, s + back).slipped for there, back in noise)


def test_a_steady_drift_cancels_where_every_second_pair_starts_back():
    sensed = Sensed()
    drift = np.concatenate([0.02 * sensed.rotation.T @ sensed.frame[:, 0], np.zeros(3)])  # 20 mN/s along the way

    def drifting(speed):
        pair = sensed.two_way(slips(0.3, 1e-4), nothing, speed)
        return TwoWay(*(changed(each, wrench=each.wrench + np.outer(each.time, drift)) for each in pair.both))

    first, other = drifting(0.02), drifting(-0.02)
    alone, both = measured(first), measured(first, other)
    assert abs(alone.friction.value - 0.3) > 5.0 * abs(both.friction.value - 0.3)
    assert both.friction.model < alone.friction.model


def test_reversal_transient_and_filter_are_left_out():
    time = np.arange(0.0, 0.6, 2e-3)
    speed = 0.02 * np.clip((time - 0.05) / 0.04, 0.0, 1.0) * (time < 0.5)
    part = steady_part(time, speed, 0.1)
    assert 0.16 < time[part][0] < 0.2
    assert 0.4 < time[part][-1] < 0.5
    assert time[steady_part(time, speed, 0.2)][0] == pytest.approx(time[part][0] + 0.1, abs=3e-3)
