"""Built contacts on every kind of fingertip: the sampled version of `benchmarks/every_tip.py`."""

import dataclasses

import every_tip
import numpy as np
import pytest

from palpate import ContactStatus

KINDS = {kind.name: kind for kind in every_tip.kinds()}


def named(name):
    """A kind by its name; of functions of one's own each run compiles the solver anew."""
    return pytest.param(name, marks=pytest.mark.slow) if name == "own function, compiled" else name


@pytest.mark.parametrize("name", [named(name) for name in KINDS])
def test_built_contacts(name):
    """Found, each of them, where it was built; and nothing is reported that is not a contact of the tip."""
    kind = KINDS[name]
    few = dataclasses.replace(kind, surfaces=1 if name.startswith("own function") else 4)
    count = 12 if name.endswith("Python") else 1200
    row = every_tip.measure(few, count, np.random.default_rng([2, list(KINDS).index(name)]))
    for tip, built, checked in row.checked:
        bad = checked.ok & ~(checked.is_contact & checked.within(kind))
        assert not bad.any(), f"{bad.sum()} wrong on {tip.surface!r}: {built.wrench[bad][0].tolist()}"
        missed = ~checked.ok & (not kind.beyond)
        assert not missed.any(), f"{missed.sum()} missed on {tip.surface!r}: {built.wrench[missed][0].tolist()}"
        # contacts that a too soft tip does not have get a status that says so
        known = (ContactStatus.OK, ContactStatus.NO_CONTACT, ContactStatus.NOT_CONVERGED)
        assert np.isin(checked.status, known).all()
    if kind.exponent or "superellipsoid" in name or "function" in name:
        assert row.largest("unbalanced") <= 1e-12


@pytest.mark.parametrize("name", ["sphere", "paraboloid", "hyperboloid", "capsule", "superellipsoid 2.5"])
def test_the_checks_can_fail(name, monkeypatch):
    """A centroid, a normal or a spin torque that is a little wrong is noticed, and a slightly wrong tip too."""
    tip = every_tip.Tip.draw(KINDS[name], np.random.default_rng(3), placed=True)
    built = tip.contacts(np.random.default_rng(4), 50, (0.0, 0.0))
    solve = every_tip.contacts_from_wrenches
    assert every_tip.check(tip, built)[0].is_contact.all()

    def spoiled(field, change):
        def solved(surface, wrenches):
            found = solve(surface, wrenches)
            return dataclasses.replace(found, **{field: change(getattr(found, field))})

        monkeypatch.setattr(every_tip, "contacts_from_wrenches", solved)
        return every_tip.check(tip, built)[0]

    moved = spoiled("centroid", lambda c: c + 1e-10 * tip.shape.size)
    assert not moved.is_contact.any()
    assert not moved.within(KINDS[name])[moved.spread < 100].any()
    for field, change in (
        ("normal", lambda n: -n),
        ("spin_torque", lambda q: q + 1e-3),
        ("normal_force", lambda p: -p),
        ("condition", lambda k: k * np.nan),
    ):
        assert not spoiled(field, change).is_contact.any(), field


@pytest.mark.parametrize(
    "name", ["sphere", "cylinder", "plane", "capsule", "superellipsoid 4", "paraboloid", "hyperboloid"]
)
def test_the_condition_number_bounds_the_error_of_the_centroid(name):
    """Wrenches with a force and a moment wrong by 1e-7: the centroid by at most twice the condition number's."""
    rng = np.random.default_rng(5)
    tip = every_tip.Tip.draw(KINDS[name], rng, placed=False)
    built = tip.contacts(rng, 2000, (0.0, 0.0))
    noise = rng.normal(size=(2000, 2, 3))
    whole = np.linalg.norm(built.wrench.reshape(-1, 2, 3), axis=2, keepdims=True)
    noise *= 1e-7 * whole / np.linalg.norm(noise, axis=2, keepdims=True)
    found = every_tip.contacts_from_wrenches(tip.surface, built.wrench)
    off = every_tip.contacts_from_wrenches(tip.surface, built.wrench + noise.reshape(-1, 6))
    both = (found.status == 0) & (off.status == 0) & (found.condition < 1e3)
    assert both.mean() > 0.9
    # an open quadric has the origin, its apex, on the surface: there errors are relative to its size too
    size = min(tip.surface.coefficients[:2]) if name in ("paraboloid", "hyperboloid") else 0.0
    error = np.linalg.norm(off.centroid - found.centroid, axis=1)
    error /= np.linalg.norm(found.centroid, axis=1) + size
    assert (error <= 2.0 * 1e-7 * found.condition)[both].all()
