"""The paper: its Table 1, its formulas, and each erratum (the printed form is wrong, the other one right)."""

import math

import numpy as np
import pytest

from palpate import Cylinder, Ellipsoid, Plane, Sphere, contact_from_wrench
from palpate.sensing.uncertainty import wrench_axis_error
from reference import quadric

TABLE_RADIUS = 10.0  # inferred; the paper does not state it
TABLE = {  # (h, delta): c as printed, c in full precision, c_w as printed
    (0.1, 0.125): (0.000, 0.000013, 0.005),
    (0.1, 0.25): (0.000, 0.000103, 0.010),
    (0.1, 0.5): (0.000, 0.000846, 0.020),
    (0.7, 0.125): (0.000, 0.000622, 0.164),
    (0.7, 0.25): (0.005, 0.004965, 0.329),
    (0.7, 0.5): (0.039, 0.039564, 0.658),
    (1.0, 0.125): (0.001, 0.001265, 0.250),
    (1.0, 0.25): (0.010, 0.010007, 0.500),
    (1.0, 0.5): (0.077, 0.077081, 1.000),
}


def table_wrench(h, delta):
    """The wrench of four forces on the top of the sphere of metric 5."""
    flat = delta * np.array([(0, 8), (1, 0), (0, -8), (-1, 0)])
    points = np.column_stack([flat, np.sqrt(TABLE_RADIUS**2 - (flat**2).sum(axis=1))])
    forces = np.array([(x, h, -1.0) for x in (-h, -h, h, h)])
    return np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])


@pytest.mark.parametrize(("h", "delta"), TABLE)
def test_table_1(h, delta):
    """Both points of all nine entries; with much friction c_w leaves the rhombus of contacts, c does not."""
    printed_c, full_c, printed_w = TABLE[h, delta]
    wrench = table_wrench(h, delta)
    soft, hard = (contact_from_wrench(Sphere(TABLE_RADIUS), wrench, model).centroid for model in ("soft", "hard"))
    assert round(float(hard[0]), 3) == printed_w
    assert hard[0] == pytest.approx(4 * delta * h * h / (1 + h * h), abs=1e-14)  # whatever the radius
    assert abs(soft[0] - printed_c) < 0.001
    assert abs(soft[0] - full_c) <= 0.5000001e-6
    wanted = quadric.solve((TABLE_RADIUS,) * 3, wrench)
    assert float(quadric.distance(soft, wanted.centroid)) < 2e-15 * TABLE_RADIUS
    inside = [abs(c[0]) / delta + abs(c[1]) / (8 * delta) <= 1.0 for c in (soft, hard)]
    assert inside == [True, h < 0.7]


def random_contacts(count, axes, seed=0, friction=1.0, spin=0.3):
    """Contacts built from the definition: c, n, f, q and the wrench f, c x f + q."""
    rng = np.random.default_rng(seed)
    a = np.asarray(axes, dtype=float)
    finite = np.isfinite(a)
    for _ in range(count):
        u = np.where(finite, rng.normal(size=3), 0.0)
        u /= np.linalg.norm(u)
        c = np.where(finite, np.where(finite, a, 0.0) * u, rng.normal(size=3))
        n = np.where(finite, u / a, 0.0)
        n /= np.linalg.norm(n)
        t = np.cross(n, rng.normal(size=3))
        t /= np.linalg.norm(t)
        f = rng.uniform(0.5, 3) * (rng.uniform(0.1, friction) * t - n)
        q = rng.choice([-1, 1]) * rng.uniform(0.05, spin) * np.linalg.norm(f) * a[finite].min() * n
        yield c, n, f, q, np.concatenate([f, np.cross(c, f) + q])


def gives(surface, wrench, *, centroid, spin=None, atol=1e-11, model="soft"):
    """The library finds this centroid and spin torque."""
    got = contact_from_wrench(surface, wrench, model)
    np.testing.assert_allclose(got.centroid, centroid, atol=atol)
    assert spin is None or got.spin_torque == pytest.approx(spin, abs=atol)


def sigma_root(A, R, f, m):
    """The root over K of equation 18, without its prefactor."""
    D = np.linalg.det(A)
    sigma = D**2 * np.sum((m / np.diag(A)) ** 2) - R**2 * np.sum((A @ f) ** 2)
    return math.sqrt(sigma + math.sqrt(sigma**2 + 4 * D**2 * R**2 * (f @ m) ** 2))


def equation_16(A, K, f, m):
    D, A2 = np.linalg.det(A), A @ A
    det = K * (K**2 * D**2 + np.sum((A @ f) ** 2))
    return (K**2 * D**2 * np.linalg.inv(A2) @ m + K * np.cross(A2 @ f, m) + (f @ m) * f) / det


def test_equations_16_and_18_are_right():
    """For spin of ordinary size, as printed, on an ellipsoid with semi-axes R alpha, R beta, R gamma."""
    alpha, R = np.array([2.0, 1.0, 1.5]), 0.7
    A = np.diag(1 / alpha)
    for c, n, f, q, w in random_contacts(50, R * alpha):
        m = w[3:]
        K = -np.sign(f @ m) / (math.sqrt(2) * R * np.linalg.det(A)) * sigma_root(A, R, f, m)
        printed = equation_16(A, K, f, m)
        np.testing.assert_allclose([printed, K * A @ A @ printed], [c, q], atol=1e-12)
        gives(Ellipsoid(R * alpha), w, centroid=printed, spin=K * (A @ A @ printed) @ n, atol=1e-12)


def test_erratum_sphere_prefactor():
    """K carries 1/(sqrt(2) R), not 1/sqrt(2 R): with the printed one the point is off the sphere."""
    R, A = 3.0, np.eye(3)
    for c, _, f, _, w in random_contacts(20, (R, R, R)):
        root = -np.sign(f @ w[3:]) * sigma_root(A, R, f, w[3:])
        right, printed = (equation_16(A, root / by, f, w[3:]) for by in (math.sqrt(2) * R, math.sqrt(2 * R)))
        np.testing.assert_allclose(right, c, atol=1e-11)
        assert abs(np.linalg.norm(printed) - R) > 1e-3
        gives(Sphere(R), w, centroid=c)


@pytest.mark.parametrize("model", ["soft", "hard"])
def test_erratum_sphere_without_spin_takes_the_minus_root(model):
    """Of the two printed roots the plus one pulls on the finger."""
    R = 2.0
    for c, _, f, _, _ in random_contacts(20, (R, R, R)):
        m = np.cross(c, f)
        r0 = np.cross(f, m) / (f @ f)
        lam = math.sqrt(R**2 - np.sum(np.cross(f, m) ** 2) / (f @ f) ** 2) / np.linalg.norm(f)
        minus, plus = r0 - lam * f, r0 + lam * f
        assert f @ minus < 0 < f @ plus
        np.testing.assert_allclose(minus, c, atol=1e-12)
        gives(Sphere(R), np.concatenate([f, m]), centroid=minus, atol=1e-12, model=model)


def test_erratum_plane():
    """c = (f'' x m - R|f''| f)/|f''|^2: the printed + is the other plane. K = -f.m/(R|f''|), not f.n."""
    R = 0.4
    for c, n, f, q, w in random_contacts(20, (math.inf, math.inf, R)):
        m, f2, size = w[3:], np.array([0, 0, f[2]]), abs(f[2])
        right, printed = ((np.cross(f2, m) + sign * R * size * f) / size**2 for sign in (-1, 1))
        np.testing.assert_allclose(right, c, atol=1e-11)
        assert printed[2] == pytest.approx(-c[2])
        assert f[2] * printed[2] > 0 > f[2] * right[2]
        np.testing.assert_allclose(-(f @ m) / (R * size) * np.array([0, 0, c[2]]), q, atol=1e-11)
        assert abs(-(f @ n) / (R * size) * c[2] - q[2]) > 1e-3
        gives(Plane(R), w, centroid=right, spin=q @ n)


def test_cylinder_as_printed():
    """K = -f.m / sqrt(R^2|f_perp|^2 - |m''|^2) and the centroid on the cylinder of radius R (A = I there)."""
    R = 0.6
    for c, n, f, q, w in random_contacts(20, (R, R, math.inf)):
        m, fp, m2 = w[3:], f * [1, 1, 0], w[3:] * [0, 0, 1]
        K = -(f @ m) / math.sqrt(R**2 * (fp @ fp) - m2 @ m2)
        printed = (K**2 * m2 + K * np.cross(fp, m) + (f @ m) * f) / (K * (fp @ fp))
        np.testing.assert_allclose(printed, c, atol=1e-10)
        gives(Cylinder(R), w, centroid=printed, spin=q @ n, atol=1e-11)


def test_erratum_moments_of_section_2():
    """q_ux = sum h_z y, q_uy = -sum h_z x, q_uz = sum (h_y x - h_x y): tractions on the plane z = 0."""
    rng = np.random.default_rng(3)
    r = np.column_stack([rng.normal(size=(30, 2)), np.zeros(30)])
    h = rng.normal(size=(30, 3))
    moment = np.cross(r, h).sum(axis=0)
    (x, y, z), (hx, hy, hz) = r.T, h.T
    right = [(hz * y).sum(), -(hz * x).sum(), (hy * x - hx * y).sum()]
    np.testing.assert_allclose(right, moment, atol=1e-12)
    printed = [(hz * y).sum(), -(hz * z).sum(), (hy * z - hz * y).sum()]
    assert abs(printed[1] - moment[1]) > 0.1
    assert abs(printed[2] - moment[2]) > 0.1


def test_erratum_equation_13():
    """m = K A^2 c + c x f with the centroid c, not with any other point r of the wrench axis."""
    a = np.array([2.0, 1.0, 1.5])
    for _, n, f, _, w in random_contacts(20, a):
        m, got = w[3:], contact_from_wrench(Ellipsoid(a), w)
        c = got.centroid
        K = got.spin_torque / np.linalg.norm(c / a**2)
        np.testing.assert_allclose(K * c / a**2 + np.cross(c, f), m, atol=1e-12)
        r = np.cross(f, m) / (f @ f)
        assert np.abs(K * r / a**2 + np.cross(c, f) - m).max() > 1e-4
        assert n @ f < 0


def test_equations_1_and_2_and_the_signs_of_the_result():
    """f = p and m = q + c x p; n points outward, so a push has f.n < 0 and normal_force = -f.n > 0."""
    got = contact_from_wrench(Sphere(2.0), [0.5, 0.0, -3.0, 0.0, 1.0, 0.25])
    found = [got.centroid, got.normal, got.tangential_force]
    np.testing.assert_allclose(found, [[0, 0, 2], [0, 0, 1], [0.5, 0, 0]], atol=1e-15)
    assert (got.normal_force, got.spin_torque) == pytest.approx((3.0, 0.25))


@pytest.mark.parametrize("axes", [(1.0, 1.0, 1.0), (2.0, 1.0, 0.6), (0.02, 0.02, 0.05)])
def test_equation_10_is_an_equality(axes):
    """|e_t| = |q||p_t|/|p|^2 exactly, e_t the part of e = c_w - c along c_y = n x p; |e| is longer."""
    longer = []
    for c, n, f, q, w in random_contacts(300, axes, friction=1.5, spin=0.9):
        soft, hard = (contact_from_wrench(Ellipsoid(axes), w, model) for model in ("soft", "hard"))
        if hard.status != 0 or hard.condition > 1e3:
            continue
        np.testing.assert_allclose(soft.centroid, c, atol=1e-11 * max(axes))
        e, along_force = hard.centroid - soft.centroid, f / np.linalg.norm(f)
        wanted = np.linalg.norm(q) * np.linalg.norm(f - (f @ n) * n) / (f @ f)
        y = np.cross(n, f)
        across = e - (e @ along_force) * along_force  # e = e_t + e_p, e_p parallel to p
        parts = [abs(e @ y) / np.linalg.norm(y), np.linalg.norm(across), wrench_axis_error(soft)]
        np.testing.assert_allclose(parts, wanted, rtol=1e-9)
        longer.append(np.linalg.norm(e) / wanted)
    assert len(longer) > 100
    assert min(longer) >= 1 - 1e-9
    if len(set(axes)) == 1:
        assert 1.2 < max(longer) < math.sqrt(2)  # on a sphere: 1 + tan^2 of half the angle at grazing
    if axes == (2.0, 1.0, 0.6):
        assert max(longer) > 1.5


def test_equation_10_without_spin_or_friction_or_contact():
    for wrench in ([0.5, 0, -2, 0, 0.005, 0], [0, 0, -2, 0, 0, 0.003]):  # without spin; without friction
        assert wrench_axis_error(contact_from_wrench(Sphere(0.01), wrench)) == pytest.approx(0.0, abs=1e-17)
    assert math.isnan(wrench_axis_error(contact_from_wrench(Sphere(0.01), np.zeros(6))))


def test_equation_8_hard_model():
    """The hard model's torque is along the force, q_w = (f.m/|f|^2) f; with f at c_w it balances m."""
    for _, _, f, _, w in random_contacts(50, (1.0, 2.0, 1.5), friction=0.6):
        m = w[3:]
        got = contact_from_wrench(Ellipsoid((1.0, 2.0, 1.5)), w, model="hard")
        q_w = (f @ m) / (f @ f) * f
        np.testing.assert_allclose(np.cross(got.centroid, f) + q_w, m, atol=1e-12)
        assert got.spin_torque == pytest.approx(q_w @ got.normal, abs=1e-12)
        assert got.normal_force == pytest.approx(-f @ got.normal)
