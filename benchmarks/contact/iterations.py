"""Iterative methods on the paper's four equations: Newton in vectorised numpy, and scipy's root finders.

Unknowns (c, K), equations 13 and 11: K A^2 c + c x f - m = 0 and (c.A^2 c - 1)/2 = 0, in units in which the
smallest semi-axis and the largest component of the force are 1, with their exact Jacobian. All of them start where
the wrench axis enters the surface, or, where it misses, at the point that the force pushes squarely, with K = 0.
"""

from collections.abc import Callable

import numpy as np
from scipy.optimize import least_squares, root

from contact.closed_forms import Rows, Solve, dot, prepare_wrench_axis

TOLERANCE = 1e-15
"""Asked of scipy: as tight as least_squares accepts without switching a criterion off."""


def residuals(A2: Rows, f: Rows, m: Rows, x: Rows) -> Rows:
    """Return how far (c, K) are from solving the equations, shape (n, 4)."""
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


def prepare_root(semi_axes: Rows) -> Solve:
    """Return scipy's `root` (Powell's hybrid method), one wrench after the other."""
    return prepare_scaled(semi_axes, lambda A2, f, m, x: _each(A2, f, m, x, _root))


def prepare_least_squares(semi_axes: Rows) -> Solve:
    """Return scipy's `least_squares` (trust region), one wrench after the other."""
    return prepare_scaled(semi_axes, lambda A2, f, m, x: _each(A2, f, m, x, _least_squares))


def _root(equations: Callable[[Rows], Rows], slope: Callable[[Rows], Rows], start: Rows) -> Rows:
    return root(equations, start, jac=slope, tol=TOLERANCE).x


def _least_squares(equations: Callable[[Rows], Rows], slope: Callable[[Rows], Rows], start: Rows) -> Rows:
    found = least_squares(
        equations, start, jac=slope, x_scale="jac", xtol=TOLERANCE, ftol=TOLERANCE, gtol=TOLERANCE
    )
    return found.x


def _each(A2: Rows, f: Rows, m: Rows, start: Rows, find: Callable[..., Rows]) -> Rows:
    found = np.full_like(start, np.nan)
    for i in range(len(start)):
        row = slice(i, i + 1)

        def equations(x: Rows, row: slice = row) -> Rows:
            return residuals(A2, f[row], m[row], x[None])[0]

        def slope(x: Rows, row: slice = row) -> Rows:
            return jacobians(A2, f[row], x[None])[0]

        try:
            found[i] = find(equations, slope, start[i])
        except (ValueError, np.linalg.LinAlgError):  # scipy refuses residuals that overflow
            continue
    return found
