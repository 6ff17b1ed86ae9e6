"""Skins that slip late tell e and loads of slip alone; bent surfaces and ripples are no stick-slip."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.friction.rubbing.sliding import FrictionBound, FrictionMeasured, measure_friction
from palpate.friction.rubbing.slip_loads import slip_load
from palpate.friction.rubbing.slip_test import Resistance, ends_level
from palpate.friction.rubbing.stick_slip import stick_slip
from palpate.friction.rubbing.stroke import TwoWay
from palpate.friction.rubbing.twisting import SpinBound, SpinMeasured, SpinUncertainty, bound_spin, measure_spin
from support.closed_strokes import Sensed, changed, elastic_turns, gives_way, nothing, sawtooth, slips

E, MU = 0.004, 0.5


def rubbed(sensed):
    found = measure_friction([sensed.two_way(slips(MU, 1e-4), nothing, 0.02)])
    assert isinstance(found, FrictionMeasured)
    return found


@pytest.mark.parametrize(("duration", "angle"), [(0.5, 0.05), (0.5, 0.3), (1.0, 0.25), (1.0, 0.4)])
def test_a_twist_that_slips_late_tells_the_e_of_slip_not_of_yielding(angle, duration):
    """The torque turns from one sign to the other within `angle`: whatever passes for slip tells e of slip."""
    held, errors = 0, []
    for seed in range(12):
        sensed = Sensed(np.random.default_rng(seed), noise=1.0)
        known = rubbed(sensed)
        twists = [sensed.two_way(nothing, slips(MU * E, angle), spin=q, duration=duration) for q in (2.0, -2.0)]
        found = measure_spin(twists, known)
        if not isinstance(found, SpinMeasured):
            continue
        low, high = found.spin_length.interval()
        held += low <= E <= high
        errors.append(found.spin_length.value / E - 1.0)
    assert duration == 0.5 or len(errors) == 12
    assert held >= len(errors) - 1
    # noise alone is 2 % of one twist
    assert not errors or abs(np.mean(errors)) < 0.005


@pytest.mark.parametrize("travel", [1e-3, 2.8e-3, 3.6e-3])
def test_loads_for_a_limit_surface_are_those_of_slip_however_late_it_begins(travel):
    loads = []
    for seed in range(10):
        sensed = Sensed(np.random.default_rng(seed), noise=1.0)
        loads.append(slip_load(sensed.two_way(slips(MU, travel), nothing, 0.02), sensed.normal, E))
    assert np.mean([load.tangential_force / load.normal_force for load in loads]) == pytest.approx(MU, rel=2e-3)


def bent(pair, radius):
    """The same strokes on a cylinder: the force turns with the place, as the normal does."""
    ways = []
    for stroke in pair.both:
        turn = Rotation.from_rotvec(np.outer((stroke.position[:, 0] - 0.004) / radius, [0.0, 1.0, 0.0]))
        force = np.einsum("nij,nj->ni", turn.as_matrix(), stroke.wrench[:, :3])
        ways.append(changed(stroke, wrench=np.hstack([force, stroke.wrench[:, 3:]])))
    return TwoWay(*ways)


@pytest.mark.parametrize("noise", [0.0, 1.0])
@pytest.mark.parametrize("mu", [0.4, 0.8])
def test_a_bend_is_no_stick_slip_and_hides_none(mu, noise):
    """Over 8 mm of a cylinder of 0.1 m the ratio of a constant mu changes by a quarter of it and more."""
    sensed = Sensed(random_pose=False, noise=noise)
    smooth = measure_friction([bent(sensed.two_way(slips(mu, 1e-4), nothing, 0.02), 0.1)])
    assert isinstance(smooth, FrictionMeasured)
    assert smooth.turns is None
    assert smooth.friction.value == pytest.approx(mu, rel=0.01)
    rough = measure_friction([bent(sensed.two_way(sawtooth(0.8 * mu, 1.2 * mu, 3.37e-4), nothing, 0.02), 0.1)])
    assert isinstance(rough, FrictionMeasured)
    assert rough.stick_slip
    assert rough.static_friction == pytest.approx(1.2 * mu, rel=0.05)


def test_what_lets_go_is_counted_and_a_ripple_is_none():
    s = np.linspace(0.0, 1.0, 1000)
    ramps = [Resistance(s, 0.5 + 0.2 * (np.mod(s * 12.0, 1.0) - 0.5))] * 2
    seen = stick_slip(ramps, 0.5, 0.0)
    assert seen is not None
    assert seen.times == pytest.approx(2 * 11, abs=2)
    assert seen.ratio == pytest.approx(0.6, rel=0.01)
    ripple = [Resistance(s, 0.5 + 0.004 * np.sin(200.0 * s))] * 2
    assert stick_slip(ripple, 0.5, 0.0) is None  # a perfect sensor makes no stick-slip of it
    assert stick_slip(ramps, 0.5, 0.1) is None  # nor does a poor one


def test_stick_slip_widens_the_interval_of_kinetic_friction():
    sensed = Sensed(noise=1.0)
    smooth = rubbed(sensed)
    stuck = measure_friction([sensed.two_way(sawtooth(0.4, 0.6, 3.37e-4), nothing, 0.02)])
    assert isinstance(stuck, FrictionMeasured)
    low, high = stuck.friction.interval()
    assert high - low > 5.0 * (smooth.friction.interval()[1] - smooth.friction.interval()[0])
    assert low < 0.5 < high < stuck.static_friction


def test_a_motion_that_ends_level_is_distinguished_from_one_that_rises_to_its_end():
    s = np.linspace(1e-3, 0.025, 400)
    assert ends_level(Resistance(s, np.minimum(0.5, 40.0 * s)))
    assert not ends_level(Resistance(s, 40.0 * s))
    assert not ends_level(Resistance(s, -0.5 + 40.0 * s))


def test_one_motion_alone_that_slips_is_a_bound_that_says_so():
    sensed = Sensed(noise=1.0)

    def there_only(s):
        return np.minimum(0.5, 0.5 * s / 0.005)

    there = sensed.stroke(there_only, nothing, 0.02)
    end = float(there.position[-1] @ sensed.frame[:, 0])
    back = sensed.stroke(gives_way(1.0, 0.0092, preload=-0.5), nothing, -0.02, begin=end)
    found = measure_friction([TwoWay(there, back)])
    assert isinstance(found, FrictionBound)
    assert found.partly
    assert found.least_friction <= 0.5
    only_gives = measure_friction([sensed.two_way(gives_way(0.5, 0.01), nothing, 0.02)])
    assert isinstance(only_gives, FrictionBound)
    assert not only_gives.partly


def test_without_mu_twists_still_bound_mu_e_and_say_why_that_is_all():
    sensed = Sensed(noise=1.0)
    slipped = bound_spin([sensed.two_way(nothing, slips(2e-3, 0.1), spin=2.0)], sensed.normal)
    assert isinstance(slipped, SpinBound)
    assert slipped.doubt is SpinUncertainty.FRICTION_UNKNOWN
    assert 1.7e-3 < slipped.least_torque_ratio <= 2e-3
    stuck = bound_spin([elastic_turns(sensed, 2e-3, 0.5, 2.0)], sensed.normal)
    assert stuck.doubt is SpinUncertainty.NEVER_SLIPPED
    assert stuck.least_torque_ratio <= 1e-3


@pytest.mark.parametrize("radius", [0.1, 0.3])
def test_the_normal_is_known_beside_a_stroke_on_a_bent_surface(radius):
    """On a cylinder the normal turns by the way over the radius; on a plane not at all, however noisy."""
    sensed = Sensed(random_pose=False, noise=1.0)
    found = measure_friction([bent(sensed.two_way(slips(0.5, 1e-4), nothing, 0.02), radius)])
    assert isinstance(found, FrictionMeasured)
    middle = found.bend.place
    for away in (-0.003, 0.003):
        turned = found.normal_at(middle + away * sensed.frame[:, 0])
        assert math.asin(np.linalg.norm(np.cross(turned, found.normal))) == pytest.approx(0.003 / radius, rel=0.15)
        assert float((turned - found.normal) @ sensed.frame[:, 0]) * away > 0.0  # as `bent` turns its forces
    seen = 0
    for seed in range(30):
        flat = Sensed(np.random.default_rng(seed), noise=1.0)
        seen += bool(np.any(rubbed(flat).bend.rate))
    assert seen <= 1


@pytest.mark.parametrize("frequency", [8.0, 20.0, 40.0])
def test_a_tip_that_shakes_along_the_surface_while_it_turns_does_not_shorten_e(frequency):
    """As an arm's does: with a third of mu f_n, RMS, the torque is 5 % less than that of a pure twist."""
    mu, e, spin, share = 0.5, 0.003, 2.0, 0.45
    sensed = Sensed(np.random.default_rng(3), noise=1.0)
    found = measure_friction([sensed.two_way(slips(mu, 1e-4), nothing, speed=0.01)])

    def shaken(angle):
        return share * np.sin(2.0 * math.pi * frequency * angle / spin)

    twists = [
        sensed.two_way(
            lambda angle: mu * shaken(angle),
            lambda angle: slips(mu * e, 0.02)(angle) * np.sqrt(1.0 - shaken(angle) ** 2),
            spin=spin,
        )
        for _ in range(2)
    ]
    spun = measure_spin(twists, found)
    assert isinstance(spun, SpinMeasured)
    assert spun.spin_length.value == pytest.approx(e, rel=0.01)
    assert spun.slide == pytest.approx(share / math.sqrt(2.0), rel=0.08)
