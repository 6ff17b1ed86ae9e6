"""Ways from wrenches to contact centroids on an ellipsoid: palpate, closed forms in numpy, and iterations.

Equations are those of Bicchi 1990, "Intrinsic contact sensing for soft fingers", with the errata that the print
needs. The surface is |A c| = R with A = diag(R / semi-axis). A method's `prepare` takes the semi-axes (3,) [m] and
returns wrenches (n, 6) -> centroids (n, 3); the wrench is exerted by the object on the finger [N, N m].
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import numpy.typing as npt
from harness.study import Method
from scipy.optimize import least_squares, root

from palpate import Ellipsoid, Solver, Superellipsoid, contact_from_wrench, contacts_from_wrenches
from palpate.errors import InvalidValueError
from palpate.sensing.solve import solve_on

Rows = npt.NDArray[np.floating]
Solve = Callable[[Rows], Rows]
TOLERANCE = 1e-15
"""Tolerance given to scipy: as tight as least_squares accepts without switching a criterion off."""


def dot(u: Rows, v: Rows) -> Rows:
    """Return the scalar products of rows, shape (n,)."""
    return np.einsum("ij,ij->i", u, v)


# ------------------------------------------------------------------------------------------------ closed forms


def prepare_wrench_axis(semi_axes: Rows) -> Solve:
    """Return equations 5 and 6: where the wrench axis enters the surface; NaN where it misses."""
    R = semi_axes.min()
    A = R / semi_axes

    def solve(wrenches: Rows) -> Rows:
        f, m = wrenches[:, :3], wrenches[:, 3:]
        r0 = np.cross(f, m) / dot(f, f)[:, None]
        Af, Ar = A * f, A * r0
        ff, fr = dot(Af, Af), dot(Af, Ar)
        along = (-fr - np.sqrt(fr**2 - ff * (dot(Ar, Ar) - R**2))) / ff
        return r0 + along[:, None] * f

    return solve


def prepare_paper(semi_axes: Rows) -> Solve:
    """Return equations 16 and 18; where f.m is exactly zero, equation 5, as the paper says."""
    R = semi_axes.min()
    A = R / semi_axes
    D = A.prod()
    no_spin = prepare_wrench_axis(semi_axes)

    def solve(wrenches: Rows) -> Rows:
        f, m = wrenches[:, :3], wrenches[:, 3:]
        s, Af, Am = dot(f, m), A * f, m / A
        ff = dot(Af, Af)
        sigma = D**2 * dot(Am, Am) - R**2 * ff
        K = -np.sign(s) / (np.sqrt(2.0) * R * D) * np.sqrt(sigma + np.sqrt(sigma**2 + 4.0 * D**2 * R**2 * s**2))
        terms = (K**2 * D**2)[:, None] * m / A**2 + K[:, None] * np.cross(A**2 * f, m) + s[:, None] * f
        c = terms / (K * (K**2 * D**2 + ff))[:, None]
        zero = s == 0.0
        if zero.any():
            c[zero] = no_spin(wrenches[zero])
        return c

    return solve


def prepare_one_formula(semi_axes: Rows, dtype: type[np.floating] = np.float64) -> Solve:
    """Return the formula that palpate compensates (see `palpate.sensing.kernels.quadric`), here plain, R = 1.

    With a = C m, b = A f, w = b + i a (C the cofactors of A, D = det A) take the root z = g + i k = -sqrt(w.w)
    with g <= 0; then c = [K C^2 m + (A^2 f) x m + g f] / (k^2 + |b|^2) with K = k/D. Nothing is singular at K = 0.
    """
    A = 1.0 / semi_axes
    D = A.prod()
    A, C, D = A.astype(dtype), (D / A).astype(dtype), dtype(D)

    def solve(wrenches: Rows) -> Rows:
        f, m = wrenches[:, :3], wrenches[:, 3:]
        a, b = C * m, A * f
        bb = dot(b, b)
        z = -np.sqrt(bb - dot(a, a) + 2j * D * dot(f, m))
        g, k = z.real, z.imag
        terms = (k / D)[:, None] * C**2 * m + np.cross(A**2 * f, m) + g[:, None] * f
        return terms / (k**2 + bb)[:, None]

    return solve


# -------------------------------------------------------------------------------------------------- iterations
# Unknowns (c, K), equations 13 and 11: K A^2 c + c x f - m = 0 and (c.A^2 c - 1)/2 = 0, in units in which the
# smallest semi-axis and the largest force component are 1. All start where the wrench axis enters the surface, or,
# where it misses, at the point that the force pushes squarely, with K = 0.


def residuals(A2: Rows, f: Rows, m: Rows, x: Rows) -> Rows:
    """Return the residuals of the equations at (c, K), shape (n, 4)."""
    c, K = x[:, :3], x[:, 3:]
    return np.hstack([K * A2 * c + np.cross(c, f) - m, 0.5 * (dot(c, A2 * c)[:, None] - 1.0)])


def jacobians(A2: Rows, f: Rows, x: Rows) -> Rows:
    """Return the derivatives of `residuals`, shape (n, 4, 4)."""
    c, K = x[:, :3], x[:, 3]
    J = np.zeros((len(x), 4, 4))
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        J[:, i, i] = K * A2[i]
        J[:, i, j], J[:, i, k] = f[:, k], -f[:, j]
    J[:, :3, 3] = J[:, 3, :3] = A2 * c
    return J


def prepare_scaled(semi_axes: Rows, iterate: Callable[[Rows, Rows, Rows, Rows], Rows]) -> Solve:
    """Return wrenches -> centroids around `iterate`(A2, f, m, start) -> (c, K), which works in scaled units."""
    R = semi_axes.min()
    A2 = (R / semi_axes) ** 2
    axis = prepare_wrench_axis(semi_axes / R)

    def solve(wrenches: Rows) -> Rows:
        force = np.abs(wrenches[:, :3]).max(axis=1, keepdims=True)
        f, m = wrenches[:, :3] / force, wrenches[:, 3:] / force / R
        c = axis(np.hstack([f, m]))
        missed = ~np.isfinite(c).all(axis=1)
        square = f[missed] / A2
        c[missed] = -square / np.sqrt(dot(f[missed], square))[:, None]
        K = dot(f, m) / dot(f, A2 * c)
        K = np.where(missed | ~np.isfinite(K), 0.0, K)  # infinite where the axis is exactly tangent
        return R * iterate(A2, f, m, np.column_stack([c, K]))[:, :3]

    return solve


def solve_each(J: Rows, e: Rows) -> Rows:
    """Solve n systems of four equations, shape (n, 4); NaN where one is singular."""
    try:
        return np.linalg.solve(J, e[..., None])[..., 0]
    except np.linalg.LinAlgError:  # numpy gives up on all of them when one is singular
        if len(J) == 1:
            return np.full_like(e, np.nan)
        half = len(J) // 2
        return np.concatenate([solve_each(J[:half], e[:half]), solve_each(J[half:], e[half:])])


def prepare_newton(semi_axes: Rows, steps: int) -> Solve:
    """Return undamped Newton with a fixed number of steps."""

    def iterate(A2: Rows, f: Rows, m: Rows, x: Rows) -> Rows:
        for _ in range(steps):
            x = x - solve_each(jacobians(A2, f, x), residuals(A2, f, m, x))
        return x

    return prepare_scaled(semi_axes, iterate)


def prepare_scipy(semi_axes: Rows, find: Callable[..., Rows]) -> Solve:
    """Return a root finder of scipy, one wrench after the other."""

    def iterate(A2: Rows, f: Rows, m: Rows, start: Rows) -> Rows:
        found = np.full_like(start, np.nan)
        for i in range(len(start)):
            one, moment = f[i : i + 1], m[i : i + 1]
            equations = partial(_at_one, partial(residuals, A2, one, moment))
            slope = partial(_at_one, partial(jacobians, A2, one))
            try:
                found[i] = find(equations, slope, start[i])
            except (ValueError, np.linalg.LinAlgError):  # scipy refuses residuals that overflow
                continue
        return found

    return prepare_scaled(semi_axes, iterate)


def _at_one(function: Callable[[Rows], Rows], x: Rows) -> Rows:
    return function(x[None])[0]


def powell(equations: Solve, slope: Solve, start: Rows) -> Rows:
    """Return the root by Powell's hybrid method."""
    return root(equations, start, jac=slope, tol=TOLERANCE).x


def trust_region(equations: Solve, slope: Solve, start: Rows) -> Rows:
    """Return the root by scipy's `least_squares`."""
    tight = {"xtol": TOLERANCE, "ftol": TOLERANCE, "gtol": TOLERANCE}
    return least_squares(equations, start, jac=slope, x_scale="jac", **tight).x


# ----------------------------------------------------------------------------------------------------- methods


def prepare_palpate(semi_axes: Rows) -> Solve:
    """Return palpate's batch call, which computes all fields and a status."""
    surface = Ellipsoid(tuple(semi_axes.tolist()))
    return lambda wrenches: contacts_from_wrenches(surface, wrenches).centroid


def one_palpate(semi_axes: Rows) -> Callable[[Rows], object]:
    """Return palpate's call for one wrench, result object included."""
    return partial(contact_from_wrench, Ellipsoid(tuple(semi_axes.tolist())))


def one_solver(semi_axes: Rows) -> Callable[[Rows], object]:
    """Return palpate's solver for loops, result object included."""
    return Solver(Ellipsoid(tuple(semi_axes.tolist())))


def one_kernel(semi_axes: Rows) -> Callable[[Rows], object]:
    """Return palpate's compiled function alone, on one wrench, into allocated arrays."""
    solve = solve_on(Ellipsoid(tuple(semi_axes.tolist())))
    result, status = np.empty(15), np.empty(1, np.int8)
    return lambda wrench: solve(wrench, False, result, status)


def implicit_tip(semi_axes: Rows) -> Superellipsoid:
    """Return the ellipsoid as a superellipsoid of exponent 2, for palpate's iterative solver."""
    return Superellipsoid(semi_axes=tuple(semi_axes.tolist()), exponent=2.0)


def prepare_implicit(semi_axes: Rows) -> Solve:
    """Return palpate's iterative solver; a refused fingertip counts as failed."""
    try:
        surface = implicit_tip(semi_axes)
    except InvalidValueError:
        return lambda wrenches: np.full((len(wrenches), 3), np.nan)
    return lambda wrenches: contacts_from_wrenches(surface, wrenches).centroid


@dataclass(frozen=True, slots=True)
class ContactMethod(Method):
    """A method of contact sensing.

    Attributes:
        batch: Share of the timed batch that the method receives; 0 if it takes one wrench at a time.
        single: As `prepare`, for one wrench (6,), where the method has an entry of its own.
        dtype: Type of the wrenches.
    """

    batch: float = 1.0
    single: Callable[[Rows], Callable[[Rows], object]] | None = None
    dtype: type[np.floating] = np.float64

    def one(self, semi_axes: Rows) -> Callable[[Rows], object]:
        """Return the function of one wrench, shape (6,)."""
        if self.single is not None:
            return self.single(semi_axes)
        rows = self.prepare(semi_axes)
        return lambda wrench: rows(wrench.reshape(1, 6))


SINGLE, ITERATED = 0.0, 0.1
ONE_IMPLICIT = partial(ContactMethod, "palpate, implicit", prepare_implicit, batch=ITERATED)
SCIPY_ROOT, SCIPY_SQUARES = partial(prepare_scipy, find=powell), partial(prepare_scipy, find=trust_region)
FLOAT32 = partial(prepare_one_formula, dtype=np.float32)
PALPATE = ContactMethod("palpate", prepare_palpate, single=one_palpate)
SOLVER = ContactMethod("palpate, solver for loops", prepare_palpate, batch=SINGLE, single=one_solver)
KERNEL = ContactMethod("palpate, kernel alone", prepare_palpate, batch=SINGLE, single=one_kernel)
ONE_FORMULA = ContactMethod("one formula, numpy", prepare_one_formula)
ROOT = ContactMethod("scipy root", SCIPY_ROOT, most=200, batch=SINGLE)
METHODS = (
    PALPATE,
    SOLVER,
    KERNEL,
    ONE_FORMULA,
    ContactMethod("one formula, float32", FLOAT32, dtype=np.float32),
    ContactMethod("paper, eq. 16-18", prepare_paper),
    ContactMethod("wrench axis", prepare_wrench_axis),
    *(ContactMethod(f"Newton, {n} steps", partial(prepare_newton, steps=n), batch=ITERATED) for n in (1, 2, 3)),
    ONE_IMPLICIT(single=lambda semi_axes: partial(contact_from_wrench, implicit_tip(semi_axes))),
    ROOT,
    ContactMethod("scipy least_squares", SCIPY_SQUARES, most=40, batch=SINGLE),
)
