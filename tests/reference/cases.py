"""Categories of numerically hard contacts, each a function from a random generator to a case."""

import math
from fractions import Fraction

import numpy as np

from reference.compare import INF, Case
from reference.quadric import IDENTITY, ORIGIN

Rng = np.random.Generator


def unit(rng: Rng) -> np.ndarray:
    """A uniform direction."""
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def length(v: np.ndarray) -> float:
    """Euclidean length, for any scale."""
    return math.hypot(*(float(x) for x in v))


def log(rng: Rng, low: float, high: float) -> float:
    """10 to a uniform power."""
    return float(10.0 ** rng.uniform(low, high))


def rotation(rng: Rng) -> tuple[tuple[float, ...], ...]:
    """A uniform rotation matrix, rounded."""
    Q, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(upper))
    if np.linalg.det(Q) < 0:
        Q[:, 0] = -Q[:, 0]
    return tuple(tuple(float(x) for x in row) for row in Q)


def case(kind, size, f, m, **more) -> Case:
    """A case from arrays."""
    size = tuple(float(a) for a in size) if kind == "Ellipsoid" else float(size)
    return Case(kind, size, tuple(float(x) for x in (*f, *m)), **more)


def axes_of(kind, size) -> np.ndarray:
    """Three semi-axes."""
    return np.array(Case(kind, size, (0.0,) * 6).semi_axes)


def built(rng: Rng, kind, size, *, direction=None, tangent=None, spin=None, force=1.0, along=1.0, **more) -> Case:
    """A wrench made from a contact: tangent = p_t/p_n, spin = |q|/(|f| least semi-axis); rounded."""
    a = axes_of(kind, size)
    u = unit(rng) if direction is None else direction
    finite = np.isfinite(a)
    if not finite.all():
        u = np.where(finite, u, 0.0)
        u = u / np.linalg.norm(u)
    least = float(a[finite].min())
    c = np.where(finite, np.where(finite, a, 0.0) * u, along * least * rng.normal(size=3))
    n = np.where(finite, u * (least / a), 0.0)
    n = n / np.linalg.norm(n)
    t = np.cross(n, unit(rng))
    t = t / np.linalg.norm(t)
    tangent = abs(rng.normal()) if tangent is None else tangent
    f = force * (tangent * t - n)
    spin = rng.normal() if spin is None else spin
    q = spin * (length(f) * least) * n
    center, R = more.get("center", ORIGIN), more.get("rotation", IDENTITY)
    R, o = np.array(R), np.array(center)
    if more:
        c, f, q = R @ c + o, R @ f, R @ q
    return case(kind, size, f, np.cross(c, f) + q, **more)


def radius(rng: Rng) -> float:
    """An ordinary size with all its mantissa bits."""
    return log(rng, -2, 1)


def triple(rng: Rng, low: float = -1, high: float = 1) -> tuple[float, ...]:
    """Three semi-axes."""
    return tuple(log(rng, low, high) for _ in range(3))


def sphere(rng: Rng) -> Case:
    return built(rng, "Sphere", radius(rng))


def ellipsoid(rng: Rng) -> Case:
    return built(rng, "Ellipsoid", triple(rng))


def any_wrench(rng: Rng) -> Case:
    a = triple(rng)
    return case("Ellipsoid", a, rng.normal(size=3), rng.normal(size=3) * log(rng, -1.5, 1.5))


def zero_spin(rng: Rng) -> Case:
    return built(rng, "Ellipsoid", triple(rng), spin=0.0)


def float_zero(rng: Rng) -> Case:
    """f.m is 0 in float arithmetic but not in truth."""
    while True:
        a = triple(rng)
        outside = 1.0 if rng.random() < 0.5 else log(rng, 0, 1)
        f, c = rng.normal(size=3), outside * np.array(a) * unit(rng)
        m = np.cross(c, f)
        if f[0] * m[0] + f[1] * m[1] + f[2] * m[2] == 0.0 and pitch(f, m) != 0:
            return case("Ellipsoid", a, f, m)


def pitch(f, m) -> Fraction:
    """f.m, exactly."""
    return sum((Fraction(float(x)) * Fraction(float(y)) for x, y in zip(f, m, strict=True)), Fraction(0))


def awkward(rng: Rng, reach: float) -> Case:
    """f.m is exactly 0, though its products need up to 76 bits; the axis passes at `reach` of the surface."""
    a = np.array(triple(rng))
    f = rng.integers(-(2**25), 2**25, 3)
    across = np.cross(f / a, unit(rng))  # in the space where the surface is the unit sphere
    point = a * across / np.linalg.norm(across) * reach
    v = np.round(point * 2**20).astype(np.int64)
    m = np.cross(v, f)
    assert abs(m).max() < 2**53
    assert int(f[0]) * int(m[0]) + int(f[1]) * int(m[1]) + int(f[2]) * int(m[2]) == 0
    return case("Ellipsoid", a, f * 2.0**-24, m * 2.0**-44)


def awkward_hit(rng: Rng) -> Case:
    return awkward(rng, rng.uniform(0.0, 0.999))


def awkward_graze(rng: Rng) -> Case:
    return awkward(rng, 1.0 - log(rng, -6, -3))


def awkward_miss(rng: Rng) -> Case:
    return awkward(rng, 1.0 + log(rng, -4, 0.8))


def pushed_miss(rng: Rng) -> Case:
    """The axis misses and f.m is exactly 0 because factors are."""
    a = triple(rng)
    i, j, _ = rng.permutation(3)
    f, m = np.zeros(3), np.zeros(3)
    f[i], m[j] = rng.normal(), log(rng, 0.01, 2) * max(a) ** 2 / min(a) * 10
    return case("Ellipsoid", a, f, m)


def near_axis(rng: Rng, a, offset: float, spin: float) -> Case:
    """The wrench axis at 1 + offset of the silhouette, and a torque spin |f| min(a) along f."""
    a = np.array(a)
    f = unit(rng)
    r = np.cross(f, unit(rng))
    r = a * r / np.linalg.norm(r) * (1.0 + offset)
    f = a * f / a.max()
    m = np.cross(r, f) + spin * a.min() * f
    return case("Ellipsoid", a, f, m)


def grazing(rng: Rng) -> Case:
    sign = -1.0 if rng.random() < 0.8 else 1.0
    spin = 0.0 if rng.random() < 0.5 else log(rng, -20, -8)
    return near_axis(rng, triple(rng), sign * log(rng, -18, -1), spin)


def grazing_sphere(rng: Rng) -> Case:
    r = radius(rng)
    return near_axis(rng, (r, r, r), -log(rng, -18, -1), 0.0)


def grazing_exact(rng: Rng) -> Case:
    """No spin at all, kappa to 1e9 and a little beyond: R f and m agree to 60 bits."""
    r, force = int(rng.integers(2**29, 2**30)) | 1, int(rng.integers(2**30, 2**31)) | 1
    m = float(r * force)
    while Fraction(m) >= r * force:
        m = math.nextafter(m, 0.0)
    if rng.random() < 0.5:
        m *= 1.0 - log(rng, -15, -1)
    f, q = np.zeros(3), np.zeros(3)
    i, j, _ = rng.permutation(3)
    f[i], q[j] = rng.choice((-1.0, 1.0)) * force, rng.choice((-1.0, 1.0)) * m
    return case("Ellipsoid", (r, r, r), f, q)


def grazing_extreme(rng: Rng) -> Case:
    """As `grazing_exact`, to kappa 4e14: R f exceeds m by one part in up to 2^96."""
    while True:
        r = int(rng.integers(2**52, 2**53)) | 1
        left = int(10.0 ** rng.uniform(3, 14)) | 1
        force = left * pow(r, -1, 2**53) % 2**53
        m = (r * force - left) >> 53
        if force > 2**51 and m > 2**49:
            break
    return case("Sphere", r * 2.0**-53, (0.0, 0.0, -force * 2.0**-53), (0.0, m * 2.0**-53, 0.0))


def slender(rng: Rng) -> Case:
    return built(rng, "Ellipsoid", triple(rng, -3, 6))


def slender_wrench(rng: Rng) -> Case:
    """Any wrench on a slender ellipsoid, its parts comparable in the space where that is a sphere."""
    a = np.array(triple(rng, -3, 6))
    C = a / np.prod(a)
    return case("Ellipsoid", a, a * rng.normal(size=3), rng.normal(size=3) / C * log(rng, -1, 1))


def slender_zero_spin(rng: Rng) -> Case:
    return built(rng, "Ellipsoid", triple(rng, -3, 6), spin=0.0)


def _shape(rng: Rng, disc: bool) -> np.ndarray:
    a = np.full(3, log(rng, -2, 1))
    a[:2] *= np.where(rng.random() < 0.5, 1.0, 10.0 ** rng.uniform(-0.3, 0.3, 2))
    a[2] *= log(rng, -6, -1) if disc else log(rng, 1, 6)
    return a[rng.permutation(3)]


def _disc_or_needle(rng: Rng, disc: bool, pole: bool) -> Case:
    a = _shape(rng, disc)
    odd = int(np.argmin(a) if disc else np.argmax(a))
    u = unit(rng)
    small = log(rng, -8, 0)
    scale = np.full(3, small if pole else 1.0)
    scale[odd] = 1.0 if pole else small
    u = u * scale
    tangent = log(rng, -2, 6) if rng.random() < 0.7 else 0.0
    spin = float(rng.choice((0.0, 1.0, -1.0))) * log(rng, -6, 1)
    return built(rng, "Ellipsoid", a, direction=u / np.linalg.norm(u), tangent=tangent, spin=spin)


def disc_pole(rng: Rng) -> Case:
    return _disc_or_needle(rng, True, True)


def disc_rim(rng: Rng) -> Case:
    return _disc_or_needle(rng, True, False)


def needle_pole(rng: Rng) -> Case:
    return _disc_or_needle(rng, False, True)


def needle_rim(rng: Rng) -> Case:
    return _disc_or_needle(rng, False, False)


def tangential(rng: Rng) -> Case:
    """Nearly tangential force on an ordinary ellipsoid."""
    return built(rng, "Ellipsoid", triple(rng), tangent=log(rng, 0, 8))


def spin_range(rng: Rng) -> Case:
    return built(rng, "Ellipsoid", triple(rng), spin=float(rng.choice((-1, 1))) * log(rng, -30, 2))


def _planar(rng: Rng, a, offset: float, pitch_log: tuple[float, float]) -> Case:
    """f.m is one product, so any spin is exact; the axis passes at `offset` of the silhouette."""
    a = np.array(a)
    i, j, k = rng.permutation(3)
    f, m = np.zeros(3), np.zeros(3)
    f[i], f[j] = rng.normal(size=2)
    C = 1.0 / np.array([a[1] * a[2], a[0] * a[2], a[0] * a[1]])
    m[k] = rng.choice((-1.0, 1.0)) * offset * np.hypot(f[i] / a[i], f[j] / a[j]) / C[k]
    m[i] = rng.choice((-1.0, 1.0)) * log(rng, *pitch_log) * abs(m[k])
    return case("Ellipsoid", a, f, m)


def spin_exact_hit(rng: Rng) -> Case:
    return _planar(rng, triple(rng), rng.uniform(0, 0.999), (-30, 2))


def spin_exact_graze(rng: Rng) -> Case:
    sign = float(rng.choice((-1, 1)))
    return _planar(rng, triple(rng), 1 + sign * log(rng, -16, -2), (-30, -4))


def spin_exact_miss(rng: Rng) -> Case:
    return _planar(rng, triple(rng), 1 + log(rng, -3, 3), (-300, 0))


def lattice(rng: Rng, bits: int) -> Case:
    """f.m is a small integer though its products have 2 bits digits: only an exact sum finds its sign."""
    while True:
        a, b = (int(x) for x in rng.integers(2 ** (bits - 1), 2**bits, 2))
        c = int(rng.integers(2 ** (bits - 1), 2**bits)) | 1
        if math.gcd(b, c) != 1:
            continue
        t = int(rng.choice((-1, 1))) * int(10.0 ** rng.uniform(0, 6))
        x = int(rng.integers(-(2 ** (bits - 1)), 2 ** (bits - 1)))
        y = (t - a * x) * pow(b, -1, c) % c
        z = (t - a * x - b * y) // c
        assert a * x + b * y + c * z == t
        if abs(z) < 2**53:
            break
    f, m = np.array([a, b, c]) * 2.0**-bits, np.array([x, y, z]) * 2.0**-bits
    order, signs = rng.permutation(3), rng.choice((-1.0, 1.0), 3)
    f, m = (f * signs)[order], (m * signs)[order]
    return case("Ellipsoid", np.array(triple(rng, -0.5, 0.5)) * log(rng, -2, 1), f, m)


def lattice_40(rng: Rng) -> Case:
    return lattice(rng, 40)


def lattice_52(rng: Rng) -> Case:
    return lattice(rng, 52)


def _stretched(rng: Rng, count: int, low: float, high: float) -> np.ndarray:
    a = np.array(triple(rng, -0.5, 0.5)) * log(rng, -2, 0)
    for i in rng.permutation(3)[:count]:
        a[i] *= log(rng, low, high)
    return a


def _stretched_built(rng: Rng, count: int) -> Case:
    a = _stretched(rng, count, 6, 15)
    u = unit(rng)
    if rng.random() < 0.7:  # in the middle, where it looks like a cylinder or a plane
        u = np.where(a > 1e3 * a.min(), u * a.min() / a * log(rng, -2, 2), u)
        u = u / np.linalg.norm(u)
    tangent = None if rng.random() < 0.5 else log(rng, 0, 4)
    return built(rng, "Ellipsoid", a, direction=u, tangent=tangent)


def nearly_cylinder(rng: Rng) -> Case:
    return _stretched_built(rng, 1)


def nearly_plane(rng: Rng) -> Case:
    return _stretched_built(rng, 2)


def scale(rng: Rng) -> Case:
    """Any size of force with any size of finger whose torque a float64 can hold."""
    while True:
        force, length = rng.uniform(-200, 200), rng.uniform(-100, 100)
        if abs(force + length) < 290:
            break
    a = np.array(triple(rng, -0.5, 0.5)) * 10.0**length
    return built(rng, "Ellipsoid", a, force=10.0**force)


def scale_edges(rng: Rng) -> Case:
    """The corners of the range, with hits, misses and tiny spins."""
    force, length = rng.choice([(-200, -90), (200, 90), (-200, 100), (200, -100), (-190, -100), (190, 100)])
    a = np.array(triple(rng, -0.5, 0.5)) * 10.0**length
    f, m = rng.normal(size=3) * 10.0**force, rng.normal(size=3) * 10.0**force * a.mean()
    return case("Ellipsoid", a, f, m * log(rng, -0.7, 0.7))


def large_moment(rng: Rng) -> Case:
    a = triple(rng)
    return case("Ellipsoid", a, rng.normal(size=3), rng.normal(size=3) * log(rng, 2, 150))


def small_moment(rng: Rng) -> Case:
    a = triple(rng)
    m = rng.normal(size=3) * (0.0 if rng.random() < 0.1 else log(rng, -150, -2))
    return case("Ellipsoid", a, rng.normal(size=3), m)


def cylinder(rng: Rng) -> Case:
    return built(rng, "Cylinder", radius(rng), tangent=abs(rng.normal()), spin=rng.normal())


def cylinder_zero_spin(rng: Rng) -> Case:
    return built(rng, "Cylinder", radius(rng), tangent=abs(rng.normal()), spin=0.0)


def cylinder_far(rng: Rng) -> Case:
    """Contact far along the axis."""
    return built(rng, "Cylinder", radius(rng), along=log(rng, 0, 6))


def cylinder_scale(rng: Rng) -> Case:
    return built(rng, "Cylinder", 10.0 ** rng.uniform(-100, 100), force=10.0 ** rng.uniform(-180, 180))


def cylinder_awkward(rng: Rng) -> Case:
    """f.m is exactly 0 with awkward mantissas, on a cylinder."""
    r = radius(rng)
    f = rng.integers(-(2**25), 2**25, 3)
    f[2] //= 2
    f[0] |= 2**24
    across = np.array([-f[1], f[0], 0.0]) / math.hypot(f[0], f[1])
    point = r * rng.uniform(-0.9, 0.9) * across + np.array([0.0, 0.0, r * rng.normal()])
    m = np.cross(np.round(point * 2**20).astype(np.int64), f)
    return case("Cylinder", r, f * 2.0**-24, m * 2.0**-44)


def quarter_turn(rng: Rng) -> Case:
    """A rotation that only renames axes costs nothing, not even at grazing."""
    made = grazing(rng) if rng.random() < 0.5 else slender(rng)
    R = np.eye(3)[rng.permutation(3)] * rng.choice((-1.0, 1.0), 3)
    R[:, 0] *= round(np.linalg.det(R))
    w = np.concatenate([R @ made.wrench[:3], R @ made.wrench[3:]])
    turned = tuple(tuple(float(x) for x in row) for row in R)
    return Case(made.kind, made.size, tuple(float(x) for x in w), rotation=turned)


def elliptic_cylinder(rng: Rng) -> Case:
    a = np.array(triple(rng))
    a[rng.integers(3)] = INF
    return built(rng, "Ellipsoid", a)


def slab(rng: Rng) -> Case:
    a = np.full(3, INF)
    a[rng.integers(3)] = radius(rng)
    return built(rng, "Ellipsoid", a)


def plane(rng: Rng) -> Case:
    return built(rng, "Plane", radius(rng))


def plane_scale(rng: Rng) -> Case:
    return built(rng, "Plane", 10.0 ** rng.uniform(-100, 100), force=10.0 ** rng.uniform(-180, 180))


def cylinder_tangential(rng: Rng) -> Case:
    return built(rng, "Cylinder", radius(rng), tangent=log(rng, 0, 8))


def cylinder_tangential_zero_spin(rng: Rng) -> Case:
    return built(rng, "Cylinder", radius(rng), tangent=log(rng, 0, 8), spin=0.0)


def elliptic_cylinder_tangential(rng: Rng) -> Case:
    a = np.array(triple(rng))
    a[rng.integers(3)] = INF
    return built(rng, "Ellipsoid", a, tangent=log(rng, 0, 8))


def plane_tangential(rng: Rng) -> Case:
    return built(rng, "Plane", radius(rng), tangent=log(rng, 0, 8))


def _place(rng: Rng, far: float) -> dict:
    o = rng.normal(size=3) * far
    return {"center": tuple(float(x) for x in o), "rotation": rotation(rng)}


def rotated(rng: Rng) -> Case:
    return built(rng, "Ellipsoid", triple(rng, -0.3, 0.3), tangent=rng.uniform(0, 1), rotation=rotation(rng))


def centred(rng: Rng) -> Case:
    o = tuple(float(x) for x in rng.normal(size=3))
    return built(rng, "Ellipsoid", triple(rng, -0.3, 0.3), tangent=rng.uniform(0, 1), center=o)


def moved(rng: Rng) -> Case:
    return built(rng, "Ellipsoid", triple(rng, -0.3, 0.3), tangent=rng.uniform(0, 1), **_place(rng, 1.0))


def moved_far(rng: Rng) -> Case:
    place = _place(rng, log(rng, 0, 4))
    return built(rng, "Ellipsoid", triple(rng, -0.3, 0.3), tangent=rng.uniform(0, 1), spin=0.1, **place)


def moved_sphere(rng: Rng) -> Case:
    return built(rng, "Sphere", radius(rng), tangent=rng.uniform(0, 1), **_place(rng, 0.1))


def moved_cylinder(rng: Rng) -> Case:
    return built(rng, "Cylinder", radius(rng), tangent=rng.uniform(0, 1), **_place(rng, 1.0))


def moved_plane(rng: Rng) -> Case:
    return built(rng, "Plane", radius(rng), tangent=rng.uniform(0, 1), **_place(rng, 1.0))


def rotated_grazing(rng: Rng) -> Case:
    """The wrench axis near the silhouette of a rotated, centred ellipsoid."""
    a = np.array(triple(rng, -0.3, 0.3))
    f = unit(rng)
    r = np.cross(f, unit(rng))
    r = a * r / np.linalg.norm(r) * (1.0 - log(rng, -14, -1))
    R = rotation(rng)
    f, r = np.array(R) @ (a * f), np.array(R) @ r
    return case("Ellipsoid", a, f, np.cross(r, f), rotation=R)


def _hard(made: Case) -> Case:
    return Case(made.kind, made.size, made.wrench, made.center, made.rotation, "hard")


def hard_ellipsoid(rng: Rng) -> Case:
    return _hard(built(rng, "Ellipsoid", triple(rng), tangent=rng.uniform(0, 1), spin=0.2 * rng.normal()))


def hard_any(rng: Rng) -> Case:
    return _hard(any_wrench(rng))


def hard_zero_spin(rng: Rng) -> Case:
    return _hard(awkward_hit(rng))


def hard_slender(rng: Rng) -> Case:
    return _hard(built(rng, "Ellipsoid", triple(rng, -3, 6), spin=0.01 * rng.normal()))


def hard_scale(rng: Rng) -> Case:
    return _hard(scale(rng))


def hard_cylinder(rng: Rng) -> Case:
    return _hard(cylinder(rng))


def hard_plane(rng: Rng) -> Case:
    return _hard(plane(rng))


def hard_grazing(rng: Rng) -> Case:
    return _hard(grazing(rng))


EXACT = {  # 2e-15 on every solvable case, whatever its condition
    g.__name__: g
    for g in (
        sphere, ellipsoid, any_wrench, zero_spin, float_zero, awkward_hit, awkward_graze,
        grazing, grazing_sphere, grazing_exact,
        slender, slender_wrench, slender_zero_spin, disc_pole, disc_rim, needle_pole, needle_rim, tangential,
        spin_range, spin_exact_hit, spin_exact_graze, spin_exact_miss, lattice_40, lattice_52,
        nearly_cylinder, nearly_plane, scale, scale_edges, large_moment, small_moment,
        cylinder, cylinder_zero_spin, cylinder_far, cylinder_scale, cylinder_awkward, elliptic_cylinder,
        quarter_turn,
        hard_ellipsoid, hard_any, hard_zero_spin, hard_slender, hard_scale, hard_cylinder,
    )
}  # fmt: skip
CONDITIONED = {  # 8 u times the reported condition
    g.__name__: g
    for g in (
        plane, slab, plane_scale, cylinder_tangential, cylinder_tangential_zero_spin,
        elliptic_cylinder_tangential, plane_tangential, hard_plane, hard_grazing,
    )
}  # fmt: skip
MOVED = {  # 4e-15 of the largest length around
    g.__name__: g for g in (rotated, centred, moved, moved_far, moved_sphere, moved_cylinder, moved_plane)
}
MOVED_GRAZING = {"rotated_grazing": rotated_grazing}  # 8 u kappa
EXTREME = {"grazing_extreme": grazing_extreme}
MISSES = {g.__name__: g for g in (awkward_miss, pushed_miss)}  # NO_CONTACT
ALL = EXACT | EXTREME | CONDITIONED | MOVED | MOVED_GRAZING | MISSES
