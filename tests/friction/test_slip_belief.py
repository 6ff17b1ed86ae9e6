"""What holding and slipping teach about friction."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface
from palpate.friction.slip.belief import FrictionBelief
from support.loads_on_surface import on_surface as at

TRUE = LimitSurface(0.5, 0.004)


shares, across = st.floats(0.0, 0.5 * math.pi), st.floats(0.0, 2.0 * math.pi)


def wide(friction=0.5, spin_length=0.004):
    return FrictionBelief(friction, spin_length, friction_deviation=0.3, spin_length_deviation=0.4)


def touched():
    return FrictionBelief(0.5, 0.004, friction_deviation=0.03, spin_length_deviation=0.05)


def surfaces(belief):
    return [belief.quantile(p) for p in (0.02, 0.2, 0.5, 0.8)]


def test_the_prior_comes_back_as_it_was_given():
    belief = touched()
    middle = belief.quantile(0.5)
    assert middle.friction == pytest.approx(0.5, rel=2e-3)
    assert middle.spin_length == pytest.approx(0.004, rel=4e-3)
    assert belief.friction_deviation == pytest.approx(0.03, rel=0.05)
    assert belief.spin_length_deviation == pytest.approx(0.05, rel=0.05)
    assert belief.quantile(0.023).friction == pytest.approx(0.5 * math.exp(-0.06), rel=5e-3)


@given(shares, st.floats(0.5, 1.5), across, st.integers(2, 50))
@settings(max_examples=25, deadline=None)
def test_a_held_load_only_ever_raises_friction(share, ratio, turned, times):
    """Holding the same load for long is no new evidence."""
    once, often = wide(), wide()
    before, load = surfaces(once), at(TRUE, 3.0, share, ratio, turned)
    once.held(load)
    for old, new in zip(before, surfaces(once), strict=True):
        assert new.friction >= old.friction * (1.0 - 1e-9)
        assert new.friction * new.spin_length >= old.friction * old.spin_length * (1.0 - 1e-9)
    for _ in range(times + 1):
        often.held(load)
    assert surfaces(often) == surfaces(once)


@given(shares, across)
@settings(max_examples=20, deadline=None)
def test_the_direction_of_a_load_does_not_matter(share, turned):
    one, other, load = wide(), wide(), at(TRUE, 3.0, share, 1.0, turned)
    one.slipped(at(TRUE, 3.0, share, 1.0))
    other.slipped(ContactLoad(load.normal_force, load.tangential_force, -load.spin_torque))
    for a, b in zip(surfaces(one), surfaces(other), strict=True):
        assert (a.friction, a.spin_length) == pytest.approx((b.friction, b.spin_length), rel=1e-3)


def test_slips_in_two_directions_show_both_mu_and_e():
    """A slip that only slides does not show the torque per force."""
    belief, sliding = wide(0.65, 0.003), wide()
    for share in (0.1, 1.45):
        belief.slipped(at(TRUE, 3.0, share, 1.0))
    middle, before = belief.quantile(0.5), sliding.spin_length_deviation
    assert middle.friction == pytest.approx(0.5, rel=0.04)
    assert middle.spin_length == pytest.approx(0.004, rel=0.06)
    sliding.slipped(at(TRUE, 3.0, 0.0, 1.0))
    assert sliding.quantile(0.5).friction / sliding.quantile(0.1).friction < 1.08
    assert sliding.spin_length_deviation == pytest.approx(before, rel=0.05)


@pytest.mark.parametrize("make", [wide, touched])
@pytest.mark.parametrize("wet", [0.8, 0.6, 0.4])
def test_a_surface_that_gets_wet_is_no_longer_believed_in(make, wet):
    belief = make()
    for share in (0.0, 0.8, 1.5):
        belief.held(at(TRUE, 3.0, share, 0.95))
    now = LimitSurface(0.5 * wet, 0.004)
    for share in (0.0, 0.8):
        belief.slipped(at(now, 3.0, share, 1.0))
    assert belief.quantile(0.5).friction < 1.06 * now.friction
    assert belief.quantile(0.02).friction < now.friction


def test_the_cautious_quantile_is_below_the_truth_as_often_as_it_says():
    """Prior, slips and held loads drawn from the model itself."""
    rng, above = np.random.default_rng(2), []
    for _ in range(300):
        true = LimitSurface(
            0.5 * math.exp(0.2 * rng.standard_normal()), 0.004 * math.exp(0.3 * rng.standard_normal())
        )
        belief = FrictionBelief(0.5, 0.004, friction_deviation=0.2, spin_length_deviation=0.3)
        belief.held(at(true, 3.0, rng.uniform(0.0, 1.5), rng.uniform(0.5, 0.9)))
        belief.slipped(at(true, 3.0, rng.uniform(0.0, 1.5), math.exp(0.03 * rng.standard_normal())))
        mu, e = belief.quantile(0.1).friction, belief.quantile(0.1).spin_length
        above.append((mu > true.friction, mu * e > true.friction * true.spin_length))
    # 30 are expected of each, with a deviation of 5.2
    assert np.sum(above, axis=0).max() <= 46


NO_LOADS = [
    ContactLoad(math.nan, (0.0, 0.0, 0.0), 0.0),
    ContactLoad(0.0, (1.0, 0.0, 0.0), 0.0),
    ContactLoad(1.0, (0.0, 0.0, 0.0), 0.0),
]


def test_a_load_that_is_none_or_that_no_friction_could_hold_teaches_nothing():
    """A contact that is misread as 3 N along and 50 mN across the normal would be a mu of 60."""
    belief, before = wide(), surfaces(wide())
    for load in NO_LOADS:
        belief.held(load)
        belief.slipped(load)
    belief.held(ContactLoad(0.05, (3.0, 0.0, 0.0), 0.0))
    assert surfaces(belief) == before
    belief.held(at(TRUE, 3.0, 0.0, 1.2))
    assert belief.quantile(0.02).friction > 1.1 * TRUE.friction


@pytest.mark.parametrize("tiny", [1e-3, 1e-200, 1e-310])
@pytest.mark.parametrize(
    "load",
    [
        lambda tiny: ContactLoad(tiny, (3.0, 0.0, 0.0), 1e-3),
        lambda tiny: ContactLoad(1.0, (tiny, 0.0, 0.0), 0.0),
        lambda tiny: ContactLoad(1.0, (0.0, 0.0, 0.0), 1e-3 * tiny),
    ],
    ids=["normal force", "force", "torque"],
)
def test_a_load_that_is_all_but_none_spoils_no_belief(load, tiny):
    belief = wide()
    belief.held(load(tiny))
    belief.slipped(load(tiny))
    assert all(0.1 < surface.friction < 1.5 for surface in surfaces(belief))
