"""One contact is bit for bit one of many, however the wrench is given; a notebook shows it with units."""

import pickle
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError, fields

import numpy as np
import pytest
from contact_solutions import conditions, exact
from hypothesis import given
from hypothesis import strategies as st

from palpate import (
    Capsule,
    CompliantTip,
    Contact,
    ContactStatus,
    Cylinder,
    Ellipsoid,
    Paraboloid,
    Plane,
    Solver,
    Sphere,
    contact_from_wrench,
    contacts_from_wrenches,
)

SURFACES = (
    Sphere(0.01), Ellipsoid((0.008, 0.009, 0.012)), Cylinder(0.01), Plane(0.01), Paraboloid((0.01, 0.01)),
    Capsule(0.01, 0.03), CompliantTip(Sphere(0.01), 5e3),
)  # fmt: skip
WRENCHES = np.random.default_rng(5).normal(size=(72, 6)) * np.repeat([1.0, 0.01], 3)
WRENCHES[:7] = [
    [0, 0, 0, 0.01, 0.02, 0.03], [0, 0, -1, 0, 5, 0], [0, 0, np.nan, 0, 0, 0], [0, 0, -1, 0, 0, np.inf], [0] * 6,
    [-0.0, -0.0, 0.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1e-200, 1e-203, 0.0, 1e-203],
]  # fmt: skip
NAMES = [field.name for field in fields(Contact)]
VECTORS = ("centroid", "normal", "force", "tangential_force")
NUMBERS = ("normal_force", "spin_torque", "condition")


def bits(found, row=()):
    """One contact, or a row of many, to the last bit, the sign of zero included."""
    return b"".join(np.asarray(getattr(found, name), float)[row].tobytes() for name in NAMES)


@pytest.mark.parametrize("model", ["soft", "hard"])
@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: type(surface).__name__)
def test_one_is_one_of_many(surface, model):
    given = WRENCHES.copy()
    solver, batch = Solver(surface, model), contacts_from_wrenches(surface, given, model)
    np.testing.assert_array_equal(given, WRENCHES)
    given[:] = 7.0  # the result does not look into the caller's array
    for i, wrench in enumerate(WRENCHES):
        assert bits(solver(wrench)) == bits(contact_from_wrench(surface, wrench, model)) == bits(batch, i)


def test_any_memory_layout_and_number_type_mean_the_same_numbers():
    """Slices, Fortran order, float32, integers, lists, read-only arrays; float32 is widened, not solved in."""
    surface, w = Ellipsoid((1.0, 2.0, 1.5)), np.random.default_rng(2).integers(-8, 9, (20, 6)).astype(np.float64)
    wide = np.full((40, 12), np.nan)
    wide[::2, ::2] = w
    read_only = w.copy()
    read_only.setflags(write=False)
    arrays = [w.astype(t) for t in (np.float32, np.int64, np.int8, w.dtype.newbyteorder())]
    variants = [
        wide[::2, ::2], np.asfortranarray(w), w[::-1][::-1], read_only, *arrays, w.tolist(), [*map(tuple, w)],
    ]  # fmt: skip
    base, solver = contacts_from_wrenches(surface, w), Solver(surface)
    for each in variants:
        assert bits(contacts_from_wrenches(surface, each), 3) == bits(base, 3)
        assert bits(solver(each[3])) == bits(base, 3)
    single = np.array([0.1, 0.2, -1.0, 0.3, 0.1, 0.2], np.float32)
    assert bits(solver(single)) == bits(solver(single.astype(float)))


def test_types_and_shapes():
    """Floats and ContactStatus for one, float64 arrays and int8 for many."""
    one, many = contact_from_wrench(SURFACES[0], WRENCHES[9]), contacts_from_wrenches(SURFACES[0], WRENCHES)
    none = contacts_from_wrenches(SURFACES[0], np.empty((0, 6)), "hard")
    assert (len(none), len(many)) == (0, 72)
    assert isinstance(one.status, ContactStatus)
    assert many.status.dtype == np.int8
    for names, shape in ((VECTORS, (3,)), (NUMBERS, ())):
        for name in names:
            assert np.shape(getattr(one, name)) == shape
            assert getattr(none, name).shape == (0, *shape)
            assert getattr(many, name).shape == (72, *shape)
            assert getattr(many, name).dtype == np.asarray(getattr(one, name)).dtype == np.float64
    assert {type(getattr(one, name)) for name in NUMBERS} == {float}


def test_a_contact_stays_as_it_is_when_the_next_is_found():
    solver = Solver(SURFACES[1])
    first = solver(WRENCHES[10])
    before = bits(first)
    solver(WRENCHES[11])
    assert bits(first) == bits(pickle.loads(pickle.dumps(first))) == before
    assert type(first) is Contact
    for result in (first, contacts_from_wrenches(SURFACES[1], WRENCHES)):
        with pytest.raises(FrozenInstanceError):
            result.normal_force = 0.0  # pyright: ignore[reportAttributeAccessIssue]
    with pytest.raises(ValueError, match="read-only"):
        first.centroid[0] = 0.0


@pytest.mark.slow
def test_threads_and_processes_share_it():
    for surface in SURFACES[1::5]:
        solver = pickle.loads(pickle.dumps(Solver(surface, "hard")))
        assert solver.model == "hard"
        with ThreadPoolExecutor(4) as pool:
            found = [bits(contact) for contact in pool.map(solver, WRENCHES, chunksize=1)]
        assert found == [bits(Solver(surface, "hard")(wrench)) for wrench in WRENCHES]


@pytest.mark.slow
def test_the_condition_is_the_amplification_for_every_kind_of_tip():
    assert conditions("e") == 0


@pytest.mark.slow
def test_contacts_of_meshes_and_symbolic_tips_are_found_or_ambiguous():
    """None missed, none wrong beyond 1e-12 times the condition, with normal forces from 1e-3 of the tangential."""
    assert exact(20_000, "") == 0


@given(st.lists(st.floats(-5.0, 5.0), min_size=6, max_size=6))
def test_every_quantity_is_shown_once_with_its_unit(wrench):
    contact = contact_from_wrench(Sphere(0.008), np.array(wrench))
    html = contact._repr_html_()
    rows = re.findall(r"<tr><th>([a-z ]+)</th><td>([^<]*)</td><td>([^<]*)</td></tr>", html)
    shown = {name: (value, unit) for name, value, unit in rows}
    assert (
        html
        == "<table>" + "".join(f"<tr><th>{n}</th><td>{v}</td><td>{u}</td></tr>" for n, v, u in rows) + "</table>"
    )
    assert shown["status"] == (contact.status.name, "")
    assert {name: unit for name, (_, unit) in shown.items() if unit} == {
        "centroid": "mm", "normal force": "N", "tangential force": "N", "spin torque": "mN m",
    }  # fmt: skip
    force = float(shown["normal force"][0])
    np.testing.assert_allclose(force, contact.normal_force, rtol=1e-3)  # nan where there is no contact
    centroid = [float(entry) for entry in shown["centroid"][0].split(", ")]
    np.testing.assert_allclose(centroid, 1e3 * contact.centroid, rtol=1e-3)
