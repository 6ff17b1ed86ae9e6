"""Factors L D L' of a contact's 4 x 4 curvature, updated by rows as stiff as may be, symbolically."""

from __future__ import annotations

from typing import Any

import casadi

from palpate.grasp.cone_scaling import reciprocal
from palpate.grasp.statement import FORCES

__all__ = ["forward", "solved", "update", "with_pivots"]

SX = casadi.SX


def update(lower: Any, pivots: list[Any], size: Any, direction: Any) -> None:
    """Turn factors L D L' of K into those of K + size d d' (Gill, Golub, Murray & Saunders 1974, method C1).

    Pivots are sums of positive numbers, however stiff the update; known zeros cost nothing.
    """
    known = [direction.sparsity().has_nz(i, 0) for i in range(FORCES)]
    left = [direction[i] for i in range(FORCES)]
    for j in range(FORCES):
        if not known[j]:
            continue
        share = left[j]
        pivot = pivots[j] + size * share**2
        over = size * reciprocal(pivot)
        gain, size = share * over, pivots[j] * over
        pivots[j] = pivot
        for i in range(j + 1, FORCES):
            if lower.sparsity().has_nz(i, j):
                left[i] = left[i] - share * lower[i, j]
                known[i] = True
            if known[i]:
                lower[i, j] = lower[i, j] + gain * left[i]


def with_pivots(lower: Any, pivots: list[Any]) -> Any:
    """L with 1 / D on its diagonal."""
    out = SX(lower)
    for i in range(FORCES):
        out[i, i] = reciprocal(pivots[i])
    return out


def forward(lower: Any, right: Any) -> Any:
    """Return L^-1 right, (4,)."""
    out: list[Any] = []
    for i in range(FORCES):
        known = [k for k in range(i) if lower.sparsity().has_nz(i, k)]
        out.append(right[i] - sum(lower[i, k] * out[k] for k in known))
    return casadi.vertcat(*out)


def solved(lower: Any, right: Any) -> Any:
    """Return K^-1 right, (4,), of factors `with_pivots`."""
    half = forward(lower, right)
    out = [half[i] * lower[i, i] for i in range(FORCES)]
    for i in range(FORCES - 1, -1, -1):
        for k in range(i + 1, FORCES):
            if lower.sparsity().has_nz(k, i):
                out[i] = out[i] - lower[k, i] * out[k]
    return casadi.vertcat(*out)
