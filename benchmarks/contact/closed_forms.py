"""Closed forms for an ellipsoid in plain vectorised numpy: no scaling, no compensation, no status.

Bicchi 1990, "Intrinsic contact sensing for soft fingers", with the errata that the print and the scan need. The
surface is |A c| = R with A = diag(R / semi-axis) and R the smallest semi-axis, the paper's own normalisation.
`prepare` functions derive what belongs to the fingertip once, and return wrenches (n, 6) -> centroids (n, 3), the
wrench being what the object exerts on the finger [N, N m].
"""

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

Rows = npt.NDArray[np.floating]
Solve = Callable[[Rows], Rows]


def dot(u: Rows, v: Rows) -> Rows:
    """Return the scalar products of rows, shape (n,)."""
    return np.einsum("ij,ij->i", u, v)


def prepare_wrench_axis(semi_axes: Rows) -> Solve:
    """Return equations 5 and 6: where the wrench axis enters the surface (the minus root); NaN where it misses."""
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
