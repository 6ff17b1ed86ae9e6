"""Materials: friction over speed, and those that come with palpate."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.friction.materials.library import simulated_materials
from palpate.friction.materials.material import Deviations, Material


@st.composite
def materials(draw, name="felt"):
    mu = draw(st.floats(0.05, 2.0))
    deviations = st.builds(
        Deviations,
        friction=st.floats(1e-3, 0.5),
        spin_length=st.floats(1e-3, 0.5),
        load_exponent=st.floats(0, 0.1),
    )
    return Material(
        name=name, kinetic_friction=mu, static_friction=draw(st.none() | st.just(mu * 1.2)),
        stribeck_speed=draw(st.floats(1e-3, 0.1)), viscous_friction=draw(st.floats(0.0, 5.0)),
        spin_length=draw(st.floats(1e-4, 0.02)), load_exponent=draw(st.floats(0.0, 1 / 3)),
        norm_exponent=draw(st.floats(1.0, 2.0)), scatter=draw(deviations), specimen=draw(deviations),
        provenance="made up",
    )  # fmt: skip


@given(materials())
def test_friction_goes_from_static_to_kinetic_plus_what_grows(one):
    static = one.kinetic_friction if one.static_friction is None else one.static_friction
    assert one.friction_at(0.0) == pytest.approx(static)
    fast = 10.0 * one.stribeck_speed
    assert one.friction_at(fast) == pytest.approx(one.kinetic_friction + one.viscous_friction * fast)
    assert one.spin_length_at(1.0) == pytest.approx(one.spin_length)


def test_what_comes_with_palpate_says_that_it_is_assumed_and_that_some_look_alike():
    library = simulated_materials()
    assert len(library.materials) >= 10
    assert all("assumed" in material.provenance for material in library.materials)
    named = dict(zip(library.names, library.materials, strict=True))
    steel, tile, abs_, cork = (named[name] for name in ("polished steel", "glazed tile", "ABS", "cork"))
    assert steel.friction_at(0.02) == tile.friction_at(0.02)
    assert math.log(tile.spin_length / steel.spin_length) > 5 * steel.scatter.spin_length
    assert (abs_.friction_at(0.02), abs_.spin_length) == (cork.friction_at(0.02), cork.spin_length)
    cardboard, film = named["cardboard"], named["greased aluminium"]
    assert cardboard.friction_at(0.02) == pytest.approx(film.friction_at(0.02), rel=0.005)
    assert abs(math.log(cardboard.friction_at(0.1) / film.friction_at(0.1))) > 0.3
