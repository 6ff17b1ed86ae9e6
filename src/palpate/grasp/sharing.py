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

from typing import Any

import numpy as np
from numba import njit

from palpate.grasp.dual_newton import MU

YIELDING = 0.3
"""kappa, chosen: at 0 friction would move however far to level margins, and first order would not hold; without
end it would move as little as it can, and a contact with good friction would help no other."""

LEANT_ON = 0.01
"""Contacts that hardly press are leant on as if they had a tenth of the others' friction: where no other would do,
as against rolling between two fingers, they are told so by the reserve they get, and press."""

STIFF = 1e6
"""K: normal forces yield a millionth of what friction would."""


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
    n = rows.shape[0]
    kappa = YIELDING
    big_d, big_b = np.zeros((n, 6)), np.zeros((n, 6))
    inner, error = np.zeros((6, 6)), cov_load.copy()
    columns, aside = np.zeros((n, 6, 3)), np.zeros((n, 6, 6))
    slopes = np.zeros(n)
    square = (rows[:, MU] * f) ** 2
    mean = np.mean(square)
    yielding = mean / STIFF
    square += LEANT_ON * mean
    for i in range(n):
        p, normal = rows[i, 0:3], rows[i, 3:6]
        unitary = np.zeros((6, 4))  # N, t1, t2 and spin as wrenches
        for k in range(3):
            a = rows[i, 3 + 3 * k : 6 + 3 * k]
            unitary[:3, k] = a
            unitary[3, k] = p[1] * a[2] - p[2] * a[1]
            unitary[4, k] = p[2] * a[0] - p[0] * a[2]
            unitary[5, k] = p[0] * a[1] - p[1] * a[0]
        unitary[3:, 3] = lengths[i] * normal
        size = np.sqrt(u[i, 0] ** 2 + u[i, 1] ** 2 + u[i, 2] ** 2)
        direction = u[i] / size if size > 0.0 else np.zeros(3)
        for r in range(6):
            for k in range(3):
                columns[i, r, k] = unitary[r, 1 + k]
                big_d[i, r] += unitary[r, 1 + k] * direction[k] / (1.0 + kappa)
            big_b[i, r] = square[i] * big_d[i, r] - rows[i, MU] * yielding * unitary[r, 0]
        slopes[i] = size * direction[2] ** 2 / lengths[i]
        for r in range(6):
            for s in range(6):
                crossed = 0.0
                for k in range(3):
                    crossed += columns[i, r, k] * columns[i, s, k]
                aside[i, r, s] = crossed - (1.0 + kappa) ** 2 * big_d[i, r] * big_d[i, s]
                inner[r, s] += square[i] * (crossed - (1.0 + kappa) * big_d[i, r] * big_d[i, s]) / kappa
                inner[r, s] += yielding * unitary[r, 0] * unitary[s, 0]
        # errors of place and normal: dp x F, and the contact turned by w = n x dn: (w x F, p x (w x F) + tau dn)
        force = f[i] * normal + u[i, 0] * rows[i, 6:9] + u[i, 1] * rows[i, 9:12]
        moved = np.zeros((6, 3))
        moved[3, 1], moved[3, 2] = force[2], -force[1]
        moved[4, 0], moved[4, 2] = -force[2], force[0]
        moved[5, 0], moved[5, 1] = force[1], -force[0]
        error += moved @ np.ascontiguousarray(cov_p[i]) @ moved.T
        turned = np.zeros((6, 2))
        for k in range(2):
            w = rows[i, 9:12] if k == 0 else -rows[i, 6:9]  # n x t1 = t2, n x t2 = -t1
            dx = w[1] * force[2] - w[2] * force[1]
            dy = w[2] * force[0] - w[0] * force[2]
            dz = w[0] * force[1] - w[1] * force[0]
            turned[0, k], turned[1, k], turned[2, k] = dx, dy, dz
            turned[3, k] = p[1] * dz - p[2] * dy
            turned[4, k] = p[2] * dx - p[0] * dz
            turned[5, k] = p[0] * dy - p[1] * dx
            turned[3:, k] += u[i, 2] * lengths[i] * rows[i, 6 + 3 * k : 9 + 3 * k]
        error += turned @ np.ascontiguousarray(cov_n[i]) @ turned.T
    trace = 0.0
    for k in range(6):
        trace += inner[k, k]
    for k in range(6):
        inner[k, k] += 1e-13 * trace + 1e-300
    share = np.linalg.inv(inner)
    through = big_b @ share
    own = np.zeros((n, n))
    for i in range(n):
        for j in range(n):
            own[i, j] = f[i] * cov_mu[i, j] * f[j] + slopes[i] * cov_e[i, j] * slopes[j]
    rule = through @ big_d.T
    for i in range(n):
        rule[i, i] += kappa / (1.0 + kappa)
    margins = rule @ own @ rule.T + through @ error @ through.T
    of_mu, of_e, turning, together = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n)
    multipliers = share @ (error + big_d.T @ own @ big_d) @ share
    pulled = share @ (error @ through.T + big_d.T @ own @ rule.T)  # covariances with each margin, (6, n)
    for i in range(n):
        for r in range(6):
            for s in range(6):
                turning[i] += aside[i, r, s] * multipliers[r, s]
                together[i] += aside[i, r, s] * pulled[r, i] * pulled[s, i]
        for j in range(n):
            of_mu[i] += rule[i, j] * f[j] * cov_mu[j, i]
            of_e[i] += rule[i, j] * slopes[j] * cov_e[j, i]
        turning[i] *= square[i] ** 2 / kappa**2
        together[i] *= square[i] ** 2 / kappa**2
    return margins, of_mu, turning, together, rule, of_e, slopes
