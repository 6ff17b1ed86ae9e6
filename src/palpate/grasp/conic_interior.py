"""A primal-dual interior point method for few unknowns and any limits that couple them: compiled, dense.

    least  x'P x / 2 + q'x   with   A x = b,   s = h - G x in blocks of cones

embedded in a homogeneous self-dual problem (Goulart & Chen 2024, "Clarabel"), as `self_dual` does for contacts
that share nothing but their object. There one iteration costs what is linear in the contacts; here limits may tie
any of them together, and it costs the cube of the unknowns: 20 us at four contacts.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.grasp.conic_blocks import SUMS, blocked, divided, multiplied, room, scale, scaled, unscaled
from palpate.grasp.conic_equations import add_transposed, factor, solve_scaled, times

__all__ = ["solve_conic"]

TOLERANCE = 1e-9
"""Residuals over the sizes of what they consist of, and gap over the objective, at which it counts as solved."""

STOP_RATIO = 1e-3
"""Share of it at which no more is tried; between here and 1 it goes on while that helps."""

PROOF = 1e-9
"""Residual of a proof over what it proves."""

MAX_ITERATIONS = 60
"""Ten to fifteen are usual."""

SHY = 0.985
"""Share of the distance to the boundary that a step goes."""

REFINEMENTS = 2
"""Of each direction, at most."""

NEAR = 1e-3
"""Room of the first point below which it is moved."""

STALLED = 12
"""Iterations without an error half as large, after which it is given up."""

SMALL = 1e-3
"""Objective below which the gap counts absolutely; likewise slopes."""


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def _move_inside(v: Any, blocks: Any) -> None:
    """Add as much of the middle of all cones as it takes (Vandenberghe 2010, "The CVXOPT solvers", 5.3)."""
    least = math.inf
    for k in range(blocks.shape[0] - 1):
        least = min(least, room(v, blocks[k], blocks[k + 1]))
    if least < NEAR:
        for k in range(blocks.shape[0] - 1):
            v[blocks[k]] += 1.0 - least


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def solve_conic(
    P: Any, q: Any, A: Any, b: Any, G: Any, h: Any, blocks: Any, columns: Any, where: Any,
    x: Any, y: Any, s: Any, z: Any,
) -> tuple[int, int, float]:  # fmt: skip
    """Fill x, y, s and z; return the outcome, iterations, and error over the tolerances: see `ConicSolution`."""
    n, e, m = q.shape[0], b.shape[0], h.shape[0]
    size, count = n + e, blocks.shape[0] - 1
    w, eta, middle = np.empty(m), np.empty(count), np.empty(m)
    K, work = np.empty((size, size)), np.empty((4, size + m))
    right, fixed, step = np.empty(size + m), np.empty(size + m), np.empty(size + m)
    target, bent, t, ds, dz, gx = np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m), np.empty(m)
    r_x, r_y, r_z, px, ay = np.empty(n), np.empty(e), np.empty(m), np.empty(n), np.empty(n)
    best, best_error = np.zeros(size + 2 * m), math.inf
    held = P + A.T @ A
    tau, kappa = 1.0, 1.0
    w[:], eta[:] = 0.0, 1.0
    for k in range(count):
        w[blocks[k]] = 1.0
    # where limits cost their squares, moved inside
    factor(held, A, G, blocks, columns, where, w, eta, K)
    right[:n], right[n:size], right[size:] = -q, b, h
    solve_scaled(P, A, G, blocks, columns, where, w, eta, K, right, step, work, 1)
    x[:], y[:], z[:] = step[:n], step[n:size], step[size:]
    s[:] = -z
    _move_inside(s, blocks)
    _move_inside(z, blocks)
    sizes_q, sizes_b, sizes_h = 0.0, 0.0, 0.0
    for i in range(n):
        sizes_q = max(sizes_q, abs(q[i]))
    for i in range(e):
        sizes_b = max(sizes_b, abs(b[i]))
    for i in range(m):
        sizes_h = max(sizes_h, abs(h[i]))
    outcome, iterations, since = 0, 0, 0
    while True:
        # what is missing
        quadratic, linear, earned, product = 0.0, 0.0, 0.0, 0.0
        for i in range(n):
            total = 0.0
            for k in range(n):
                total += P[i, k] * x[k]
            px[i] = total
            quadratic += total * x[i]
            linear += q[i] * x[i]
            ay[i] = 0.0
        for k in range(e):
            for i in range(n):
                ay[i] += A[k, i] * y[k]
        add_transposed(G, blocks, columns, where, z, ay)
        times(G, blocks, columns, where, x, gx)
        large_x, large_s, lacking, bare = 0.0, 0.0, 0.0, 0.0
        primal, dual = 0.0, 0.0
        for i in range(n):
            r_x[i] = px[i] + ay[i] + q[i] * tau
            dual = max(dual, abs(r_x[i]))
            large_x = max(large_x, abs(px[i]), abs(ay[i]))
            lacking, bare = max(lacking, abs(ay[i])), max(bare, abs(px[i]))
        for i in range(e):
            total = 0.0
            for k in range(n):
                total += A[i, k] * x[k]
            r_y[i] = total - b[i] * tau
            primal, large_s = max(primal, abs(r_y[i])), max(large_s, abs(total))
            bare = max(bare, abs(total))
            earned -= b[i] * y[i]
        for i in range(m):
            r_z[i] = gx[i] + s[i] - h[i] * tau
            primal, large_s = max(primal, abs(r_z[i])), max(large_s, abs(s[i]))
            bare = max(bare, abs(gx[i] + s[i]))
            earned -= h[i] * z[i]
            product += s[i] * z[i]
        r_tau = kappa + quadratic / tau + linear - earned
        value, bound = 0.5 * quadratic / tau + linear, -0.5 * quadratic / tau + earned
        gap = max(abs(value - bound), product / tau) / max(abs(value), abs(bound), SMALL * tau)
        primal /= tau * max(1.0, sizes_b, sizes_h) + large_s
        dual /= tau * max(SMALL, sizes_q) + large_x
        error = (primal + dual + gap) / TOLERANCE
        if error < best_error:
            if error < 0.5 * best_error:
                since = 0
            best_error = error
            for i in range(n):
                best[i] = x[i] / tau
            for i in range(e):
                best[n + i] = y[i] / tau
            for i in range(m):
                best[size + i], best[size + m + i] = s[i] / tau, z[i] / tau
        if error <= STOP_RATIO or (best_error <= 1.0 and error > best_error):
            break
        if earned > 0.0 and lacking <= PROOF * earned and tau < kappa:
            outcome = -1
            break
        if linear < 0.0 and bare <= PROOF * -linear and tau < kappa:
            outcome = -2
            break
        since += 1
        if not error < math.inf or iterations >= MAX_ITERATIONS or since > STALLED:
            break
        iterations += 1

        scale(s, z, blocks, w, eta, middle)
        factor(held, A, G, blocks, columns, where, w, eta, K)
        for i in range(n):
            right[i] = -q[i]
        right[n:size], right[size:] = b, h
        solve_scaled(P, A, G, blocks, columns, where, w, eta, K, right, fixed, work, 1 + REFINEMENTS)
        mu = (product + tau * kappa) / (count + 1)
        multiplied(middle, middle, blocks, target)
        sigma, d_kappa, ratio = 0.0, tau * kappa, 1.0
        d_tau, d_k = 0.0, 0.0
        for corrector in range(2):
            # target is what middle o (W^-1 ds + W dz) is to be less
            divided(middle, target, blocks, bent)
            scaled(w, eta, blocks, bent, t)
            for i in range(n):
                right[i] = -(1.0 - sigma) * r_x[i]
            for i in range(e):
                right[n + i] = -(1.0 - sigma) * r_y[i]
            for i in range(m):
                right[size + i] = t[i] - (1.0 - sigma) * r_z[i]
            solve_scaled(
                P, A, G, blocks, columns, where, w, eta, K, right, step, work, 1 + corrector * REFINEMENTS
            )
            above = -(1.0 - sigma) * r_tau + d_kappa / tau
            below = -kappa / tau - quadratic / (tau * tau)
            for i in range(n):
                slope = 2.0 * px[i] / tau + q[i]
                above -= slope * step[i]
                below += slope * fixed[i]
            for i in range(e):
                above -= b[i] * step[n + i]
                below += b[i] * fixed[n + i]
            for i in range(m):
                above -= h[i] * step[size + i]
                below += h[i] * fixed[size + i]
            d_tau = above / below
            d_k = -(d_kappa + kappa * d_tau) / tau
            for i in range(size + m):
                step[i] += d_tau * fixed[i]
            scaled(w, eta, blocks, step[size:], dz)
            # from the rows, not from dz: rounding then is in the product of both, which no later step adds up
            times(G, blocks, columns, where, step[:n], t)
            for i in range(m):
                t[i] = h[i] * d_tau - (1.0 - sigma) * r_z[i] - t[i]
            unscaled(w, eta, blocks, t, ds)
            ratio = max(-d_tau / tau, -d_k / kappa, blocked(middle, ds, blocks), blocked(middle, dz, blocks))
            if corrector == 0:
                sigma = (1.0 - 1.0 / max(1.0, ratio)) ** 3
                multiplied(ds, dz, blocks, bent)
                for i in range(m):
                    target[i] += bent[i]
                for k in range(count):
                    target[blocks[k]] -= sigma * mu
                d_kappa += d_tau * d_k - sigma * mu
        length = 1.0 / max(1.0, ratio / SHY)
        for i in range(n):
            x[i] += length * step[i]
        for i in range(e):
            y[i] += length * step[n + i]
        for i in range(m):
            s[i] += length * t[i]
            z[i] += length * step[size + i]
        tau += length * d_tau
        kappa += length * d_k
        for k in range(count):
            if not (room(s, blocks[k], blocks[k + 1]) > 0.0 and room(z, blocks[k], blocks[k + 1]) > 0.0):
                tau = math.nan  # rounding has carried it outside
    if outcome == 0:
        x[:], y[:], s[:], z[:] = best[:n], best[n:size], best[size : size + m], best[size + m :]
        return (1 if best_error <= 1.0 else 0), iterations, best_error
    unit = 0.0
    if outcome == -1:
        for i in range(e):
            unit -= b[i] * y[i]
        for i in range(m):
            unit -= h[i] * z[i]
        y /= unit
        z /= unit
    else:
        for i in range(n):
            unit -= q[i] * x[i]
        x /= unit
    return outcome, iterations, best_error
