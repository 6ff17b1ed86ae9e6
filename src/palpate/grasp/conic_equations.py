"""The equations of each iteration of `conic_interior`: dense, symmetric, refined.

    P x + A'y + G'z = r_x,   A x = r_y,   G x - W^2 z = r_z

z is eliminated; in what is left, of x and y, quasidefinite, pivots have signs that are known.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.grasp.conic_blocks import SUMS, scaled, unscaled

__all__ = ["add_transposed", "columns_of", "factor", "solve_scaled", "times"]

FLOOR = 1e-14
"""Least pivot, over what it is the difference of: below is rounding."""

ENOUGH = 1e-13
"""Residual of a direction, over its right side, at which it is not refined."""


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def columns_of(G: Any, blocks: Any) -> Any:
    """Return the unknowns that each block has to do with, one after the other, and where each block's begin."""
    count, unknowns = blocks.shape[0] - 1, G.shape[1]
    where = np.zeros(count + 1, np.int64)
    columns = np.zeros(count * unknowns, np.int64)
    at = 0
    for b in range(count):
        for j in range(unknowns):
            for i in range(blocks[b], blocks[b + 1]):
                if G[i, j] != 0.0:
                    columns[at] = j
                    at += 1
                    break
        where[b + 1] = at
    return columns, where


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def times(G: Any, blocks: Any, columns: Any, where: Any, x: Any, out: Any) -> None:
    """Fill out = G x."""
    for b in range(blocks.shape[0] - 1):
        for i in range(blocks[b], blocks[b + 1]):
            total = 0.0
            for k in range(where[b], where[b + 1]):
                total += G[i, columns[k]] * x[columns[k]]
            out[i] = total


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def add_transposed(G: Any, blocks: Any, columns: Any, where: Any, z: Any, out: Any) -> None:
    """Add G'z to out."""
    for b in range(blocks.shape[0] - 1):
        for k in range(where[b], where[b + 1]):
            j = columns[k]
            total = 0.0
            for i in range(blocks[b], blocks[b + 1]):
                total += G[i, j] * z[i]
            out[j] += total


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def factor(held: Any, A: Any, G: Any, blocks: Any, columns: Any, where: Any, w: Any, eta: Any, K: Any) -> None:
    """Fill K with L and D of [[held + G'W^-2 G, A'], [A, 0]] = L D L', unit lower triangle and diagonal.

    Held is P + A'A: where only equations know an unknown (theta, of load_factor), P and limits leave a hole.
    """
    n, e = held.shape[0], A.shape[0]
    for i in range(n):
        for j in range(i + 1):
            K[i, j] = held[i, j]
    for i in range(e):
        for j in range(n):
            K[n + i, j] = A[i, j]
        for j in range(i + 1):
            K[n + i, n + j] = 0.0
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        begin, over = where[b], 1.0 / (eta[b] * eta[b])
        many = where[b + 1] - begin
        # the rows of W^-1 G: what they add is a sum of squares, so that nothing cancels
        rows = np.empty((end - first, many))
        for k in range(many):
            j = columns[begin + k]
            along = 0.0
            for i in range(first + 1, end):
                along += w[i] * G[i, j]
            share = along / (1.0 + w[first]) - G[first, j]
            rows[0, k] = w[first] * G[first, j] - along
            for i in range(first + 1, end):
                rows[i - first, k] = G[i, j] + share * w[i]
        for k in range(many):
            for m in range(k + 1):
                total = 0.0
                for i in range(end - first):
                    total += rows[i, k] * rows[i, m]
                K[columns[begin + k], columns[begin + m]] += over * total
    size = n + e
    row = np.empty(size)
    for j in range(size):
        pivot, large = K[j, j], abs(K[j, j])
        for k in range(j):
            row[k] = K[j, k] * K[k, k]
            taken = K[j, k] * row[k]
            pivot -= taken
            large += abs(taken)
        least = FLOOR * large + 1e-200
        pivot = max(pivot, least) if j < n else min(pivot, -least)
        K[j, j] = pivot
        over = 1.0 / pivot
        for i in range(j + 1, size):
            total = K[i, j]
            for k in range(j):
                total -= K[i, k] * row[k]
            K[i, j] = total * over


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def solve_scaled(
    P: Any, A: Any, G: Any, blocks: Any, columns: Any, where: Any, w: Any, eta: Any, K: Any,
    right: Any, out: Any, work: Any, rounds: int,
) -> None:  # fmt: skip
    """Fill out (x, y, z) with P x + A'y + G'z, A x, G x - W^2 z = right, refined while that helps."""
    n, e = P.shape[0], A.shape[0]
    size, m = n + e, G.shape[0]
    left, t, u, step = work[0], work[1, :m], work[2, :m], work[3]
    out[:] = 0.0
    left[: size + m] = right
    before = math.inf
    for now in range(rounds):
        # eliminate z = W^-2 (G x - right_z)
        unscaled(w, eta, blocks, left[size : size + m], t)
        unscaled(w, eta, blocks, t, u)
        step[:size] = left[:size]
        for k in range(e):
            for i in range(n):
                step[i] += A[k, i] * left[n + k]
        add_transposed(G, blocks, columns, where, u, step)
        for i in range(size):
            total = step[i]
            for k in range(i):
                total -= K[i, k] * step[k]
            step[i] = total
        for i in range(size):
            step[i] /= K[i, i]
        for i in range(size - 1, -1, -1):
            value = step[i]
            for k in range(i):
                step[k] -= K[i, k] * value
        times(G, blocks, columns, where, step[:n], t)
        unscaled(w, eta, blocks, t, step[size : size + m])
        unscaled(w, eta, blocks, step[size : size + m], t)
        for i in range(m):
            step[size + i] = t[i] - u[i]
        for i in range(size + m):
            out[i] += step[i]
        if now == rounds - 1:
            break
        # what is left
        worst, most = 0.0, 0.0
        scaled(w, eta, blocks, out[size : size + m], t)
        scaled(w, eta, blocks, t, u)
        times(G, blocks, columns, where, out[:n], t)
        for i in range(m):
            left[size + i] = right[size + i] - t[i] + u[i]
        left[:size] = 0.0
        add_transposed(G, blocks, columns, where, out[size : size + m], left)
        for i in range(n):
            total = left[i]
            for k in range(n):
                total += P[i, k] * out[k]
            for k in range(e):
                total += A[k, i] * out[n + k]
            left[i] = right[i] - total
        for i in range(e):
            total = 0.0
            for k in range(n):
                total += A[i, k] * out[k]
            left[n + i] = right[n + i] - total
        for i in range(size + m):
            worst, most = max(worst, abs(left[i])), max(most, abs(right[i]))
        if not worst > ENOUGH * most:
            break
        if not worst < 0.5 * before:
            break
        before = worst
