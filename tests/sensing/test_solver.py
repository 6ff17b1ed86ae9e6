"""One contact at a time is bit for bit one of many, however the wrench is given and whoever asks."""

import pickle
from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError, fields
from typing import Any

import numpy as np
import pytest

from palpate import Capsule, CompliantTip, Contact, Contacts, Ellipsoid, Paraboloid, Solver, Sphere
from palpate import contact_from_wrench as one
from palpate import contacts_from_wrenches as many
from palpate.errors import InvalidValueError

SURFACES = (
    Ellipsoid((0.008, 0.009, 0.012)),
    Paraboloid((0.01, 0.01)),
    Capsule(0.01, 0.03),
    CompliantTip(Sphere(0.01), 5e3),
)
RNG = np.random.default_rng(5)
WRENCHES = np.vstack([RNG.normal(size=(70, 6)) * np.repeat([1.0, 0.01], 3), np.zeros(6), np.full(6, np.nan)])
NAMES = [field.name for field in fields(Contact)]


def bits(contact: Contact) -> bytes:
    return b"".join(np.asarray(getattr(contact, name), float).tobytes() for name in NAMES)


def row_bits(contacts: Contacts, i: int) -> bytes:
    return b"".join(np.asarray(getattr(contacts, name)[i], float).tobytes() for name in NAMES)


@pytest.mark.parametrize("model", ["soft", "hard"])
@pytest.mark.parametrize("surface", SURFACES, ids=lambda surface: type(surface).__name__)
def test_one_is_one_of_many(surface, model):
    solver, batch = Solver(surface, model), many(surface, WRENCHES, model)
    for i, wrench in enumerate(WRENCHES):
        assert bits(solver(wrench)) == bits(one(surface, wrench, model)) == row_bits(batch, i)


def test_however_the_wrench_is_given():
    solver, wrench = Solver(SURFACES[0]), WRENCHES[0]
    frozen = wrench.copy()
    frozen.setflags(write=False)
    for given in (wrench.tolist(), tuple(wrench), frozen, np.repeat(wrench, 2)[::2], wrench.astype(">f8")):
        assert bits(solver(given)) == bits(solver(wrench))
    integers = [1, 0, -2, 0, 0, 0]
    assert bits(solver(integers)) == bits(solver(np.array(integers, float)))


def test_a_contact_stays_as_it_is_when_the_next_is_found():
    solver = Solver(SURFACES[0])
    first = solver(WRENCHES[0])
    before = bits(first)
    solver(WRENCHES[1])
    assert bits(first) == before
    assert type(first) is Contact
    written: Any = first
    with pytest.raises(FrozenInstanceError):
        written.normal_force = 0.0
    with pytest.raises(ValueError, match="read-only"):
        first.centroid[0] = 0.0
    assert bits(pickle.loads(pickle.dumps(first))) == before


def test_threads_and_processes_share_it():
    for surface in SURFACES[::3]:
        solver = pickle.loads(pickle.dumps(Solver(surface, "hard")))
        assert solver.model == "hard"
        with ThreadPoolExecutor(4) as pool:
            found = [bits(contact) for contact in pool.map(solver, WRENCHES, chunksize=1)]
        assert found == [bits(Solver(surface, "hard")(wrench)) for wrench in WRENCHES]


@pytest.mark.parametrize(
    ("given", "named"),
    [
        (lambda: Solver(SURFACES[0], []), "model"),
        (lambda: Solver([]), "surface"),
        (lambda: one([], WRENCHES[0]), "surface"),
        (lambda: one(SURFACES[0], WRENCHES[0], {}), "model"),
        (lambda: Solver(SURFACES[0])(np.ones(5)), "wrench has shape"),
    ],
)
def test_refusals(given, named):
    with pytest.raises(InvalidValueError, match=named):
        given()
