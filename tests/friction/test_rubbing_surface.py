"""A whole limit surface from slips; the slips that tell it; mu over the speed, and creep."""

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from trust.limit_surface import pushing_loads

from palpate.estimation import Assumption
from palpate.friction import LimitSurface
from palpate.friction.contact_load import Slip
from palpate.friction.rubbing.estimate import Estimate
from palpate.friction.rubbing.slip_load import SlipLoad
from palpate.friction.rubbing.slip_loads import slip_load
from palpate.friction.rubbing.speed_curve import SpeedPoint, fit_speed_curve
from palpate.friction.rubbing.stroke_plan import planned_slips
from palpate.friction.rubbing.surface_fit import fit_limit_surface
from palpate.sim.friction.law import FrictionLaw
from support.closed_strokes import Sensed, nothing

exponents = st.floats(1.08, 2.0)


def law_of(mu=0.5, c=0.003, gamma=0.2, p=1.5):
    return FrictionLaw(mu, mu, spin_length=c, load_exponent=gamma, norm_exponent=p)


def scattered(rng):
    """Factors of force and torque: scatter by 3 %."""
    return 1.0 + 0.03 * rng.normal(size=2)


def slip_of(law, normal_force, speed, spin, scatter=(1.0, 1.0), assumed=None):
    """The load of a slip; `assumed` is its speed as taken for."""
    force, torque = np.multiply(law.slipping_load(normal_force, speed, spin), scatter)
    return SlipLoad(normal_force, force, torque, speed if assumed is None else assumed, spin)


def loads_of(law, forces=(0.7, 5.0), rng=None, know=1.0):
    lengths = tuple(know * law.spin_length_at(force) for force in forces)
    return [
        slip_of(law, slip.normal_force, slip.speed, slip.spin, scattered(rng) if rng else (1.0, 1.0))
        for slip in planned_slips(forces, lengths, 18)
    ]


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(st.floats(0.1, 1.2), st.floats(1e-3, 8e-3), st.floats(0.0, 1.0 / 3.0), exponents, st.floats(0.85, 1.15))
def test_without_scatter_the_surface_comes_back(mu, c, gamma, p, know):
    found = fit_limit_surface(loads_of(law_of(mu, c, gamma, p), know=know), 0.003).surface
    assert found.friction == pytest.approx(mu, rel=2e-3)
    assert found.spin_length == pytest.approx(c, rel=4e-3)
    assert found.load_exponent == pytest.approx(gamma, abs=2e-3)
    assert found.norm_exponent == pytest.approx(p, abs=0.01)


def test_units_of_force_do_not_matter_but_for_c():
    """Every force 10 times: mu, gamma, p stay, and c is e at 1 N, so it falls by 10^gamma."""
    loads = loads_of(law_of(), rng=np.random.default_rng(5))
    tenfold = [SlipLoad(*(10 * x for x in load[:3]), *load[3:]) for load in map(dataclasses.astuple, loads)]
    a, b = (fit_limit_surface(each, 0.03, 1e-9, 1e-12).surface for each in (loads, tenfold))
    assert b.friction == pytest.approx(a.friction, rel=1e-4)
    assert (b.load_exponent, b.norm_exponent) == pytest.approx((a.load_exponent, a.norm_exponent), abs=1e-4)
    assert b.spin_length == pytest.approx(a.spin_length * 10**-a.load_exponent, rel=1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("p", [1.1, 1.5, 2.0])
def test_from_18_strokes_at_3_percent_p_within_015_and_gamma_within_005_and_the_scatter(p):
    rng = np.random.default_rng([11, round(100 * p)])
    gammas = rng.uniform(0.0, 1.0 / 3.0, 4)
    found = [fit_limit_surface(loads_of(law_of(gamma=g, p=p), rng=rng)) for g in gammas]
    off = np.abs([each.surface.load_exponent for each in found] - gammas)
    assert max(abs(each.surface.norm_exponent - p) for each in found) < 0.15
    assert off.max() < 0.05
    assert np.median([each.scatter for each in found]) == pytest.approx(0.03, rel=0.25)
    assert sum(off < [1.96 * each.standard_deviations[2] for each in found]) >= 3


@pytest.mark.slow
def test_the_error_of_a_finger_that_turns_beside_the_contact_is_in_the_interval():
    """0.3 mm off: taken for exact, intervals of p are far too narrow; stated, they hold it."""
    rng, law, held = np.random.default_rng(3), law_of(p=1.3), {0.0: 0, 3e-4: 0}
    for _ in range(5):
        loads = []
        for load in loads_of(law):
            x, y = load.spin * rng.normal(size=2) * 3e-4
            speed = math.hypot(load.speed + x, y)
            loads.append(slip_of(law, load.normal_force, speed, load.spin, scattered(rng), load.speed))
        for place_error in held:
            found = fit_limit_surface(loads, place_error=place_error)
            held[place_error] += abs(found.surface.norm_exponent - 1.3) < 1.96 * found.standard_deviations[3]
    assert held[3e-4] >= 4
    assert held[0.0] < held[3e-4]


@pytest.mark.slow
def test_the_planned_slips_show_p_and_gamma_better_than_thirds_of_each_kind():
    """Against translate, twist and v = e omega at 1, 2 and 4 N, twice each, over the same surfaces."""
    law, errors = law_of(p=1.75), []
    e = {force: law.spin_length_at(force) for force in (1.0, 2.0, 4.0)}
    kinds = [(f, v, 0.02 * w / e[f]) for f in (*e, *e) for v, w in ((0.02, 0.0), (0.0, 1.0), (0.014, 0.7))]
    for seed in range(6):
        rngs = [np.random.default_rng([2, seed]) for _ in range(2)]
        both = loads_of(law, (1.0, 4.0), rngs[0]), [slip_of(law, *kind, scattered(rngs[1])) for kind in kinds]
        found = [fit_limit_surface(loads).surface for loads in both]
        errors.append([(each.norm_exponent - 1.75, each.load_exponent - 0.2) for each in found])
    planned, plain = np.sqrt(np.mean(np.square(errors), axis=0))
    assert planned[0] < 0.6 * plain[0]
    assert planned[1] < plain[1]


def test_planned_slips_have_one_slip_speed_and_both_ends_of_the_range():
    slips_ = planned_slips((1.0, 4.0), (0.002, 0.003), 18, 0.02)
    assert [slip.normal_force for slip in slips_].count(4.0) == 9
    for slip in slips_:
        e = 0.002 if slip.normal_force == 1.0 else 0.003
        assert math.hypot(slip.speed, e * slip.spin) == pytest.approx(0.02)
    for some in (slips_[:6], slips_):
        assert {(slip.speed > 0.0, slip.spin > 0.0) for slip in some} == {
            (True, False),
            (False, True),
            (True, True),
        }


@settings(max_examples=15, deadline=None)
@given(st.integers(0, 2**32 - 1), exponents, st.floats(0.0, 4.0))
def test_a_recorded_slip_gives_back_its_load(seed, p, ratio):
    """Elastic motion gives none."""
    law, sensed = law_of(p=p), Sensed(np.random.default_rng(seed))
    e = law.spin_length_at(sensed.force)
    speed, spin = 0.02 * ratio / math.hypot(ratio, 1.0), 0.02 / e / math.hypot(ratio, 1.0)
    force, torque = law.slipping_load(sensed.force, speed, spin)

    def constant(share):
        return lambda s: np.where(s > 0.0, share / sensed.force, 0.0)

    found = slip_load(sensed.two_way(constant(force), constant(torque), speed, spin), sensed.normal, e)
    assert found.tangential_force == pytest.approx(force, rel=1e-6, abs=1e-9)
    assert found.spin_torque == pytest.approx(torque, rel=1e-6, abs=1e-12)
    assert found.speed == pytest.approx(speed, rel=1e-6, abs=1e-12)
    assert found.spin == pytest.approx(spin, rel=1e-6)
    noisy = Sensed(noise=1.0)
    assert slip_load(noisy.two_way(lambda s: 50.0 * s, nothing, 0.02), noisy.normal, 0.003) is None


SPEEDS = (1e-3, 2e-3, 4e-3, 8e-3, 16e-3, 32e-3, 64e-3)


def curve_of(law, speeds=SPEEDS, rng=None):
    """The curve through mu of a law over the speed, with noise of 0.2 % if there is chance."""
    frictions = [law(v) * (1.0 + 0.002 * rng.normal() if rng else 1.0) for v in speeds]
    points = [SpeedPoint(v, Estimate(mu, 0.002 * mu, 0.0)) for v, mu in zip(speeds, frictions, strict=True)]
    return fit_speed_curve(points)


def test_a_constant_is_found_as_one_and_no_curve_is_seen_in_noise():
    rng = np.random.default_rng(1)
    curves = [curve_of(lambda v: 0.4, rng=rng) for _ in range(40)]
    assert [curve.kinetic_friction for curve in curves] == pytest.approx([0.4] * 40, rel=0.01)
    assert not any(curve.creeping for curve in curves)
    assert sum(curve.static_friction > 1.02 * curve.kinetic_friction for curve in curves) <= 2


def test_static_kinetic_and_viscous_friction_come_back():
    """Friction that grows with the speed is not taken for creep."""
    law = FrictionLaw(0.5, 0.35, stribeck_speed=0.01, viscous_friction=1.0)
    curve = curve_of(law.friction_at, rng=np.random.default_rng(2))
    for name, tolerance in (
        ("kinetic_friction", 0.02), ("static_friction", 0.03), ("stribeck_speed", 0.15), ("viscous_friction", 0.1),
    ):  # fmt: skip
        assert getattr(curve, name) == pytest.approx(getattr(law, name), rel=tolerance)
    np.testing.assert_allclose(
        [curve.friction_at(v) for v in SPEEDS], [law.friction_at(v) for v in SPEEDS], rtol=0.01
    )
    growing = curve_of(lambda v: 0.3 + 1.5 * v)
    assert growing.creeping == ()
    assert growing.viscous_friction == pytest.approx(1.5, rel=0.05)


def test_creep_is_left_out_and_one_speed_never_excludes_it():
    curve = curve_of(lambda v: 0.4 * min(1.0, v / 0.005))
    assert curve.creeping == (1e-3, 2e-3, 4e-3)
    assert curve.kinetic_friction == pytest.approx(0.4, rel=1e-6)
    assert curve.creep_excluded
    assert not curve_of(lambda v: 0.4, (0.02,)).creep_excluded
    # all of them creep: the fastest is no more than a guess
    assert not curve_of(lambda v: 10.0 * v).creep_excluded


@pytest.mark.parametrize(("inside", "noise"), [(0.0, 0.5), (0.5, 0.0), (0.8, 0.5)])
def test_real_pushing_loads_never_collapse_and_those_that_do_not_slip_are_reported(inside, noise):
    found = fit_limit_surface(pushing_loads(1, inside, noise)[0])
    assert 0.15 < found.surface.friction < 0.4
    held = abs(found.surface.friction - 0.35) < 4.0 * found.standard_deviations[0]
    assert held or not found.verdict.ok
    assert found.verdict.ok == (inside == 0.0)


def test_a_norm_exponent_above_2_is_fitted_where_the_loads_ask_for_it():
    rng, surface, loads = np.random.default_rng(4), LimitSurface(0.5, 0.003, 0.2, 3.0), []
    for slip in planned_slips((1.0, 5.0), (0.003, 0.003 * 5.0**0.2), 18, 0.02):
        load = surface.load_for_slip(slip.normal_force, Slip((slip.speed, 0.0, 0.0), slip.spin))
        force, torque = np.multiply((load.tangential_length, load.spin_torque), scattered(rng))
        loads.append(SlipLoad(slip.normal_force, force, torque, slip.speed, slip.spin))
    found = fit_limit_surface(loads)
    assert found.verdict.ok
    assert abs(found.surface.norm_exponent - 3.0) < 3.0 * found.standard_deviations[3]


@pytest.mark.parametrize("share", [0.0, 0.1])
def test_another_mu_along_each_axis_is_found_only_where_there_is(share):
    """mu 0.5 (1 + share) along a heading, 0.5 (1 - share) across it."""
    rng = np.random.default_rng(6)
    loads = [load for load in loads_of(law_of(), rng=rng) if load.spin == 0.0 or load.speed == 0.0]
    for heading in np.arange(20) * math.pi / 5.0:
        along = math.hypot((1.0 + share) * math.cos(heading), (1.0 - share) * math.sin(heading))
        loads.append(SlipLoad(2.0, along * (1.0 + 0.03 * rng.normal()), 0.0, 0.02, 0.0, heading))
    found = fit_limit_surface(loads)
    assert (found.axes is None) == (share == 0.0)
    if found.axes is not None:
        assert found.verdict.breaks(Assumption.WHITE_IN_DIRECTION)
        assert found.axes.largest == pytest.approx(0.55, rel=0.06)
        assert found.axes.least == pytest.approx(0.45, rel=0.06)
