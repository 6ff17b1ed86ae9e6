"""Contact on a centred quadric in high precision, derived from equations 4 to 18 of the paper.

Float64 inputs are taken exactly: the force and moment in the frame of the surface, the pitch f.m and the
discriminant are formed without any rounding (a float is an integer times a power of two, and so are sums and
products of floats), so their signs are exact. Only what needs a quotient or a root is rounded, to
`PRECISION` bits. The exponent range is unlimited. Vectors are arrays of mpf.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from mpmath import mp, mpf

PRECISION = 600  # bits: 180 digits
EXACT = 60_000  # bits: sums and products of floats never need as many, and unused ones cost nothing

OK, NO_CONTACT, NO_FORCE = "OK", "NO_CONTACT", "NO_FORCE"

Vector = np.ndarray
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


def digits(values: Any) -> np.ndarray:
    """Return floats or mpf, of any shape, as an array of mpf: exactly."""
    made = np.empty(np.shape(values), dtype=object)
    for at in np.ndindex(made.shape):
        value = values
        for i in at:
            value = value[i]
        made[at] = value if isinstance(value, mpf) else mpf(float(value))
    return made


def norm(v: Vector) -> mpf:
    """Return the Euclidean length, at the current precision."""
    return mp.sqrt(np.dot(v, v))


def distance(got: Sequence[object], wanted: Sequence[object]) -> mpf:
    """Return |got - wanted|, both taken exactly."""
    with mp.workprec(PRECISION):
        return norm(digits(got) - digits(wanted))


def solve(
    semi_axes: Any, wrench: Any, *, center: Any = ORIGIN, rotation: Any = IDENTITY, model="soft"
) -> Solution:
    """Return the contact of the surface sum_i (y_i / semi_axes_i)^2 = 1 with y = rotation' (x - center)."""
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
    rotation: np.ndarray


def _exact(semi_axes: Any, wrench: Any, center: Any, rotation: Any) -> _Exact:
    axes, o, R = digits(semi_axes), digits(center), digits(rotation)
    f_sensor, m_sensor = digits(wrench[:3]), digits(wrench[3:])
    finite = np.array([not mp.isinf(a) for a in axes])
    others = [np.delete(np.arange(3), i) for i in range(3)]
    P = np.prod(np.where(finite, axes, mpf(1)))
    p = np.array(
        [np.prod(axes[j[finite[j]]], initial=mpf(1)) if finite[i] else mpf(0) for i, j in enumerate(others)]
    )
    k = np.array([(axes[i] if finite[i] else mpf(1)) if finite[j].all() else mpf(0) for i, j in enumerate(others)])
    f = R.T @ f_sensor
    m = R.T @ (m_sensor - np.cross(o, f_sensor))
    s = f_sensor @ m_sensor  # f.(m - o x f) = f.m
    ff = f @ f
    af, cm, cm_perp = p * f, k * m, k * (ff * m - s * f)
    S, S_hard = cm @ cm - af @ af, cm_perp @ cm_perp - af @ af * ff * ff
    return _Exact(f, m, ff, s, P, int(finite.all()), p, k, S, S_hard, f_sensor, o, R)


def _solve(x: _Exact, model: str) -> Solution:
    if x.ff == 0:
        return Solution(NO_FORCE)
    if x.S_hard >= 0 if model == "hard" else (x.S >= 0 and (x.s == 0 or x.d == 0)):
        return Solution(NO_CONTACT)
    if model == "hard" or x.s == 0:
        c, G = _wrench_axis(x)
        K = None if model == "hard" else mpf(0)
    else:
        c, K = _soft(x)
        G = x.s / K  # f.m = f.q = K f.(A^2 c)
    A2c = (x.p / x.P) ** 2 * c
    size = norm(A2c)
    n = x.rotation @ (A2c / size)
    length = norm(n)
    n = n / length
    fn = G / (size * length)  # f.n, without the cancellation of the product
    spin = x.s * fn / x.ff if K is None else K * size
    af, cm = x.p * x.f, x.k * x.m
    z2, cm2 = mp.sqrt(x.S**2 + 4 * x.d * (x.P * x.s) ** 2), cm @ cm
    if K is None:
        z2, cm2 = -x.S_hard / x.ff**2, af @ af + x.S_hard / x.ff**2
    return Solution(
        OK,
        centroid=x.center + x.rotation @ c,
        normal=n,
        normal_force=-fn,
        tangential_force=x.f_sensor - fn * n,
        spin_torque=spin,
        kappa=mp.sqrt((af @ af + cm2) / z2) if z2 else mp.inf,
    )


def _wrench_axis(x: _Exact) -> tuple[Vector, mpf]:
    """Equations 5, 6: where the wrench axis enters the surface (the minus root), and f.(A^2 c) there."""
    r0 = np.cross(x.f, x.m) / x.ff
    af, ar = x.p / x.P * x.f, x.p / x.P * r0
    root = mp.sqrt(-x.S_hard) / (x.P * x.ff)  # of (af.ar)^2 - aa (|ar|^2 - 1), free of cancellation
    lam = (-(af @ ar) - root) / (af @ af)
    return r0 + lam * x.f, -root


def _soft(x: _Exact) -> tuple[Vector, mpf]:
    """Equation 18 for K (its root written so that it does not cancel), then equation 16 for c."""
    Ps = x.P * x.s
    root = mp.sqrt(x.S**2 + 4 * x.d * Ps**2)
    K2 = (x.S + root) / 2 if x.S >= 0 else 2 * Ps**2 / (root - x.S)
    K = -mp.sign(x.s) * mp.sqrt(K2)
    e2f = (x.p / x.P) ** 2 * x.f
    det = K * (K2 * x.d / x.P**2 + e2f @ x.f)
    return (K2 * (x.k / x.P) ** 2 * x.m + K * np.cross(e2f, x.m) + x.s * x.f) / det, K


class Residuals(NamedTuple):
    """By how much (c, q) fails to be a contact; every number relative."""

    surface: float  # |sum (y_i/a_i)^2 - 1|
    balance: float  # |m - c x f - q| / (|m| + |c||f|)
    parallel: float  # |q x n| / |q|
    pushing: bool  # f.n < 0


def verify(semi_axes: Any, wrench: Any, c: Any, q: Any, *, center: Any = ORIGIN, rotation=IDENTITY) -> Residuals:
    """Put a point c and a torque q (floats or mpf) into equations 1 to 4, without solving anything."""
    with mp.workprec(PRECISION):
        f, m, c, q, a, R = map(digits, (wrench[:3], wrench[3:], c, q, semi_axes, rotation))
        y = R.T @ (c - digits(center))
        inverse = np.array([mpf(0) if mp.isinf(x) else 1 / x for x in a])
        n = R @ (y * inverse**2)
        surface = (y * inverse) @ (y * inverse) - 1
        lost = norm(m - np.cross(c, f) - q) / (norm(m) + norm(c) * norm(f))
        turned = norm(np.cross(q, n)) / (norm(q) * norm(n)) if norm(q) else mpf(0)
        return Residuals(float(abs(surface)), float(lost), float(turned), bool(f @ n < 0))


def torque(solution: Solution) -> Vector:
    """Return the torque q = spin n of a soft solution."""
    with mp.workprec(PRECISION):
        return solution.spin_torque * solution.normal
