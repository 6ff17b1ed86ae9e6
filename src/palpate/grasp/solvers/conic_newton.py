"""Newton's method on the optimality conditions of conic problems: from a point nearby to rounding, in few steps.

Slacks s and their multipliers z are in cones and do no work on each other exactly if s is the projection of
r = s - z on the cones, and z that of -r. So x, y and r are all that is unknown, in as many equations,

    P x + q + A'y + G'z(r) = 0,   A x = b,   G x + s(r) = h,

smooth but where r crosses a boundary (Qi & Sun 1993, "A nonsmooth version of Newton's method"). In each block r
has directions that are held (s stays 0) and free ones (z stays 0); where it slides on a cone it has one of each,
and across them the cone bends, which adds curvature. Nothing here is sure to converge, but what does meets the
conditions to rounding.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from palpate.compiling import njit

__all__ = ["NEARLY", "newton_steps"]

SUMS = {"reassoc", "contract", "nsz"}
"""Sums may be taken in any order, the same every time: a third faster."""

ENOUGH = 1e-14
"""Residuals, over the sizes of what they consist of, at which no more is tried."""

NEARLY = 1e-10
"""Those at which it counts as solved, and goes on while a step halves them."""

SOFT = 1e-10
"""Added to the diagonal, and taken from that of the equations: where limits say the same twice, or forces may be
any, a step is finite still; later ones make up for it."""

SMALL = 1e-3
"""Slopes below which residuals count absolutely."""

HALF = math.sqrt(0.5)


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def _length(r: Any, first: int, end: int) -> float:
    """Return |r1..| of a block."""
    total = 0.0
    for i in range(first + 1, end):
        total += r[i] * r[i]
    return math.sqrt(total)


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def _project(r: Any, blocks: Any, s: Any, z: Any) -> None:
    """Fill s and z, in cones, with s - z = r."""
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        length = _length(r, first, end)
        for i in range(first, end):
            if r[first] >= length:
                s[i], z[i] = r[i], 0.0
            elif r[first] <= -length:
                s[i], z[i] = 0.0, -r[i]
            else:
                half = 0.5 * (r[first] + length)
                s[i] = half if i == first else half / length * r[i]
                z[i] = s[i] - r[i]


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def _missing(
    P: Any, q: Any, A: Any, b: Any, G: Any, h: Any, x: Any, y: Any, s: Any, z: Any, left: Any, limits: Any
) -> float:
    """Fill what equations lack, those of x and y into `left`, of s into `limits`; return the most over sizes."""
    n, e, m = q.shape[0], b.shape[0], h.shape[0]
    pulled, slack = np.zeros(n), 0.0
    primal, dual, steep, sizes = 0.0, 0.0, SMALL, 1.0
    for k in range(e):
        total = b[k]
        for i in range(n):
            total -= A[k, i] * x[i]
            pulled[i] += A[k, i] * y[k]
        left[n + k] = total
        primal, sizes = max(primal, abs(total)), max(sizes, abs(b[k]))
    for k in range(m):
        total = h[k] - s[k]
        for i in range(n):
            total -= G[k, i] * x[i]
            pulled[i] += G[k, i] * z[k]
        limits[k] = total
        primal, sizes, slack = max(primal, abs(total)), max(sizes, abs(h[k])), max(slack, abs(s[k]))
    for i in range(n):
        bent = 0.0
        for k in range(n):
            bent += P[i, k] * x[k]
        left[i] = -(bent + q[i] + pulled[i])
        dual, steep = max(dual, abs(left[i])), max(steep, abs(q[i]), abs(bent), abs(pulled[i]))
    worst = primal / (sizes + slack) + dual / steep
    return worst if worst < math.inf else math.inf


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def _held(G: Any, blocks: Any, r: Any, limits: Any, K: Any, right: Any, size: int) -> int:
    """Add to K and `right` what blocks hold, as further rows, and how they bend; return how many rows it is."""
    n = G.shape[1]
    along, across = np.empty(n), np.empty(n)
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        length = _length(r, first, end)
        if r[first] >= length:
            continue
        if r[first] <= -length:
            for i in range(first, end):
                K[size, :n], right[size] = G[i], limits[i]
                size += 1
            continue
        along[:], short = 0.0, 0.0
        for i in range(first + 1, end):
            share = r[i] / length
            short += share * limits[i]
            for k in range(n):
                along[k] += share * G[i, k]
        for k in range(n):
            K[size, k] = HALF * (G[first, k] - along[k])
        right[size] = HALF * (limits[first] - short)
        size += 1
        bend = min((length - r[first]) / (length + r[first]), 1.0 / SOFT)
        for i in range(first + 1, end):
            share = r[i] / length
            lacking = bend * (limits[i] - share * short)
            for k in range(n):
                across[k] = G[i, k] - share * along[k]
            for k in range(n):
                if across[k] != 0.0:
                    right[k] += across[k] * lacking
                    for j in range(k + 1):
                        K[k, j] += bend * across[k] * across[j]
    return size


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def _move(blocks: Any, r: Any, ahead: Any, held: Any) -> None:
    """Move r: along what is free and across by what slacks move, along what is held by its multipliers."""
    at = 0
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        length = _length(r, first, end)
        if r[first] >= length:
            for i in range(first, end):
                r[i] += ahead[i]
        elif r[first] <= -length:
            for i in range(first, end):
                r[i] -= held[at]
                at += 1
        else:
            along = 0.0
            for i in range(first + 1, end):
                along += r[i] / length * ahead[i]
            free, kept = 0.5 * (ahead[first] + along), HALF * held[at]
            at += 1
            ratio = min(2.0 * length / (length + r[first]), 1.0 + 1.0 / SOFT)
            for i in range(first + 1, end):
                share = r[i] / length
                r[i] += share * (free + kept) + ratio * (ahead[i] - share * along)
            r[first] += free - kept


@njit(cache=True, error_model="numpy")
def newton_steps(
    P: Any, q: Any, A: Any, b: Any, G: Any, h: Any, blocks: Any,
    x: Any, y: Any, r: Any, s: Any, z: Any, most: int,
) -> tuple[float, int]:  # fmt: skip
    """Move x, y and r by at most so many steps, and fill s and z; return what is lacking, and steps made."""
    n, e, m = q.shape[0], b.shape[0], h.shape[0]
    K, right, limits = np.empty((n + e + m, n + e + m)), np.empty(n + e + m), np.empty(m)
    before = math.inf
    for used in range(most + 1):
        _project(r, blocks, s, z)
        error = _missing(P, q, A, b, G, h, x, y, s, z, right, limits)
        if used == most or error <= ENOUGH or (error <= NEARLY and not error < 0.5 * before):
            return error, used
        if not error < math.inf:
            return math.inf, used
        before = error
        K[:n, :n], K[n : n + e, :n] = P, A
        size = _held(G, blocks, r, limits, K, right, n + e)
        K[n:size, n:size] = 0.0
        for i in range(size):
            for j in range(i):
                if i < n or j < n:
                    K[j, i] = K[i, j]
            K[i, i] += SOFT if i < n else -SOFT
        found = np.linalg.solve(K[:size, :size].copy(), right[:size].copy())
        for i in range(m):
            for k in range(n):
                limits[i] -= G[i, k] * found[k]
        x += found[:n]
        y += found[n : n + e]
        _move(blocks, r, limits, found[n + e :])
    return math.inf, most
