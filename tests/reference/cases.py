"""Categories of numerically hard contacts: tables of functions from a random generator to a case."""

import functools
import math
import zlib
from collections.abc import Callable
from fractions import Fraction

import numpy as np

from reference.compare import INF, Case
from reference.quadric import IDENTITY, ORIGIN

Rng = np.random.Generator
Maker = Callable[[Rng], Case]


def unit(rng: Rng) -> np.ndarray:
    """Return a uniform direction."""
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


def log(rng: Rng, low: float, high: float) -> float:
    """Return 10 to a uniform power."""
    return float(10.0 ** rng.uniform(low, high))


def radius(rng: Rng) -> float:
    """Return an ordinary size with all its mantissa bits."""
    return log(rng, -2, 1)


def triple(rng: Rng, low: float = -1, high: float = 1) -> tuple[float, ...]:
    """Return three semi-axes."""
    return tuple(log(rng, low, high) for _ in range(3))


def endless(rng: Rng) -> np.ndarray:
    """Return semi-axes of an elliptic cylinder along any axis."""
    a = np.array(triple(rng))
    a[rng.integers(3)] = INF
    return a


def slab(rng: Rng) -> np.ndarray:
    """Return semi-axes of a pair of planes across any axis."""
    a = np.full(3, INF)
    a[rng.integers(3)] = radius(rng)
    return a


def sign(rng: Rng) -> float:
    """Return 1 or -1."""
    return float(rng.choice((-1, 1)))


def rotation(rng: Rng) -> tuple[tuple[float, ...], ...]:
    """Return a uniform rotation matrix, rounded."""
    Q, upper = np.linalg.qr(rng.normal(size=(3, 3)))
    Q = Q * np.sign(np.diag(upper))
    if np.linalg.det(Q) < 0:
        Q[:, 0] = -Q[:, 0]
    return tuple(map(tuple, Q.tolist()))


def place(rng: Rng, far: float) -> dict:
    """Return a centre at about `far` and a rotation."""
    o = rng.normal(size=3) * far
    return {"center": tuple(o.tolist()), "rotation": rotation(rng)}


def case(kind, size, f, m, **more) -> Case:
    """Return a case from arrays."""
    size = tuple(float(a) for a in size) if kind == "Ellipsoid" else float(size)
    return Case(kind, size, tuple(float(x) for x in (*f, *m)), **more)


def built(rng: Rng, kind, size, *, direction=None, tangent=None, spin=None, force=1.0, along=1.0, **more) -> Case:
    """Return a wrench made from a contact: tangent = p_t/p_n, spin = |q|/(|f| least semi-axis); rounded."""
    a = np.array(Case(kind, size, (0.0,) * 6).semi_axes)
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
    q = spin * (math.hypot(*f) * least) * n
    if more:
        R, o = np.array(more.get("rotation", IDENTITY)), np.array(more.get("center", ORIGIN))
        c, f, q = R @ c + o, R @ f, R @ q
    return case(kind, size, f, np.cross(c, f) + q, **more)


def any_wrench(rng: Rng, low: float = -1.5, high: float = 1.5) -> Case:
    a = triple(rng)
    return case("Ellipsoid", a, rng.normal(size=3), rng.normal(size=3) * log(rng, low, high))


def float_zero(rng: Rng) -> Case:
    """f.m is 0 in float arithmetic but not in truth."""
    while True:
        a = triple(rng)
        outside = 1.0 if rng.random() < 0.5 else log(rng, 0, 1)
        f, c = rng.normal(size=3), outside * np.array(a) * unit(rng)
        m = np.cross(c, f)
        exact = sum(Fraction(float(x)) * Fraction(float(y)) for x, y in zip(f, m, strict=True))
        if f[0] * m[0] + f[1] * m[1] + f[2] * m[2] == 0.0 and exact != 0:
            return case("Ellipsoid", a, f, m)


def awkward(rng: Rng, reach: Callable[[Rng], float]) -> Case:
    """f.m is exactly 0, though its products need up to 76 bits; the axis passes at `reach` of the surface."""
    away = reach(rng)
    a = np.array(triple(rng))
    f = rng.integers(-(2**25), 2**25, 3)
    across = np.cross(f / a, unit(rng))  # in the space where the surface is the unit sphere
    point = a * across / np.linalg.norm(across) * away
    m = np.cross(np.round(point * 2**20).astype(np.int64), f)
    assert abs(m).max() < 2**53
    return case("Ellipsoid", a, f * 2.0**-24, m * 2.0**-44)


def awkward_hit(rng: Rng) -> Case:
    return awkward(rng, lambda rng: rng.uniform(0.0, 0.999))


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


def pushed_miss(rng: Rng) -> Case:
    """The axis misses and f.m is exactly 0 because factors are."""
    a = triple(rng)
    i, j, _ = rng.permutation(3)
    f, m = np.zeros((2, 3))
    f[i], m[j] = rng.normal(), log(rng, 0.01, 2) * max(a) ** 2 / min(a) * 10
    return case("Ellipsoid", a, f, m)


def near_axis(rng: Rng, a, offset: float, spin: float) -> Case:
    """The wrench axis at 1 + offset of the silhouette, and a torque spin |f| min(a) along f."""
    a = np.array(a)
    f = unit(rng)
    r = np.cross(f, unit(rng))
    r = a * r / np.linalg.norm(r) * (1.0 + offset)
    f = a * f / a.max()
    return case("Ellipsoid", a, f, np.cross(r, f) + spin * a.min() * f)


def grazing(rng: Rng) -> Case:
    side = -1.0 if rng.random() < 0.8 else 1.0
    spin = 0.0 if rng.random() < 0.5 else log(rng, -20, -8)
    return near_axis(rng, triple(rng), side * log(rng, -18, -1), spin)


def grazing_exact(rng: Rng) -> Case:
    """No spin at all, kappa to 1e9 and a little beyond: R f and m agree to 60 bits."""
    r, force = int(rng.integers(2**29, 2**30)) | 1, int(rng.integers(2**30, 2**31)) | 1
    m = float(r * force)
    while Fraction(m) >= r * force:
        m = math.nextafter(m, 0.0)
    if rng.random() < 0.5:
        m *= 1.0 - log(rng, -15, -1)
    f, q = np.zeros((2, 3))
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
            return case("Sphere", r * 2.0**-53, (0.0, 0.0, -force * 2.0**-53), (0.0, m * 2.0**-53, 0.0))


def grazing_rotated(rng: Rng) -> Case:
    """The wrench axis near the silhouette of a rotated, centred ellipsoid."""
    a = np.array(triple(rng, -0.3, 0.3))
    f = unit(rng)
    r = np.cross(f, unit(rng))
    r = a * r / np.linalg.norm(r) * (1.0 - log(rng, -14, -1))
    R = rotation(rng)
    f, r = np.array(R) @ (a * f), np.array(R) @ r
    return case("Ellipsoid", a, f, np.cross(r, f), rotation=R)


def slender_wrench(rng: Rng) -> Case:
    """Any wrench on a slender ellipsoid, its parts comparable in the space where that is a sphere."""
    a = np.array(triple(rng, -3, 6))
    C = a / np.prod(a)
    return case("Ellipsoid", a, a * rng.normal(size=3), rng.normal(size=3) / C * log(rng, -1, 1))


def disc_or_needle(rng: Rng, disc: bool, pole: bool) -> Case:
    a = np.full(3, log(rng, -2, 1))
    a[:2] *= np.where(rng.random() < 0.5, 1.0, 10.0 ** rng.uniform(-0.3, 0.3, 2))
    a[2] *= log(rng, -6, -1) if disc else log(rng, 1, 6)
    a = a[rng.permutation(3)]
    odd = int(np.argmin(a) if disc else np.argmax(a))
    u = unit(rng)
    small = log(rng, -8, 0)
    scale = np.full(3, small if pole else 1.0)
    scale[odd] = 1.0 if pole else small
    u = u * scale
    tangent = log(rng, -2, 6) if rng.random() < 0.7 else 0.0
    spin = float(rng.choice((0.0, 1.0, -1.0))) * log(rng, -6, 1)
    return built(rng, "Ellipsoid", a, direction=u / np.linalg.norm(u), tangent=tangent, spin=spin)


def planar(rng: Rng, offset: Callable[[Rng], float], pitch_log: tuple[float, float]) -> Case:
    """f.m is one product, so any spin is exact; the axis passes at `offset` of the silhouette."""
    a, away = np.array(triple(rng)), offset(rng)
    i, j, k = rng.permutation(3)
    f, m = np.zeros((2, 3))
    f[i], f[j] = rng.normal(size=2)
    C = 1.0 / np.array([a[1] * a[2], a[0] * a[2], a[0] * a[1]])
    m[k] = rng.choice((-1.0, 1.0)) * away * np.hypot(f[i] / a[i], f[j] / a[j]) / C[k]
    m[i] = rng.choice((-1.0, 1.0)) * log(rng, *pitch_log) * abs(m[k])
    return case("Ellipsoid", a, f, m)


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
        if abs(z) < 2**53:
            break
    f, m = np.array([a, b, c]) * 2.0**-bits, np.array([x, y, z]) * 2.0**-bits
    order, signs = rng.permutation(3), rng.choice((-1.0, 1.0), 3)
    f, m = (f * signs)[order], (m * signs)[order]
    return case("Ellipsoid", np.array(triple(rng, -0.5, 0.5)) * log(rng, -2, 1), f, m)


def stretched(rng: Rng, count: int) -> Case:
    a = np.array(triple(rng, -0.5, 0.5)) * log(rng, -2, 0)
    for i in rng.permutation(3)[:count]:
        a[i] *= log(rng, 6, 15)
    u = unit(rng)
    if rng.random() < 0.7:  # in the middle, where it looks like a cylinder or a plane
        u = np.where(a > 1e3 * a.min(), u * a.min() / a * log(rng, -2, 2), u)
        u = u / np.linalg.norm(u)
    tangent = None if rng.random() < 0.5 else log(rng, 0, 4)
    return built(rng, "Ellipsoid", a, direction=u, tangent=tangent)


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


def quarter_turn(rng: Rng) -> Case:
    """A rotation that only renames axes costs nothing, not even at grazing."""
    made = grazing(rng) if rng.random() < 0.5 else built(rng, "Ellipsoid", triple(rng, -3, 6))
    R = np.eye(3)[rng.permutation(3)] * rng.choice((-1.0, 1.0), 3)
    R[:, 0] *= round(np.linalg.det(R))
    f, m = R @ made.wrench[:3], R @ made.wrench[3:]
    return case(made.kind, made.size, f, m, rotation=tuple(map(tuple, R.tolist())))


def hard(made: Case) -> Case:
    """Return the same contact for the wrench-axis method."""
    return Case(made.kind, made.size, made.wrench, made.center, made.rotation, "hard")


SPECIAL = np.array(
    [0.0, -0.0, 5e-324, -5e-324, 2.3e-308, 1.0, -1.0, 1e-160, 1e160, 1.7976931348623157e308, -1e308]
)


def wild(rng: Rng, count: int, finite: bool = False) -> np.ndarray:
    """Return wrenches with any exponents, zeros of both signs, denormals, a few NaN and infinities."""
    kind = rng.integers(0, 4, count)
    w = rng.normal(size=(count, 6)) * 10.0 ** rng.uniform(-323, 307, (count, 6))
    same = rng.normal(size=(count, 6)) * 10.0 ** rng.uniform(-323, 307, (count, 1))
    near = rng.normal(size=(count, 6)) * 10.0 ** rng.uniform(-20, 20, (count, 6))
    w = np.where((kind == 1)[:, None], same, w)
    w = np.where((kind == 2)[:, None], near, w)
    w = np.where(rng.random((count, 6)) < 0.25, rng.choice(SPECIAL, (count, 6)), w)
    odd = rng.choice([np.nan, np.inf, -np.inf], (count, 6))
    return w if finite else np.where(rng.random((count, 6)) < 0.005, odd, w)


def narrow(rng: Rng, count: int) -> np.ndarray:
    """Return wrenches of any scale and bits, parts within 120 powers of ten of each other; many exact zeros."""
    w = rng.normal(size=(count, 6)) * 10.0 ** rng.uniform(-60, 60, (count, 6))
    w = np.where(rng.random((count, 6)) < 0.25, 0.0, w)
    return w * 10.0 ** rng.uniform(-150, 150, (count, 1))


CENTRED = {
    "sphere": ("Sphere", 1.0), "tiny sphere": ("Sphere", 1e-100), "slender": ("Ellipsoid", (1e-3, 1.0, 1e6)),
    "elliptic cylinder": ("Ellipsoid", (1.0, 2.0, INF)), "slab": ("Ellipsoid", (INF, 0.3, INF)),
    "cylinder": ("Cylinder", 0.01), "plane": ("Plane", 2.0), "nearly slab": ("Ellipsoid", (1.0, 1e15, 1e15)),
    "extreme": ("Ellipsoid", (1e29, 1e-29, 1.0)),
}  # fmt: skip


def any_bits(rng: Rng, kind, size) -> Case:
    """A wrench of arbitrary bits, half of them of limited range."""
    w = wild(rng, 1, finite=True) if rng.random() < 0.5 else narrow(rng, 1)
    return Case(kind, size, tuple(w[0].tolist()))


EXACT: dict[str, Maker] = {  # 2e-15 on every solvable case, whatever its condition
    "sphere": lambda rng: built(rng, "Sphere", radius(rng)),
    "ellipsoid": lambda rng: built(rng, "Ellipsoid", triple(rng)),
    "any_wrench": any_wrench,
    "zero_spin": lambda rng: built(rng, "Ellipsoid", triple(rng), spin=0.0),
    "float_zero": float_zero,
    "awkward_hit": awkward_hit,
    "awkward_graze": lambda rng: awkward(rng, lambda rng: 1.0 - log(rng, -6, -3)),
    "grazing": grazing,
    "grazing_sphere": lambda rng: near_axis(rng, (radius(rng),) * 3, -log(rng, -18, -1), 0.0),
    "grazing_exact": grazing_exact,
    "grazing_extreme": grazing_extreme,
    "slender": lambda rng: built(rng, "Ellipsoid", triple(rng, -3, 6)),
    "slender_wrench": slender_wrench,
    "slender_zero_spin": lambda rng: built(rng, "Ellipsoid", triple(rng, -3, 6), spin=0.0),
    "disc_pole": lambda rng: disc_or_needle(rng, disc=True, pole=True),
    "disc_rim": lambda rng: disc_or_needle(rng, disc=True, pole=False),
    "needle_pole": lambda rng: disc_or_needle(rng, disc=False, pole=True),
    "needle_rim": lambda rng: disc_or_needle(rng, disc=False, pole=False),
    "tangential": lambda rng: built(rng, "Ellipsoid", triple(rng), tangent=log(rng, 0, 8)),
    "spin_range": lambda rng: built(rng, "Ellipsoid", triple(rng), spin=sign(rng) * log(rng, -30, 2)),
    "spin_exact_hit": lambda rng: planar(rng, lambda rng: rng.uniform(0, 0.999), (-30, 2)),
    "spin_exact_graze": lambda rng: planar(rng, lambda rng: 1 + sign(rng) * log(rng, -16, -2), (-30, -4)),
    "spin_exact_miss": lambda rng: planar(rng, lambda rng: 1 + log(rng, -3, 3), (-300, 0)),
    "lattice_40": lambda rng: lattice(rng, 40),
    "lattice_52": lambda rng: lattice(rng, 52),
    "nearly_cylinder": lambda rng: stretched(rng, 1),
    "nearly_plane": lambda rng: stretched(rng, 2),
    "scale": scale,
    "scale_edges": scale_edges,
    "large_moment": lambda rng: any_wrench(rng, 2, 150),
    "small_moment": lambda rng: any_wrench(rng, -150, -2),
    "no_moment": lambda rng: any_wrench(rng, -400, -400),
    "cylinder": lambda rng: built(rng, "Cylinder", radius(rng)),
    "cylinder_zero_spin": lambda rng: built(rng, "Cylinder", radius(rng), spin=0.0),
    "cylinder_far": lambda rng: built(rng, "Cylinder", radius(rng), along=log(rng, 0, 6)),
    "cylinder_scale": lambda rng: built(rng, "Cylinder", log(rng, -100, 100), force=log(rng, -180, 180)),
    "cylinder_awkward": cylinder_awkward,
    "elliptic_cylinder": lambda rng: built(rng, "Ellipsoid", endless(rng)),
    "quarter_turn": quarter_turn,
    "hard_ellipsoid": lambda rng: hard(
        built(rng, "Ellipsoid", triple(rng), tangent=rng.uniform(0, 1), spin=0.2 * rng.normal())
    ),
    "hard_any": lambda rng: hard(any_wrench(rng)),
    "hard_zero_spin": lambda rng: hard(awkward_hit(rng)),
    "hard_slender": lambda rng: hard(built(rng, "Ellipsoid", triple(rng, -3, 6), spin=0.01 * rng.normal())),
    "hard_scale": lambda rng: hard(scale(rng)),
    "hard_cylinder": lambda rng: hard(built(rng, "Cylinder", radius(rng))),
}
CONDITIONED: dict[str, Maker] = {  # 8 u times the reported condition
    "plane": lambda rng: built(rng, "Plane", radius(rng)),
    "slab": lambda rng: built(rng, "Ellipsoid", slab(rng)),
    "plane_scale": lambda rng: built(rng, "Plane", log(rng, -100, 100), force=log(rng, -180, 180)),
    "cylinder_tangential": lambda rng: built(rng, "Cylinder", radius(rng), tangent=log(rng, 0, 8)),
    "cylinder_tangential_zero_spin": lambda rng: built(
        rng, "Cylinder", radius(rng), tangent=log(rng, 0, 8), spin=0.0
    ),
    "elliptic_cylinder_tangential": lambda rng: built(rng, "Ellipsoid", endless(rng), tangent=log(rng, 0, 8)),
    "plane_tangential": lambda rng: built(rng, "Plane", radius(rng), tangent=log(rng, 0, 8)),
    "hard_plane": lambda rng: hard(built(rng, "Plane", radius(rng))),
    "hard_grazing": lambda rng: hard(grazing(rng)),
}
MOVED: dict[str, Maker] = {  # 4e-15 of the largest length around
    "rotated": lambda rng: built(
        rng, "Ellipsoid", triple(rng, -0.3, 0.3), tangent=rng.uniform(0, 1), rotation=rotation(rng)
    ),
    "centred": lambda rng: built(
        rng,
        "Ellipsoid",
        triple(rng, -0.3, 0.3),
        tangent=rng.uniform(0, 1),
        center=place(rng, 1.0)["center"],
    ),
    "moved": lambda rng: built(
        rng, "Ellipsoid", triple(rng, -0.3, 0.3), tangent=rng.uniform(0, 1), **place(rng, 1.0)
    ),
    "moved_far": lambda rng: built(
        rng, "Ellipsoid", triple(rng, -0.3, 0.3), tangent=rng.uniform(0, 1), spin=0.1, **place(rng, log(rng, 0, 4))
    ),
    "moved_sphere": lambda rng: built(rng, "Sphere", radius(rng), tangent=rng.uniform(0, 1), **place(rng, 0.1)),
    "moved_cylinder": lambda rng: built(
        rng, "Cylinder", radius(rng), tangent=rng.uniform(0, 1), **place(rng, 1.0)
    ),
    "moved_plane": lambda rng: built(rng, "Plane", radius(rng), tangent=rng.uniform(0, 1), **place(rng, 1.0)),
}
MOVED_GRAZING: dict[str, Maker] = {"rotated_grazing": grazing_rotated}  # 8 u kappa
MISSES: dict[str, Maker] = {  # NO_CONTACT
    "awkward_miss": lambda rng: awkward(rng, lambda rng: 1.0 + log(rng, -4, 0.8)),
    "pushed_miss": pushed_miss,
}
FUZZED: dict[str, Maker] = {
    f"any bits, {name}": functools.partial(any_bits, kind=kind, size=size)
    for name, (kind, size) in CENTRED.items()
}
ALL = EXACT | CONDITIONED | MOVED | MOVED_GRAZING | MISSES | FUZZED


def sample(name: str, count: int) -> list[Case]:
    """Return the first cases of a category, whose seed is its name."""
    rng = np.random.default_rng(zlib.crc32(name.encode()))
    return [ALL[name](rng) for _ in range(count)]
