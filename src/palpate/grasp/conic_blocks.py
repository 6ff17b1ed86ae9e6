"""Blocks of limits in the interior point method for coupled limits: numbers >= 0, and second-order cones.

A block is a run of rows of s, (s0, s1..) with s0 >= |(s1..)|; of one row, s0 >= 0. Its scaling W (Nesterov & Todd
1997) with W z = W^-1 s is kept as a unit hyperbolic vector w and a factor eta (see Andersen, Dahl & Vandenberghe,
"The CVXOPT linear and quadratic cone program solvers", 2010).
"""

import math
from typing import Any

from palpate.compiling import njit

__all__ = ["SUMS", "blocked", "divided", "multiplied", "room", "scale", "scaled", "unscaled"]


SUMS = {"reassoc", "contract", "nsz"}
"""Sums may be taken in any order, the same every time: a third faster."""


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def room(v: Any, first: int, end: int) -> float:
    """Return v0 - |v1..| of a block: above zero inside."""
    length = 0.0
    for i in range(first + 1, end):
        length += v[i] * v[i]
    return float(v[first] - math.sqrt(length))


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def _root(v: Any, first: int, end: int) -> float:
    """Return sqrt(v0^2 - |v1..|^2) of a point inside, as a product so that little cancels."""
    left = room(v, first, end)
    return math.sqrt(max(left * (2.0 * v[first] - left), 1e-300))


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def scale(s: Any, z: Any, blocks: Any, w: Any, eta: Any, middle: Any) -> None:
    """Fill w and eta of each block, and middle = W z, for s and z inside."""
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        if end == first + 1:
            eta[b], w[first] = math.sqrt(s[first] / z[first]), 1.0
            middle[first] = math.sqrt(s[first] * z[first])
            continue
        root_s, root_z = _root(s, first, end), _root(z, first, end)
        product = s[first] * z[first]
        for i in range(first + 1, end):
            product += s[i] * z[i]
        half = 0.5 / math.sqrt(0.5 * (1.0 + product / (root_s * root_z)))
        w[first] = half * (s[first] / root_s + z[first] / root_z)
        for i in range(first + 1, end):
            w[i] = half * (s[i] / root_s - z[i] / root_z)
        eta[b] = math.sqrt(root_s / root_z)
    scaled(w, eta, blocks, z, middle)


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def _turned(w: Any, side: float, v: Any, first: int, end: int, out: Any) -> None:
    """Fill a block of out with W v / eta for `side` = 1, with eta W^-1 v for -1: w's tail changes its sign."""
    along = 0.0
    for i in range(first + 1, end):
        along += w[i] * v[i]
    head = v[first]
    share = along / (1.0 + w[first]) + side * head
    out[first] = w[first] * head + side * along
    for i in range(first + 1, end):
        out[i] = v[i] + share * w[i]


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def scaled(w: Any, eta: Any, blocks: Any, v: Any, out: Any) -> None:
    """Fill out = W v; out may be neither v nor w."""
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        _turned(w, 1.0, v, first, end, out)
        for i in range(first, end):
            out[i] *= eta[b]


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def unscaled(w: Any, eta: Any, blocks: Any, v: Any, out: Any) -> None:
    """Fill out = W^-1 v; out may be neither v nor w."""
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        _turned(w, -1.0, v, first, end, out)
        for i in range(first, end):
            out[i] /= eta[b]


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def multiplied(u: Any, v: Any, blocks: Any, out: Any) -> None:
    """Fill out = u o v, the product of the cones' algebra; out may be neither."""
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        total = u[first] * v[first]
        for i in range(first + 1, end):
            total += u[i] * v[i]
            out[i] = u[first] * v[i] + v[first] * u[i]
        out[first] = total


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def divided(u: Any, v: Any, blocks: Any, out: Any) -> None:
    """Fill out with what u o out = v, for u inside; out may not be v."""
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        if end == first + 1:
            out[first] = v[first] / u[first]
            continue
        along = 0.0
        for i in range(first + 1, end):
            along += u[i] * v[i]
        head = (u[first] * v[first] - along) / _root(u, first, end) ** 2
        out[first] = head
        for i in range(first + 1, end):
            out[i] = (v[i] - head * u[i]) / u[first]


@njit(cache=True, error_model="numpy", fastmath=SUMS)
def blocked(middle: Any, step: Any, blocks: Any) -> float:
    """Return 1 / the longest step from `middle` that stays inside; 0 or less if none ends there."""
    worst = 0.0
    for b in range(blocks.shape[0] - 1):
        first, end = blocks[b], blocks[b + 1]
        if end == first + 1:
            worst = max(worst, -step[first] / middle[first])
            continue
        root = _root(middle, first, end)
        head = middle[first] * step[first]
        for i in range(first + 1, end):
            head -= middle[i] * step[i]
        head /= root
        share = (head + step[first]) / (middle[first] / root + 1.0)
        length = 0.0
        for i in range(first + 1, end):
            length += (step[i] - share * middle[i] / root) ** 2
        worst = max(worst, (math.sqrt(length) - head) / root)
    return worst
