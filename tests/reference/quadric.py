"""Contact on a centred quadric in high precision, derived from equations 4 to 18 of the paper.

Float64 inputs are taken exactly: the force and moment in the frame of the surface, the pitch f.m and the
discriminant are formed without any rounding (a float is an integer times a power of two, and so are sums and
products of floats), so their signs are exact. Only what needs a quotient or a root is rounded, to
`PRECISION` bits. The exponent range is unlimited.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from mpmath import mp, mpf

PRECISION = 600  # bits: 180 digits
EXACT = 60_000  # bits: sums and products of floats never need as many, and unused ones cost nothing

OK, NO_CONTACT, NO_FORCE = "OK", "NO_CONTACT", "NO_FORCE"

Vector = list[mpf]
Floats = Sequence[float] | np.ndarray
Rows = Sequence[Floats] | np.ndarray
IDENTITY = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN = (0.0, 0.0, 0.0)


class Solution(NamedTuple):
    """What `palpate.Contact` should hold, as mpf; None where there is no contact."""

    status: str
    centroid: Vector | None = None
    normal: Vector | None = None
    normal_force: mpf | None = None
    tangential_force: Vector | None = None
    spin_torque: mpf | None = None
    kappa: mpf | None = None  # condition number where the ellipsoid is a sphere


def solve(
    semi_axes: Floats,
    wrench: Floats,
    *,
    center: Floats = ORIGIN,
    rotation: Sequence[Sequence[float]] | np.ndarray = IDENTITY,
    model: str = "soft",
) -> Solution:
    """Contact of the surface sum_i (y_i / semi_axes_i)^2 = 1 with y = rotation' (x - center)."""
    with mp.workprec(EXACT):
        exact = _exact(semi_axes, wrench, center, rotation)
    with mp.workprec(PRECISION):
        return _solve(exact, model)


class _Exact(NamedTuple):
    """Everything that is a polynomial in the inputs, unrounded; P is the product of the finite semi-axes."""

    f: Vector  # force in the frame of the surface
    m: Vector  # moment about its origin, in its frame
    ff: mpf  # |f|^2
    s: mpf  # f.m
    P: mpf
    d: int  # P det A: 1 for an ellipsoid, 0 when a semi-axis is infinite
    p: Vector  # P times the diagonal of A
    k: Vector  # P times the diagonal of the cofactor matrix C
    S: mpf  # P^2 sigma = P^2 (|C m|^2 - |A f|^2), R = 1
    S_hard: mpf  # P^2 |f|^4 (|C m_perp|^2 - |A f|^2), m_perp the part of m across f
    f_sensor: Vector
    center: Vector
    rotation: list[Vector]


def _exact(semi_axes: Floats, wrench: Floats, center: Floats, rotation: Rows) -> _Exact:
    axes = [mpf(float(a)) for a in semi_axes]
    f_sensor, m_sensor = [mpf(float(x)) for x in wrench[:3]], [mpf(float(x)) for x in wrench[3:]]
    o = [mpf(float(x)) for x in center]
    R = [[mpf(float(x)) for x in row] for row in rotation]
    finite = [not mp.isinf(a) for a in axes]
    P = mpf(1)
    for i in range(3):
        if finite[i]:
            P *= axes[i]
    others = [[axes[j] for j in range(3) if j != i and finite[j]] for i in range(3)]
    p = [_product(others[i]) if finite[i] else mpf(0) for i in range(3)]
    k = [
        (axes[i] if finite[i] else mpf(1)) if all(finite[j] for j in range(3) if j != i) else mpf(0)
        for i in range(3)
    ]
    f = _transposed_times(R, f_sensor)
    m = _transposed_times(R, sub(m_sensor, cross(o, f_sensor)))
    s = dot(f_sensor, m_sensor)  # f.(m - o x f) = f.m
    ff = dot(f, f)
    af = [p[i] * f[i] for i in range(3)]
    cm = [k[i] * m[i] for i in range(3)]
    cm_perp = [k[i] * (ff * m[i] - s * f[i]) for i in range(3)]
    S = dot(cm, cm) - dot(af, af)
    S_hard = dot(cm_perp, cm_perp) - dot(af, af) * ff * ff
    return _Exact(f, m, ff, s, P, int(all(finite)), p, k, S, S_hard, f_sensor, o, R)


def _solve(x: _Exact, model: str) -> Solution:
    if x.ff == 0:
        return Solution(NO_FORCE)
    if model == "hard":
        if x.S_hard >= 0:
            return Solution(NO_CONTACT)
        (c, G), K = _wrench_axis(x), None
    else:
        if x.S >= 0 and (x.s == 0 or x.d == 0):
            return Solution(NO_CONTACT)
        if x.s == 0:
            (c, G), K = _wrench_axis(x), mpf(0)
        else:
            c, K = _soft(x)
            G = x.s / K  # f.m = f.q = K f.(A^2 c)
    A2c = [(x.p[i] / x.P) ** 2 * c[i] for i in range(3)]
    size = mp.sqrt(dot(A2c, A2c))
    n = _times(x.rotation, [v / size for v in A2c])
    length = mp.sqrt(dot(n, n))
    n = [v / length for v in n]
    fn = G / (size * length)  # f.n, without the cancellation of the product
    spin = x.s * fn / x.ff if K is None else K * size
    af2 = sum((x.p[i] * x.f[i]) ** 2 for i in range(3))
    cm2 = sum((x.k[i] * x.m[i]) ** 2 for i in range(3))
    z2 = mp.sqrt(x.S**2 + 4 * x.d * (x.P * x.s) ** 2)
    if K is None:
        z2, cm2 = -x.S_hard / x.ff**2, af2 + x.S_hard / x.ff**2
    return Solution(
        OK,
        centroid=add(x.center, _times(x.rotation, c)),
        normal=n,
        normal_force=-fn,
        tangential_force=[x.f_sensor[i] - fn * n[i] for i in range(3)],
        spin_torque=spin,
        kappa=mp.sqrt((af2 + cm2) / z2) if z2 else mp.inf,
    )


def _wrench_axis(x: _Exact) -> tuple[Vector, mpf]:
    """Equations 5, 6: where the wrench axis enters the surface (the minus root), and f.(A^2 c) there."""
    r0 = [v / x.ff for v in cross(x.f, x.m)]
    af = [x.p[i] / x.P * x.f[i] for i in range(3)]
    ar = [x.p[i] / x.P * r0[i] for i in range(3)]
    aa = dot(af, af)
    root = mp.sqrt(-x.S_hard) / (x.P * x.ff)  # of (af.ar)^2 - aa (|ar|^2 - 1), free of cancellation
    lam = (-dot(af, ar) - root) / aa
    return [r0[i] + lam * x.f[i] for i in range(3)], -root


def _soft(x: _Exact) -> tuple[Vector, mpf]:
    """Equation 18 for K (its root written so that it does not cancel), then equation 16 for c."""
    Ps = x.P * x.s
    root = mp.sqrt(x.S**2 + 4 * x.d * Ps**2)
    K2 = (x.S + root) / 2 if x.S >= 0 else 2 * Ps**2 / (root - x.S)
    K = -mp.sign(x.s) * mp.sqrt(K2)
    e2 = [(v / x.P) ** 2 for v in x.p]
    C2 = [(v / x.P) ** 2 for v in x.k]
    e2f = [e2[i] * x.f[i] for i in range(3)]
    det = K * (K2 * x.d / x.P**2 + dot(e2f, x.f))
    right = cross(e2f, x.m)
    return [(K2 * C2[i] * x.m[i] + K * right[i] + x.s * x.f[i]) / det for i in range(3)], K


class Residuals(NamedTuple):
    """By how much (c, q) fails to be a contact; every number relative."""

    surface: float  # |sum (y_i/a_i)^2 - 1|
    balance: float  # |m - c x f - q| / (|m| + |c||f|)
    parallel: float  # |q x n| / |q|
    pushing: bool  # f.n < 0


def verify(
    semi_axes: Floats,
    wrench: Floats,
    c: Sequence[object],
    q: Sequence[object],
    *,
    center: Floats = ORIGIN,
    rotation: Sequence[Sequence[float]] | np.ndarray = IDENTITY,
) -> Residuals:
    """Put a point c and a torque q (floats or mpf) into equations 1 to 4, without solving anything."""
    with mp.workprec(PRECISION):
        f, m = _mpf(wrench[:3]), _mpf(wrench[3:])
        c, q, o = _mpf(c), _mpf(q), _mpf(center)
        R = [_mpf(row) for row in rotation]
        y = _transposed_times(R, sub(c, o))
        a = _mpf(semi_axes)
        n = _times(R, [mpf(0) if mp.isinf(a[i]) else y[i] / a[i] ** 2 for i in range(3)])
        surface = sum(mpf(0) if mp.isinf(a[i]) else (y[i] / a[i]) ** 2 for i in range(3)) - 1
        lost = sub(sub(m, cross(c, f)), q)
        scale = norm(m) + norm(c) * norm(f)
        turned = norm(cross(q, n)) / (norm(q) * norm(n)) if norm(q) else mpf(0)
        return Residuals(float(abs(surface)), float(norm(lost) / scale), float(turned), bool(dot(f, n) < 0))


def torque(solution: Solution) -> Vector:
    """The torque q = spin n of a soft solution."""
    with mp.workprec(PRECISION):
        return [solution.spin_torque * v for v in solution.normal]


def distance(got: Sequence[object], wanted: Sequence[object]) -> mpf:
    """|got - wanted|, both taken exactly."""
    with mp.workprec(PRECISION):
        return norm(sub(_mpf(got), _mpf(wanted)))


def norm(v: Vector) -> mpf:
    """Euclidean length, at the current precision."""
    return mp.sqrt(dot(v, v))


def dot(u: Vector, v: Vector) -> mpf:
    """Scalar product, at the current precision."""
    return u[0] * v[0] + u[1] * v[1] + u[2] * v[2]


def cross(u: Vector, v: Vector) -> Vector:
    """Vector product, at the current precision."""
    return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]]


def add(u: Vector, v: Vector) -> Vector:
    """Sum, at the current precision."""
    return [u[i] + v[i] for i in range(3)]


def sub(u: Vector, v: Vector) -> Vector:
    """Difference, at the current precision."""
    return [u[i] - v[i] for i in range(3)]


def _times(R: list[Vector], v: Vector) -> Vector:
    return [dot(row, v) for row in R]


def _transposed_times(R: list[Vector], v: Vector) -> Vector:
    return [dot([R[0][i], R[1][i], R[2][i]], v) for i in range(3)]


def _product(values: list[mpf]) -> mpf:
    result = mpf(1)
    for v in values:
        result *= v
    return result


def _mpf(values: Sequence[object]) -> Vector:
    return [v if isinstance(v, mpf) else mpf(float(v)) for v in values]
