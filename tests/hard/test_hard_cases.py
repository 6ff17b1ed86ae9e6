"""Numerically hard contacts against 180-digit arithmetic: relative accuracy whatever the conditioning."""

import collections
import functools

import numpy as np
import pytest

import palpate
from palpate import ContactStatus, contact_from_wrench, contacts_from_wrenches
from reference import answers, cases, quadric
from reference.compare import BEYOND, FIELDS, INF, Answer, Measured, measure

U = 2.0**-53
LIMITS = dict.fromkeys(FIELDS, 4e-15) | {"centroid": 2e-15, "normal": 2e-15}
STORED = answers.stored()


def exact(field, r):
    """w.w is known to some u^2 |w|^2, so a vanishing g or k to (u kappa)^2 of itself."""
    return LIMITS[field] + (16 * (U * r.kappa) ** 2 if field in ("normal_force", "spin_torque") else 0.0)


def conditioned(field, r):
    """As good as the reported condition number promises."""
    return 8 * U * r.condition if field == "centroid" else LIMITS[field] * max(1.0, r.condition)


def moved(field, r):
    """The moment about the centre loses |center|/size: the normal turns by the error of c over the size."""
    reach = max(1.0, float(np.linalg.norm(r.case.center)) / min(r.case.semi_axes))
    return 4e-15 * (1.0 if field == "centroid" else r.kappa * reach)


def rotated_grazing(field, r):
    """A rotated surface sees a rounded wrench: the error of the centroid is that rounding times kappa."""
    return 8 * U * r.kappa if field == "centroid" else INF


def any_bits(field, r):
    """What double-double leaves of a grazing contact, (u kappa)^2, is stretched with the surface."""
    axes = r.case.semi_axes
    if field != "centroid":
        return INF
    return 8 * U * r.condition if INF in axes else 2e-15 + 16 * (max(axes) / min(axes) - 1.0) * (U * r.kappa) ** 2


GROUPS = {
    exact: cases.EXACT, conditioned: cases.CONDITIONED, moved: cases.MOVED, rotated_grazing: cases.MOVED_GRAZING,
    any_bits: cases.FUZZED,
}  # fmt: skip
LIMIT_OF = {name: limit for limit, group in GROUPS.items() for name in group}


@functools.cache
def measured(name: str) -> list[Measured]:
    """The stored cases of a category, without those whose contact float64 cannot hold."""
    both = zip(cases.sample(name, answers.STORED), STORED[name], strict=True)
    return [measure(case, answer) for case, answer in both if answer.status != BEYOND]


def error(field, r):
    # In turned axes f.m has the digits of double-double, and a rounded rotation mixes spin with the moment.
    turned = r.case.rotation != quadric.IDENTITY or r.case.center != quadric.ORIGIN
    return r.errors["spin_torque of moment" if turned and field == "spin_torque" else field]


def solvable(case):
    """Whether the force that the surface can take up is more than 1e-150 of the wrench (see the solver)."""
    size = min(case.semi_axes)
    press = max(abs(f) * (size / a) for f, a in zip(case.wrench[:3], case.semi_axes, strict=True))
    with np.errstate(over="ignore"):
        whole = max(np.abs(case.wrench[:3]).max(), np.abs(case.wrench[3:]).max() / size)
    return not any(case.wrench[:3]) or press > 1e-150 * whole


@pytest.mark.parametrize("name", cases.ALL)
def test_exactly_the_wrenches_that_a_contact_explains_have_one_and_it_is_as_exact_as_stated(name):
    """Every field of every single case; the worst is shown, replayable."""
    results = measured(name)
    if name in cases.FUZZED:  # beyond the range of the solver it may say so, but not be wrong
        results = [r for r in results if solvable(r.case) or r.status != "INVALID"]
        assert len(results) > 20
    wrong = [r for r in results if r.status != r.wanted_status]
    assert not wrong, f"{len(wrong)} statuses wrong: {wrong[0]}"
    for field in FIELDS if name in LIMIT_OF else ():
        worst = max(results, key=lambda r: error(field, r) / LIMIT_OF[name](field, r))
        assert error(field, worst) <= LIMIT_OF[name](field, worst), (field, worst)


@pytest.mark.parametrize("name", [n for n in cases.ALL if n not in cases.FUZZED])
def test_condition_is_a_number_where_there_is_a_contact_and_kappa_on_a_sphere(name):
    """On a sphere it is sqrt(2 (|m|^2 + R^2|f|^2)/|z|^2); it is small only on slender tips."""
    results = measured(name)
    counts = collections.Counter(r.wanted_status for r in results)
    assert counts["OK"] >= (0.0 if name in cases.MISSES else 0.5 if "hard" in name else 0.9) * len(results)
    assert name not in cases.MISSES or counts == {"NO_CONTACT": answers.STORED}
    for r in results:
        slenderness = max(r.case.semi_axes) / min(r.case.semi_axes)
        if r.status != "OK":
            assert r.condition == INF, r.case
            continue
        assert r.condition > slenderness**-2, r.case
        assert np.isfinite(r.condition) or r.kappa > 1e300, r.case
        if slenderness == 1.0 and r.case.model == "soft" and r.kappa < 1e12:
            assert r.condition == pytest.approx(np.sqrt(2.0) * r.kappa, rel=1e-6), r.case
        elif name in ("grazing", "large_moment"):
            assert r.kappa / slenderness**3 <= r.condition <= r.kappa * slenderness**3, r.case


@pytest.mark.parametrize("stretched", [(2,), (0,), (0, 1), (1, 2)])
@pytest.mark.parametrize("model", ["soft", "hard"])
def test_long_semi_axes_go_over_into_infinite_ones(stretched, model):
    """An ellipsoid 1e9 times and more longer than wide is a cylinder (a disc, two planes) to rounding."""
    rng = np.random.default_rng(11)
    for length in np.repeat([1e9, 1e12, 1e15, 1e30, 1e50, 1e59], 5):
        finite = 10.0 ** rng.uniform(-0.3, 0.3, 3)
        infinite = finite.copy()
        finite[list(stretched)], infinite[list(stretched)] = length, np.inf
        made = cases.built(rng, "Ellipsoid", infinite, tangent=rng.uniform(0, 0.5), spin=0.1 * rng.normal())
        near, limit = (contact_from_wrench(palpate.Ellipsoid(a), made.wrench, model) for a in (finite, infinite))
        assert near.status == limit.status == ContactStatus.OK
        bound = 4e-15 * limit.condition + 30 * (limit.condition / length) ** 2
        for field in FIELDS:
            np.testing.assert_allclose(getattr(near, field), getattr(limit, field), rtol=0, atol=10 * bound)


ABOVE, BELOW = np.nextafter(10.0, 11.0), np.nextafter(10.0, 9.0)
EDGES = [  # surface, size, wrench, whether nothing on the surface can explain it
    ("Cylinder", 2.0, (0, 0, 3, 0.1, 0.2, 0.3), True),  # force along the axis
    ("Cylinder", 2.0, (0, 0, 3, 0, 0, 0), True),
    ("Cylinder", 2.0, (1, 0, 3, 0.1, 0.2, 2.0), True),  # |m_z| = R |f_perp|
    ("Cylinder", 2.0, (3, 4, 3, 0.1, 0.2, -10.0), True),
    ("Cylinder", 2.0, (3, 4, 3, 0.1, 0.2, ABOVE), True),
    ("Cylinder", 2.0, (3, 4, 3, 0.1, 0.2, BELOW), False),
    ("Cylinder", 2.0, (3e-200, 4e-200, 0, 0, 0, 1e-198), True),
    ("Plane", 0.5, (1, 2, 0, 0.1, 0.2, 0.3), True),  # force in the plane
    ("Plane", 0.5, (1, 2, -0.0, 0, 0, 0), True),
    ("Ellipsoid", (INF, 1.0, INF), (1, 0, 2, 1, 1, 1), True),
    ("Ellipsoid", (1.0, INF, 2.0), (0, 1, 0, 1, 1, 1), True),
    ("Ellipsoid", (1.0, INF, 2.0), (0, 1, 1, 0, 2.0, 0), True),
    ("Sphere", 1.0, (0, 0, -1, 0, 1, 0), True),  # the axis touches the sphere
    ("Sphere", 1.0, (0, 0, -1, 0, np.nextafter(1.0, 2.0), 0), True),
    ("Sphere", 1.0, (0, 0, -1, 0, np.nextafter(1.0, 0.0), 0), False),
    ("Sphere", 1.0, (0, 0, -1, 0, 1, 5e-324), False),  # no longer discontinuous: any spin tells the side
    # where the axis misses, spins of opposite sign mean opposite sides of the finger
    *(
        ("Sphere", 1.0, (0, 0, -1, 0, 2, sign * spin), False)
        for spin in (1e-300, 1e-200, 1e-30, 1e-16)
        for sign in (1, -1)
    ),
    ("Sphere", 1.0, (0, 0, -5e-324, 0, 0, 0), False),
    ("Sphere", 1e-100, (0, 0, -1e-200, 0, 2e-300, 0), True),
    ("Sphere", 1e100, (0, -1e200, 0, 2e300, 0, 0), True),
    ("Ellipsoid", (1.0, 2.0, 4.0), (-1, 0, 0, 0, 0, 2), True),
    ("Ellipsoid", (1.0, 2.0, 4.0), (-1, 0, 0, 0, 0, np.nextafter(2.0, 0.0)), False),
]


@pytest.mark.parametrize(("surface", "size", "wrench", "missed"), EDGES)
def test_a_contact_ends_at_one_unit_of_rounding(surface, size, wrench, missed):
    """What nothing on the surface can explain is NO_CONTACT; without spin, in both models."""
    no_spin = np.dot(wrench[:3], wrench[3:]) == 0
    for model in ("soft", "hard") if no_spin and missed else ("soft",):
        case = cases.Case(surface, size, tuple(float(x) for x in wrench), model=model)
        result = measure(case, Answer.rounded(case.wanted()))
        assert result.status == result.wanted_status == ("NO_CONTACT" if missed else "OK")
        assert max(result.errors[field] / exact(field, result) for field in FIELDS) <= 1.0, result.errors
        check_numbers(contacts_from_wrenches(case.surface(), [wrench], model=model), np.array([wrench], float))


def check_numbers(found, w):
    """The promises of `Contact` about NaN: every number is finite where OK, none is elsewhere."""
    ok = found.status == ContactStatus.OK
    np.testing.assert_array_equal(found.force, w[:, :3])
    for field in FIELDS:
        values = getattr(found, field).reshape(len(w), -1)
        bad = ok & ~np.isfinite(values).all(axis=1)
        assert not bad.any(), f"{bad.sum()}: {field} not finite with status OK: {w[bad][0].tolist()}"
        assert np.isnan(values[~ok]).all(), field
    assert (found.condition[~ok] == INF).all()
    assert (found.condition[ok] > 0).all()  # below 1 at the end of a slender tip, where the centroid hardly moves
    assert (found.normal_force[ok] >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(found.normal[ok], axis=1), 1.0, atol=4e-16, rtol=0)


MOVED_TIP = palpate.Ellipsoid((0.01, 0.02, 0.015), center=(0.1, -0.2, 0.3))
TIPS = {name: getattr(palpate, kind)(size) for name, (kind, size) in cases.CENTRED.items()} | {"moved": MOVED_TIP}


@pytest.mark.parametrize("name", TIPS)
@pytest.mark.parametrize("model", ["soft", "hard"])
def test_any_bits_give_finite_numbers_or_a_status_that_means_what_it_says(name, model):
    """INVALID for every wrench that is not finite or beyond the range of floats, NO_FORCE for no force alone."""
    rng = np.random.default_rng(100 + list(TIPS).index(name))
    for w in (cases.wild(rng, 20_000 if model == "soft" else 5_000), cases.narrow(rng, 5_000)):
        found = contacts_from_wrenches(TIPS[name], w, model=model)
        check_numbers(found, w)
        finite = np.isfinite(w).all(axis=1)
        assert (found.status[~finite] == ContactStatus.INVALID).all()
        wrong = (found.status == ContactStatus.NO_FORCE) != (finite & (w[:, :3] == 0.0).all(axis=1))
        wrong &= ~((found.status == ContactStatus.INVALID) & (np.abs(w[:, 3:]).max(axis=1) > 1e200))
        assert not wrong.any(), (
            f"{wrong.sum()}: {ContactStatus(found.status[wrong][0]).name} {w[wrong][0].tolist()}"
        )
