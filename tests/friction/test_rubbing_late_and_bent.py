"""Skins that slip late tell e and loads of slip alone; bent surfaces and ripples are no stick-slip."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from palpate.friction.rubbing.slip_loads import slip_load
from palpate.friction.rubbing.slip_test import Resistance, ends_level
from palpate.friction.rubbing.stick_slip import stick_slip
from palpate.friction.rubbing.stroke import TwoWay
from palpate.friction.rubbing.twisting import SpinMeasured, SpinUncertainty, bound_spin, measure_spin
from support.closed_strokes import (
    Sensed,
    bounded,
    changed,
    elastic_turns,
    gives_way,
    measured,
    nothing,
    rubbed,
    sawtooth,
    slips,
    spun,
)

E, MU = 0.004, 0.5


@pytest.mark.parametrize(("duration", "angle"), [(0.5, 0.05), (0.5, 0.3), (1.0, 0.25), (1.0, 0.4)])
def test_a_twist_that_slips_late_shows_the_e_of_slip_not_of_elastic_motion(angle, duration):
    """The torque turns from one sign to the other within `angle`: whatever passes for slip shows e of slip."""
    found = []
    for seed in range(12):
        sensed = Sensed(np.random.default_rng(seed), noise=1.0)
        known = rubbed(sensed)
        twists = [sensed.two_way(nothing, slips(MU * E, angle), spin=q, duration=duration) for q in (2.0, -2.0)]
        found.append(measure_spin(twists, known))
    lengths = [each.spin_length for each in found if isinstance(each, SpinMeasured)]
    assert duration == 0.5 or len(lengths) == 12
    assert sum(low <= E <= high for low, high in (each.interval() for each in lengths)) >= len(lengths) - 1
    # noise alone is 2 % of one twist
    assert not lengths or abs(np.mean([each.value for each in lengths]) / E - 1.0) < 0.005


@pytest.mark.parametrize("travel", [1e-3, 2.8e-3, 3.6e-3])
def test_loads_for_a_limit_surface_are_those_of_slip_however_late_it_begins(travel):
    hands = [Sensed(np.random.default_rng(seed), noise=1.0) for seed in range(10)]
    loads = [slip_load(each.two_way(slips(MU, travel), nothing, 0.02), each.normal, E) for each in hands]
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
    """Over 8 mm of a cylinder of 0.1 m the ratio of a constant mu changes by a quarter of it and more.

    Stick-slip widens the interval of kinetic friction.
    """
    sensed = Sensed(random_pose=False, noise=noise)
    smooth = measured(bent(sensed.two_way(slips(mu, 1e-4), nothing, 0.02), 0.1))
    assert smooth.turns is None
    assert smooth.friction.value == pytest.approx(mu, rel=0.01)
    rough = measured(bent(sensed.two_way(sawtooth(0.8 * mu, 1.2 * mu, 3.37e-4), nothing, 0.02), 0.1))
    assert rough.stick_slip
    assert rough.static_friction == pytest.approx(1.2 * mu, rel=0.05)
    flat = measured(sensed.two_way(sawtooth(0.8 * mu, 1.2 * mu, 3.37e-4), nothing, 0.02)).friction.interval()
    assert np.ptp(flat) > 5.0 * np.ptp(rubbed(sensed, mu).friction.interval())
    assert flat[0] < mu < flat[1] < rough.static_friction


def test_stick_slip_is_counted_and_a_ripple_is_none():
    s = np.linspace(0.0, 1.0, 1000)
    ramps = [Resistance(s, 0.5 + 0.2 * (np.mod(s * 12.0, 1.0) - 0.5))] * 2
    seen = stick_slip(ramps, 0.5, 0.0)
    assert seen.times == pytest.approx(2 * 11, abs=2)
    assert seen.ratio == pytest.approx(0.6, rel=0.01)
    ripple = [Resistance(s, 0.5 + 0.004 * np.sin(200.0 * s))] * 2
    assert stick_slip(ripple, 0.5, 0.0) is None  # a perfect sensor makes no stick-slip of it
    assert stick_slip(ramps, 0.5, 0.1) is None  # nor does a poor one


def test_a_motion_that_ends_level_is_distinguished_from_one_that_rises_to_its_end():
    s = np.linspace(1e-3, 0.025, 400)
    assert ends_level(Resistance(s, np.minimum(0.5, 40.0 * s)))
    assert not ends_level(Resistance(s, 40.0 * s))
    assert not ends_level(Resistance(s, -0.5 + 40.0 * s))


def test_one_motion_alone_that_slips_is_a_bound_that_says_so():
    sensed = Sensed(noise=1.0)
    there = sensed.stroke(lambda s: np.minimum(0.5, 0.5 * s / 0.005), nothing, 0.02)
    end = float(there.position[-1] @ sensed.frame[:, 0])
    back = sensed.stroke(gives_way(1.0, 0.0092, preload=-0.5), nothing, -0.02, begin=end)
    found = bounded(TwoWay(there, back))
    assert found.partly
    assert found.least_friction <= 0.5
    assert not bounded(sensed.two_way(gives_way(0.5, 0.01), nothing, 0.02)).partly


def test_without_mu_twists_still_bound_mu_e_and_say_why_that_is_all():
    """With mu, stick-slip of a twist has a static torque."""
    sensed = Sensed(noise=1.0)
    slipped = bound_spin([sensed.two_way(nothing, slips(2e-3, 0.1), spin=2.0)], sensed.normal)
    assert slipped.doubt is SpinUncertainty.FRICTION_UNKNOWN
    assert 1.7e-3 < slipped.least_torque_ratio <= 2e-3
    stuck = bound_spin([elastic_turns(sensed, 2e-3, 0.5, 2.0)], sensed.normal)
    assert stuck.doubt is SpinUncertainty.NEVER_SLIPPED
    assert stuck.least_torque_ratio <= 1e-3
    turned = spun(sensed.two_way(nothing, sawtooth(1e-3, 2e-3, 0.02), spin=2.0), known=rubbed(sensed))
    assert turned.static_torque_ratio == pytest.approx(2e-3, rel=0.05)


@pytest.mark.parametrize("radius", [0.1, 0.3])
def test_the_normal_is_known_beside_a_stroke_on_a_bent_surface(radius):
    """On a cylinder the normal turns by the way over the radius; on a plane not at all, however noisy."""
    sensed = Sensed(random_pose=False, noise=1.0)
    found = measured(bent(sensed.two_way(slips(0.5, 1e-4), nothing, 0.02), radius))
    for away in (-0.003, 0.003):
        turned = found.normal_at(found.bend.place + away * sensed.frame[:, 0])
        assert math.asin(np.linalg.norm(np.cross(turned, found.normal))) == pytest.approx(0.003 / radius, rel=0.15)
        assert float((turned - found.normal) @ sensed.frame[:, 0]) * away > 0.0  # as `bent` turns its forces
    flat = [rubbed(Sensed(np.random.default_rng(seed), noise=1.0)) for seed in range(30)]
    assert sum(bool(np.any(each.bend.rate)) for each in flat) <= 1


@pytest.mark.parametrize("frequency", [8.0, 20.0, 40.0])
def test_a_tip_that_shakes_along_the_surface_while_it_turns_does_not_shorten_e(frequency):
    """As an arm's does: with a third of mu f_n, RMS, the torque is 5 % less than that of a pure twist."""
    mu, e, spin, share = 0.5, 0.003, 2.0, 0.45
    sensed = Sensed(np.random.default_rng(3), noise=1.0)
    known = measured(sensed.two_way(slips(mu, 1e-4), nothing, speed=0.01))

    def shaken(angle):
        return share * np.sin(2.0 * math.pi * frequency * angle / spin)

    def torque(angle):
        return slips(mu * e, 0.02)(angle) * np.sqrt(1.0 - shaken(angle) ** 2)

    twists = [sensed.two_way(lambda angle: mu * shaken(angle), torque, spin=spin) for _ in range(2)]
    found = spun(*twists, known=known)
    assert found.spin_length.value == pytest.approx(e, rel=0.01)
    assert found.slide == pytest.approx(share / math.sqrt(2.0), rel=0.08)
