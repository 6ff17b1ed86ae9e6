"""The file of materials: what comes with palpate, what is written reads back, and what cannot be is refused."""

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palpate.errors import InvalidValueError
from palpate.friction.materials.library import (
    MaterialLibrary,
    load_materials,
    read_materials,
    simulated_materials,
)
from palpate.friction.materials.material import Deviations, Material

TEXT = """palpate_materials: 1
fingertip: made up
materials:
  - name: felt
    kinetic_friction: 0.5
    spin_length_m: 0.003
    scatter: {friction: 0.02, spin_length: 0.03}
    provenance: made up
"""


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


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("palpate_materials: 1", "palpate_materials: 2", "version 1"),
        ("palpate_materials: 1", "palpate_material: 1", "misspelt"),
        ("spin_length_m: 0.003", "spin_length_mm: 3.0", r"materials\[0\].spin_length_mm"),
        ("spin_length_m: 0.003", "spin_length_m: 3.0", "in millimetres"),
        ("kinetic_friction: 0.5", "kinetic_friction: 50.0", "in per cent"),
        ("kinetic_friction: 0.5", "kinetic_friction: 0.0", "above 0"),
        ("kinetic_friction: 0.5", "kinetic_friction: .nan", "kinetic_friction"),
        ("kinetic_friction: 0.5", "kinetic_friction: high", "kinetic_friction"),
        (
            "spin_length_m: 0.003",
            "spin_length_m: 0.003\n    static_friction: 0.4",
            "at least the kinetic_friction",
        ),
        ("spin_length_m: 0.003", "spin_length_m: 0.003\n    norm_exponent: 5.0", "between 1 .* and 4"),
        ("spin_length_m: 0.003", "spin_length_m: 0.003\n    load_exponent: 0.5", "at most 0.3333"),
        ("friction: 0.02,", "friction: 2.0,", "0.02 stands for 2 %"),
        ("friction: 0.02,", "friction: 0.0,", "scatter.friction"),
        ("    provenance: made up\n", "", "provenance"),
        ("name: felt", 'name: " "', "name"),
    ],
)
def test_what_is_wrong_is_refused_with_its_place(old, new, message):
    assert read_materials(TEXT).names == ("felt",)
    assert old in TEXT
    with pytest.raises(InvalidValueError, match=message):
        read_materials(TEXT.replace(old, new, 1))


def test_names_are_each_a_materials_own(tmp_path):
    entry = TEXT[TEXT.index("  - name") :]
    file = tmp_path / "twice.yaml"
    file.write_text(TEXT + entry)
    with pytest.raises(InvalidValueError, match=r"twice.yaml: .*'felt'"):
        load_materials(file)
    with pytest.raises(InvalidValueError, match="0 materials"):
        MaterialLibrary(fingertip="made up", materials=())
    felt = read_materials(TEXT).materials[0]
    with pytest.raises(InvalidValueError, match="fingertip"):
        MaterialLibrary(fingertip="", materials=(felt, msgspec.structs.replace(felt, name="wool")))
