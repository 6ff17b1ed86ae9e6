"""Numerically hard contacts against 180-digit arithmetic: relative accuracy whatever the conditioning."""

import collections
import functools

import numpy as np
import pytest

import palpate
from palpate import ContactStatus, contact_from_wrench, contacts_from_wrenches
from reference import cases, quadric
from reference.compare import FIELDS, INF, Measured, measure, sample

COUNT = 100
MORE = 600  # in the long tests
U = 2.0**-53
LIMITS = {
    "centroid": 2e-15,
    "normal": 2e-15,
    "normal_force": 4e-15,
    "tangential_force": 4e-15,
    "spin_torque": 4e-15,
}


def limit_of(field, result):
    """The limit of a field: w.w is known to some u^2 |w|^2, so a vanishing g or k to (u kappa)^2 of itself."""
    from_z = field in ("normal_force", "spin_torque")
    return LIMITS[field] + (16 * (U * result.kappa) ** 2 if from_z else 0.0)


@functools.cache
def measured(name: str) -> list[Measured]:
    return [measure(case) for case in sample(name, cases.ALL[name], COUNT)]


def report(results, error, limit):
    """Fail with how many cases are beyond their limit and the worst of them, replayable."""
    beyond = [r for r in results if not error(r) <= limit(r)]
    if beyond:
        worst = max(beyond, key=lambda r: error(r) / limit(r))
        pytest.fail(
            f"{len(beyond)} of {len(results)} beyond the limit; the worst: {worst.case!r}\n"
            f"status {worst.status}, wanted {worst.wanted_status}; error {error(worst):.3e}, "
            f"limit {limit(worst):.3e}, kappa {worst.kappa:.3e}, condition {worst.condition:.3e}; "
            f"all: {worst.errors}"
        )


def no_wrong_status(results):
    """Fail with how many have another status than wanted, and the first of them."""
    wrong = [r for r in results if r.status != r.wanted_status]
    assert not wrong, (
        f"{len(wrong)} of {len(results)}: {wrong[0].case!r} is {wrong[0].status}, wanted {wrong[0].wanted_status}"
    )


@pytest.mark.parametrize("name", cases.ALL)
def test_status(name):
    """Exactly the wrenches that some contact explains have one."""
    results = measured(name)
    no_wrong_status(results)
    counts = collections.Counter(r.wanted_status for r in results)
    if name in cases.MISSES:
        assert counts == {"NO_CONTACT": COUNT}
    elif "hard" not in name:
        assert counts["OK"] >= 0.9 * COUNT
    else:
        assert counts["OK"] >= 0.5 * COUNT


def exact_to_rounding(results, field):
    """Fail if a field is off by more than a few units of rounding."""

    def error(r):
        # In turned axes f.m has the digits of double-double, not all of them.
        turned = r.case.rotation != cases.Case("Sphere", 1.0, r.case.wrench).rotation
        return r.errors["spin_torque of moment" if turned and field == "spin_torque" else field]

    report(results, error, lambda r: limit_of(field, r))


@pytest.mark.parametrize("name", cases.EXACT)
@pytest.mark.parametrize("field", FIELDS)
def test_exact_to_rounding(name, field):
    """Every field to a few units of rounding, on every single case, whatever its condition number."""
    exact_to_rounding(measured(name), field)


@pytest.mark.slow
@pytest.mark.parametrize("name", cases.ALL)
def test_more_of_them(name):
    """Status and fields of many more of each category."""
    results = [measure(case) for case in sample(name, cases.ALL[name], MORE)]
    no_wrong_status(results)
    for field in FIELDS if name in cases.EXACT else ():
        exact_to_rounding(results, field)


@pytest.mark.parametrize("field", FIELDS)
def test_grazing_far_beyond_any_use(field):
    """Up to kappa 4e14 the point stays exact."""
    report(measured("grazing_extreme"), lambda r: r.errors[field], lambda r: limit_of(field, r))


@pytest.mark.parametrize("name", cases.CONDITIONED)
def test_within_the_reported_condition(name):
    """The centroid is as good as the reported condition number promises."""
    report(measured(name), lambda r: r.errors["centroid"], lambda r: 8 * U * r.condition)


@pytest.mark.parametrize("name", cases.CONDITIONED)
@pytest.mark.parametrize("field", FIELDS[1:])
def test_forces_within_the_reported_condition(name, field):
    """The other fields too, with their own limits."""
    report(measured(name), lambda r: r.errors[field], lambda r: LIMITS[field] * max(1.0, r.condition))


@pytest.mark.slow
@pytest.mark.parametrize("name", cases.MOVED)
@pytest.mark.parametrize("field", FIELDS)
def test_moved_surfaces(name, field):
    """Rotated and centred surfaces: relative to the largest length around."""

    def limit(r):
        # The moment about the centre loses |center|/size: the normal turns by the error of c over the size.
        reach = max(1.0, float(np.linalg.norm(r.case.center)) / min(r.case.semi_axes))
        return 4e-15 * (1.0 if field == "centroid" else r.kappa * reach)

    def error(r):
        # A rounded rotation mixes spin with the rest of the moment: |f| times the lengths around.
        return r.errors["spin_torque of moment" if field == "spin_torque" else field]

    report(measured(name), error, limit)


def test_rotated_grazing():
    """A rotated surface sees a rounded wrench: its error is that rounding times kappa."""
    report(measured("rotated_grazing"), lambda r: r.errors["centroid"], lambda r: 8 * U * r.kappa)


@pytest.mark.slow
@pytest.mark.parametrize("name", [n for n in cases.ALL if n not in cases.MISSES])
def test_condition_is_a_number(name):
    """Where there is a contact its condition is a number, small only on slender tips; elsewhere infinite."""
    for r in measured(name):
        if r.status == "OK":
            assert r.condition > (min(r.case.semi_axes) / max(r.case.semi_axes)) ** 2, r.case
            assert np.isfinite(r.condition) or r.kappa > 1e300, r.case
        else:
            assert r.condition == INF, r.case


@pytest.mark.parametrize("name", ["grazing", "grazing_sphere", "grazing_exact", "sphere", "large_moment"])
def test_condition_is_kappa(name):
    """On a sphere the condition number is sqrt(2 (|m|^2 + R^2|f|^2)/|z|^2); near enough elsewhere."""
    for r in measured(name):
        if len(set(r.case.semi_axes)) == 1:
            assert r.condition == pytest.approx(np.sqrt(2.0) * r.kappa, rel=1e-6), r.case
        else:
            ratio = max(r.case.semi_axes) / min(r.case.semi_axes)
            assert r.kappa / ratio**3 <= r.condition <= r.kappa * ratio**3, r.case


@pytest.mark.slow
@pytest.mark.parametrize("stretched", [(2,), (0,), (0, 1), (1, 2)])
@pytest.mark.parametrize("model", ["soft", "hard"])
def test_long_semi_axes_go_over_into_infinite_ones(stretched, model):
    """An ellipsoid 1e9 times and more longer than wide is a cylinder (a disc, two planes) to rounding."""
    rng = np.random.default_rng(11)
    for length in (1e9, 1e12, 1e15, 1e30, 1e50, 1e59):
        for _ in range(20):
            a = 10.0 ** rng.uniform(-0.3, 0.3, 3)
            finite, infinite = a.copy(), a.copy()
            finite[list(stretched)] = length
            infinite[list(stretched)] = np.inf
            made = cases.built(rng, "Ellipsoid", infinite, tangent=rng.uniform(0, 0.5), spin=0.1 * rng.normal())
            near = contact_from_wrench(palpate.Ellipsoid(finite), made.wrench, model=model)
            limit = contact_from_wrench(palpate.Ellipsoid(infinite), made.wrench, model=model)
            assert near.status == limit.status == ContactStatus.OK
            bound = 4e-15 * limit.condition + 30 * (limit.condition / length) ** 2
            for field in ("centroid", "normal", "normal_force", "tangential_force", "spin_torque"):
                np.testing.assert_allclose(
                    getattr(near, field),
                    getattr(limit, field),
                    rtol=0,
                    atol=10 * bound,
                    err_msg=f"{field} {length}",
                )


@pytest.mark.parametrize(
    ("surface", "size", "wrench"),
    [
        ("Cylinder", 2.0, (0, 0, 3, 0.1, 0.2, 0.3)),  # force along the axis
        ("Cylinder", 2.0, (0, 0, 3, 0, 0, 0)),
        ("Cylinder", 2.0, (1, 0, 3, 0.1, 0.2, 2.0)),  # |m_z| = R |f_perp|
        ("Cylinder", 2.0, (3, 4, 3, 0.1, 0.2, -10.0)),
        ("Cylinder", 2.0, (3, 4, 3, 0.1, 0.2, np.nextafter(10.0, 11.0))),
        ("Cylinder", 2.0, (3e-200, 4e-200, 0, 0, 0, 1e-198)),
        ("Plane", 0.5, (1, 2, 0, 0.1, 0.2, 0.3)),  # force in the plane
        ("Plane", 0.5, (1, 2, -0.0, 0, 0, 0)),
        ("Ellipsoid", (INF, 1.0, INF), (1, 0, 2, 1, 1, 1)),
        ("Ellipsoid", (1.0, INF, 2.0), (0, 1, 0, 1, 1, 1)),
        ("Ellipsoid", (1.0, INF, 2.0), (0, 1, 1, 0, 2.0, 0)),
        ("Sphere", 1.0, (0, 0, -1, 0, 1, 0)),  # the axis touches the sphere
        ("Sphere", 1.0, (0, 0, -1, 0, np.nextafter(1.0, 2.0), 0)),
        ("Sphere", 1e-100, (0, 0, -1e-200, 0, 2e-300, 0)),
        ("Sphere", 1e100, (0, -1e200, 0, 2e300, 0, 0)),
        ("Ellipsoid", (1.0, 2.0, 4.0), (-1, 0, 0, 0, 0, 2)),
    ],
)
def test_no_contact(surface, size, wrench):
    """Wrenches that nothing on the surface can explain are NO_CONTACT; without spin, in both models."""
    no_spin = np.dot(wrench[:3], wrench[3:]) == 0
    for model in ("soft", "hard") if no_spin else ("soft",):
        case = cases.Case(surface, size, tuple(float(x) for x in wrench), model=model)
        assert case.wanted().status == "NO_CONTACT"
        got = case.got()
        assert got.status == ContactStatus.NO_CONTACT
        check_numbers(contacts_from_wrenches(case.surface(), [wrench], model=model), [wrench])


@pytest.mark.parametrize(
    ("surface", "size", "wrench"),
    [
        ("Cylinder", 2.0, (3, 4, 3, 0.1, 0.2, np.nextafter(10.0, 9.0))),
        ("Sphere", 1.0, (0, 0, -1, 0, np.nextafter(1.0, 0.0), 0)),
        ("Sphere", 1.0, (0, 0, -1, 0, 1, 5e-324)),  # no longer discontinuous: any spin tells the side
        ("Sphere", 1.0, (0, 0, -1, 0, 2, 1e-300)),
        ("Sphere", 1.0, (0, 0, -1, 0, 2, -1e-300)),
        ("Sphere", 1.0, (0, 0, -5e-324, 0, 0, 0)),
        ("Ellipsoid", (1.0, 2.0, 4.0), (-1, 0, 0, 0, 0, np.nextafter(2.0, 0.0))),
    ],
)
def test_just_a_contact(surface, size, wrench):
    """One unit of rounding inside the limit there is a contact, and it is the right one."""
    result = measure(cases.Case(surface, size, tuple(float(x) for x in wrench)))
    assert result.status == result.wanted_status == "OK"
    assert result.errors["centroid"] <= 2e-15
    assert result.errors["normal"] <= 2e-15


def test_sign_of_a_tiny_spin_chooses_the_side():
    """Where the axis misses, spins of opposite sign mean opposite sides of the finger: f.n < 0 on both."""
    for spin in (1e-300, 1e-200, 1e-30, 1e-16):
        plus = contact_from_wrench(palpate.Sphere(1.0), (0, 0, -1, 0, 2, spin))
        minus = contact_from_wrench(palpate.Sphere(1.0), (0, 0, -1, 0, 2, -spin))
        for got, side in ((plus, 1.0), (minus, -1.0)):
            assert got.normal_force > 0
            assert got.centroid[1] == pytest.approx(side * 0.75**0.5, rel=4e-15)
            assert got.spin_torque == pytest.approx(side * 3.0**0.5, rel=4e-15)


# ---- any bits at all ----

FUZZED = [
    ("Sphere", 1.0, {}),
    ("Sphere", 1e-100, {}),
    ("Ellipsoid", (1e-3, 1.0, 1e6), {}),
    ("Ellipsoid", (0.01, 0.02, 0.015), {"center": (0.1, -0.2, 0.3)}),
    ("Ellipsoid", (1.0, 2.0, INF), {}),
    ("Ellipsoid", (INF, 0.3, INF), {}),
    ("Cylinder", 0.01, {}),
    ("Plane", 2.0, {}),
    ("Ellipsoid", (1.0, 1e15, 1e15), {}),
    ("Ellipsoid", (1e29, 1e-29, 1.0), {}),
]
SPECIAL = np.array(
    [0.0, -0.0, 5e-324, -5e-324, 2.3e-308, 1.0, -1.0, 1e-160, 1e160, 1.7976931348623157e308, -1e308]
)


def wild(rng, count, finite=False):
    """Wrenches with any exponents, zeros of both signs, denormals, a few NaN and infinities."""
    kind = rng.integers(0, 4, count)
    w = rng.normal(size=(count, 6)) * 10.0 ** rng.uniform(-323, 307, (count, 6))
    same = rng.normal(size=(count, 6)) * 10.0 ** rng.uniform(-323, 307, (count, 1))
    near = rng.normal(size=(count, 6)) * 10.0 ** rng.uniform(-20, 20, (count, 6))
    w = np.where((kind == 1)[:, None], same, w)
    w = np.where((kind == 2)[:, None], near, w)
    w = np.where(rng.random((count, 6)) < 0.25, rng.choice(SPECIAL, (count, 6)), w)
    if not finite:
        odd = rng.choice([np.nan, np.inf, -np.inf], (count, 6))
        w = np.where(rng.random((count, 6)) < 0.005, odd, w)
    return w


def narrow(rng, count):
    """Any common scale and any bits, the parts within 120 powers of ten of each other; many exact zeros."""
    w = rng.normal(size=(count, 6)) * 10.0 ** rng.uniform(-60, 60, (count, 6))
    w = np.where(rng.random((count, 6)) < 0.25, 0.0, w)
    return w * 10.0 ** rng.uniform(-150, 150, (count, 1))


def check_numbers(found, wrenches):
    """The promises of `Contact` about NaN: every number is finite where OK, none is elsewhere."""
    w = np.asarray(wrenches, dtype=float)
    ok = found.status == ContactStatus.OK
    np.testing.assert_array_equal(found.force, w[:, :3])
    for field in FIELDS:
        values = getattr(found, field).reshape(len(w), -1)
        bad = ok & ~np.isfinite(values).all(axis=1)
        assert not bad.any(), f"{bad.sum()}: {field} not finite with status OK: {w[bad][0].tolist()}"
        assert np.isnan(values[~ok]).all(), field
    assert (found.condition[~ok] == INF).all()
    low = ok & ~(found.condition > 0)  # below 1 at the end of a slender tip, where the centroid hardly moves
    assert not low.any(), f"{low.sum()}: condition {found.condition[low][0]} of {w[low][0].tolist()}"
    assert (found.normal_force[ok] >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(found.normal[ok], axis=1), 1.0, atol=4e-16, rtol=0)


def check_statuses(found, wrenches):
    """INVALID and NO_FORCE mean what they say (INVALID may also cover a contact beyond float64)."""
    w = np.asarray(wrenches, dtype=float)
    finite = np.isfinite(w).all(axis=1)
    assert (found.status[~finite] == ContactStatus.INVALID).all()
    wrong = (found.status == ContactStatus.NO_FORCE) != (finite & (w[:, :3] == 0.0).all(axis=1))
    assert not wrong.any(), f"{wrong.sum()}: {ContactStatus(found.status[wrong][0]).name} {w[wrong][0].tolist()}"


every_fuzzed = pytest.mark.parametrize("index", range(len(FUZZED)))
centred_fuzzed = pytest.mark.parametrize("index", [i for i in range(len(FUZZED)) if not FUZZED[i][2]])


def fuzzed(index, wrenches, model):
    kind, size, more = FUZZED[index]
    return contacts_from_wrenches(getattr(palpate, kind)(size, **more), wrenches, model=model)


@every_fuzzed
@pytest.mark.parametrize("model", ["soft", "hard"])
def test_fuzz_never_a_silent_nan(index, model):
    """2e5 wrenches of arbitrary bits: OK means finite, and nothing else is."""
    w = wild(np.random.default_rng(100 + index), 20_000 if model == "soft" else 5_000)
    check_numbers(fuzzed(index, w, model), w)


@every_fuzzed
@pytest.mark.parametrize("model", ["soft", "hard"])
def test_fuzz_statuses(index, model):
    """NO_FORCE only for a force of exactly zero, INVALID for every wrench that is not finite."""
    w = wild(np.random.default_rng(300 + index), 5_000)
    check_statuses(fuzzed(index, w, model), w)


@every_fuzzed
@pytest.mark.parametrize("model", ["soft", "hard"])
def test_fuzz_of_limited_range(index, model):
    """The same for wrenches whose parts lie within 120 powers of ten of each other, at any scale."""
    w = narrow(np.random.default_rng(400 + index), 5_000)
    found = fuzzed(index, w, model)
    check_numbers(found, w)
    check_statuses(found, w)


def fits_a_float(wanted):
    """Whether every field of the contact is well inside the range of float64."""
    if wanted.status != quadric.OK:
        return True
    scalars = (wanted.normal_force, wanted.spin_torque, wanted.kappa)
    return max(abs(x) for x in (*wanted.centroid, *wanted.tangential_force, *scalars)) < 1e307


def solvable(case):
    """Whether the force that the surface can take up is more than 1e-150 of the wrench (see the solver)."""
    size = min(case.semi_axes)
    press = max(abs(f) * (size / a) for f, a in zip(case.wrench[:3], case.semi_axes, strict=True))
    with np.errstate(over="ignore"):
        whole = max(np.abs(case.wrench[:3]).max(), np.abs(case.wrench[3:]).max() / size)
    return not any(case.wrench[:3]) or press > 1e-150 * whole


def against_the_reference(index, wrenches):
    """Status and centroid of arbitrary wrenches, where a float64 can hold the contact."""
    kind, size, _ = FUZZED[index]
    fuzz = [cases.Case(kind, size, tuple(w)) for w in wrenches.tolist()]
    solved = [(case, case.wanted()) for case in fuzz]
    results = [measure(case, wanted) for case, wanted in solved if fits_a_float(wanted)]
    # beyond the range of the solver it may say so, but not be wrong
    results = [r for r in results if solvable(r.case) or r.status != "INVALID"]
    assert len(results) > 20
    axes = results[0].case.semi_axes

    def limit(r):
        if INF in axes:
            return 8 * U * r.condition
        # what double-double leaves of a grazing contact, (u kappa)^2, is stretched with the surface
        stretch = max(axes) / min(axes) - 1.0
        return 2e-15 + (16 * stretch * (U * r.kappa) ** 2 if stretch else 0.0)

    report(results, lambda r: r.errors["centroid"], limit)


@pytest.mark.slow
@centred_fuzzed
def test_fuzz_of_limited_range_against_the_reference(index):
    """Any scale, any bits, parts within 120 powers of ten of each other: the status and the centroid."""
    against_the_reference(index, narrow(np.random.default_rng(500 + index), 300))


@centred_fuzzed
def test_fuzz_against_the_reference(index):
    """Arbitrary finite bits: the status and the centroid."""
    against_the_reference(index, wild(np.random.default_rng(200 + index), 400, finite=True))
