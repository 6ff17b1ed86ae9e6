"""How errors of a grasp spread over its contacts' limits, to first order, compiled.

Normal forces are commanded; friction bears what the object really needs. With h_i = mu_i f_i - |u_i|, d_i = u_i /
|u_i|, g_i = mu_i f_i (a little more for contacts that hardly press), an error c of the balance and errors a_i =
f_i dmu_i + |u_i| d_i3^2 de_i / e_i of the limits themselves, friction is taken to change by

    min sum [(a_i - d_i.du_i)^2 + kappa |du_i|^2] / g_i^2 + K df_i^2 / G^2    with    sum U_i du_i + N_i df_i + c =
    0:

contacts whose friction is better than thought take over from others, as objects do that creep a few micrometres
before they slip. Any such rule gives a share of failures that is too high, never too low (to first order), since
the object holds if any forces within the limits balance. G^2 is the mean of g^2; K is large: normal forces move
only where no friction helps, as along the line of two opposite contacts, where the hand's own structure bears the
difference. The minimum is

    dh_i = k a_i + B_i'S^-1 (c + sum D_j a_j),   k = kappa / (1 + kappa),   D_i = U_i d_i / (1 + kappa),
    B_i = g_i^2 D_i - mu_i G^2 N_i / K,   S = sum g_i^2 [U_i U_i' / kappa - (1 + kappa) D_i D_i' / kappa] + G^2 N_i
    N_i' / K.
"""

import math
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.grasp.solvers.dual_newton import MU

KAPPA = 0.3
"""kappa, chosen: at 0 friction would move however far to level margins, and first order would not hold; without
end it would move as little as it can, and a contact with good friction would help no other."""

MIN_LOAD_SHARE = 0.01
"""Contacts that hardly press are leant on as if they had a tenth of the others' friction: where no other would do,
as against rolling between two fingers, they get that as a larger reserve, and press."""

STIFF = 1e6
"""K: normal forces yield a millionth of what friction would."""

SINGULAR = 1e-13
"""Of the trace, added where balance is indifferent to something."""


@njit(cache=True, error_model="numpy")
def _add_spread(out: Any, columns: Any, covariance: Any) -> None:
    """Add columns' covariance columns, columns as rows (k, 6), to out (6, 6)."""
    k = columns.shape[0]
    for a in range(k):
        for b in range(k):
            share = covariance[a, b]
            if share != 0.0:
                for r in range(6):
                    for s in range(6):
                        out[r, s] += columns[a, r] * share * columns[b, s]


@njit(cache=True, error_model="numpy")
def _invert(matrix: Any, out: Any) -> None:
    """Fill out (6, 6) with the inverse of a positive definite matrix, which is lost: Cholesky's method."""
    trace = 0.0
    for k in range(6):
        trace += matrix[k, k]
    nothing = SINGULAR * trace + 1e-300
    for j in range(6):
        pivot = matrix[j, j] + nothing
        for k in range(j):
            pivot -= matrix[j, k] * matrix[j, k]
        matrix[j, j] = math.sqrt(max(pivot, nothing))
        for i in range(j + 1, 6):
            left = matrix[i, j]
            for k in range(j):
                left -= matrix[i, k] * matrix[j, k]
            matrix[i, j] = left / matrix[j, j]
    for column in range(6):
        for i in range(6):
            right = 1.0 if i == column else 0.0
            for k in range(i):
                right -= matrix[i, k] * out[column, k]
            out[column, i] = right / matrix[i, i]
        for i in range(5, -1, -1):
            right = out[column, i]
            for k in range(i + 1, 6):
                right -= matrix[k, i] * out[column, k]
            out[column, i] = right / matrix[i, i]


@njit(cache=True, error_model="numpy")
def _moment(out: Any, place: Any, x: float, y: float, z: float) -> None:
    """Fill out (6,) with a force and its moment."""
    out[0], out[1], out[2] = x, y, z
    out[3] = place[1] * z - place[2] * y
    out[4] = place[2] * x - place[0] * z
    out[5] = place[0] * y - place[1] * x


@njit(cache=True, error_model="numpy")
def spread(
    rows: Any, f: Any, u: Any, lengths: Any, cov_mu: Any, cov_e: Any, cov_p: Any, cov_n: Any, cov_load: Any
) -> tuple[Any, Any, Any, Any, Any, Any, Any]:
    """Return covariances of margins and what goes with them.

    Args:
        rows: Scaled contacts, (n, ROW); mu and e there are not used for torques: `lengths` are.
        f: Normal forces, (n,) [N].
        u: (f_t1, f_t2, tau / e) with e of `lengths`, (n, 3) [N].
        lengths: e, scaled, where margins are taken to be straight, (n,).
        cov_mu: (n, n).
        cov_e: (n, n), scaled.
        cov_p: (n, 3, 3), scaled.
        cov_n: Of the normal's parts along t1, t2, (n, 2, 2).
        cov_load: Scaled, (6, 6) [N^2].

    Returns:
        Covariance of the margins (n, n) [N^2]; covariances of mu_i with margin i (n,); the variance (n,) by
        which friction turns aside, and the square of that turn's covariance with the margin (n,); the rule dh_i /
        da_j (n, n); covariances of e_i with margin i (n,); slopes da_i / de_i (n,).
    """
    n, kappa = rows.shape[0], KAPPA
    columns, normals = np.empty((n, 3, 6)), np.empty((n, 6))
    big_d, through = np.zeros((n, 6)), np.zeros((n, 6))
    inner, error, share = np.zeros((6, 6)), cov_load.copy(), np.empty((6, 6))
    moved, turned = np.zeros((3, 6)), np.empty((2, 6))
    slopes, square = np.empty(n), np.empty(n)
    mean = 0.0
    for i in range(n):
        square[i] = (rows[i, MU] * f[i]) ** 2
        mean += square[i] / n
    yielding = mean / STIFF
    for i in range(n):
        square[i] += MIN_LOAD_SHARE * mean
        place, normal, t1, t2 = rows[i, 0:3], rows[i, 3:6], rows[i, 6:9], rows[i, 9:12]
        _moment(normals[i], place, normal[0], normal[1], normal[2])
        _moment(columns[i, 0], place, t1[0], t1[1], t1[2])
        _moment(columns[i, 1], place, t2[0], t2[1], t2[2])
        for k in range(3):
            columns[i, 2, k], columns[i, 2, 3 + k] = 0.0, lengths[i] * normal[k]
        size = math.sqrt(u[i, 0] ** 2 + u[i, 1] ** 2 + u[i, 2] ** 2)
        if size > 0.0:
            for r in range(6):
                for k in range(3):
                    big_d[i, r] += columns[i, k, r] * u[i, k] / (size * (1.0 + kappa))
        slopes[i] = u[i, 2] ** 2 / (size * lengths[i]) if size > 0.0 else 0.0
        for r in range(6):
            for s in range(r + 1):
                crossed = -(1.0 + kappa) * big_d[i, r] * big_d[i, s]
                for k in range(3):
                    crossed += columns[i, k, r] * columns[i, k, s]
                inner[r, s] += square[i] * crossed / kappa + yielding * normals[i, r] * normals[i, s]
        # errors of place and normal: dp x F, and the contact turned by w = n x dn: (w x F, p x (w x F) + tau dn)
        fx = f[i] * normal[0] + u[i, 0] * t1[0] + u[i, 1] * t2[0]
        fy = f[i] * normal[1] + u[i, 0] * t1[1] + u[i, 1] * t2[1]
        fz = f[i] * normal[2] + u[i, 0] * t1[2] + u[i, 1] * t2[2]
        moved[0, 4], moved[0, 5] = -fz, fy
        moved[1, 3], moved[1, 5] = fz, -fx
        moved[2, 3], moved[2, 4] = -fy, fx
        _add_spread(error, moved, cov_p[i])
        for k in range(2):
            sign = 1.0 if k == 0 else -1.0  # n x t1 = t2, n x t2 = -t1
            w, along = (t2, t1) if k == 0 else (t1, t2)
            dx = sign * (w[1] * fz - w[2] * fy)
            dy = sign * (w[2] * fx - w[0] * fz)
            dz = sign * (w[0] * fy - w[1] * fx)
            _moment(turned[k], place, dx, dy, dz)
            for r in range(3):
                turned[k, 3 + r] += u[i, 2] * lengths[i] * along[r]
        _add_spread(error, turned, cov_n[i])
    _invert(inner, share)
    kept = kappa / (1.0 + kappa)
    own, rule = np.empty((n, n)), np.empty((n, n))
    for i in range(n):
        for r in range(6):
            for s in range(6):
                wanted = square[i] * big_d[i, s] - rows[i, MU] * yielding * normals[i, s]
                through[i, r] += wanted * share[s, r]
        for j in range(n):
            own[i, j] = f[i] * cov_mu[i, j] * f[j] + slopes[i] * cov_e[i, j] * slopes[j]
            rule[i, j] = kept if i == j else 0.0
            for r in range(6):
                rule[i, j] += through[i, r] * big_d[j, r]
    _add_spread(error, big_d, own)  # of the balance, limits' own errors included
    # covariances of the balance with each margin, then of the multipliers
    crossing, pulled, multipliers = np.zeros((6, n)), np.zeros((6, n)), np.zeros((6, 6))
    for i in range(n):
        for r in range(6):
            for s in range(6):
                crossing[r, i] += error[r, s] * through[i, s]
            for j in range(n):
                crossing[r, i] += kept * big_d[j, r] * own[j, i]
        for r in range(6):
            for s in range(6):
                pulled[r, i] += share[r, s] * crossing[s, i]
    half = np.zeros((6, 6))
    for r in range(6):
        for s in range(6):
            for k in range(6):
                half[r, s] += share[r, k] * error[k, s]
    for r in range(6):
        for s in range(6):
            for k in range(6):
                multipliers[r, s] += half[r, k] * share[k, s]
    margins, of_mu, of_e = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    turning, together = np.zeros(n), np.zeros(n)
    for i in range(n):
        for j in range(n):
            margins[i, j] = kept * kept * own[i, j]
            for r in range(6):
                margins[i, j] += through[i, r] * crossing[r, j]
            for k in range(n):
                linked = 0.0
                for r in range(6):
                    linked += big_d[k, r] * through[j, r]
                margins[i, j] += kept * own[i, k] * linked
            of_mu[i] += rule[i, j] * f[j] * cov_mu[j, i]
            of_e[i] += rule[i, j] * slopes[j] * cov_e[j, i]
        for k in range(4):
            weight = square[i] ** 2 / kappa**2 * (1.0 if k < 3 else -((1.0 + kappa) ** 2))
            column = columns[i, k] if k < 3 else big_d[i]
            along_pulled, through_both = 0.0, 0.0
            for r in range(6):
                along_pulled += column[r] * pulled[r, i]
                for s in range(6):
                    through_both += column[r] * multipliers[r, s] * column[s]
            turning[i] += weight * through_both
            together[i] += weight * along_pulled**2
        turning[i], together[i] = max(turning[i], 0.0), max(together[i], 0.0)  # squares, but for rounding
    return margins, of_mu, turning, together, rule, of_e, slopes
