"""Which CasADi expressions are convex, and as which numbers: linear, quadratic, or a length or size in a sum.

What CasADi says of an expression is taken only where all its operations are known: of others it may say that they
are quadratic, since their curvature is 0.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from palpate.errors import FloatArray

__all__ = ["Quadratic", "convex_block", "convex_quadratic", "is_linear", "is_smooth", "row_of"]

SX = casadi.SX

SEMIDEFINITE = 1e-12
"""Eigenvalue of a quadratic form, over its largest, down to which it counts as 0: below it is not convex."""

_NO_OPERATION = {casadi.OP_ASSIGN, casadi.OP_CONST, casadi.OP_INPUT, casadi.OP_OUTPUT}

_RATIONAL = _NO_OPERATION | {
    *(casadi.OP_ADD, casadi.OP_SUB, casadi.OP_MUL, casadi.OP_DIV, casadi.OP_NEG, casadi.OP_INV),
    *(casadi.OP_SQ, casadi.OP_TWICE, casadi.OP_POW, casadi.OP_CONSTPOW),
}
"""fabs and fmax are not among them."""

_SMOOTH = _RATIONAL | {
    *(casadi.OP_EXP, casadi.OP_LOG, casadi.OP_SQRT, casadi.OP_EXPM1, casadi.OP_LOG1P, casadi.OP_ERF),
    *(casadi.OP_SIN, casadi.OP_COS, casadi.OP_TAN, casadi.OP_ASIN, casadi.OP_ACOS, casadi.OP_ATAN),
    *(casadi.OP_SINH, casadi.OP_COSH, casadi.OP_TANH, casadi.OP_ASINH, casadi.OP_ACOSH, casadi.OP_ATANH),
    *(casadi.OP_ATAN2, casadi.OP_HYPOT),
}


@dataclass(frozen=True, slots=True, eq=False)
class Quadratic:
    """w'P w / 2 + q'w + c.

    Attributes:
        P: Positive semidefinite, shape (4 n, 4 n).
        q: Shape (4 n,).
        c: Constant.
    """

    P: FloatArray
    q: FloatArray
    c: float

    def __call__(self, w: FloatArray) -> float:
        """Return its value."""
        return float(0.5 * w @ self.P @ w + self.q @ w + self.c)


def _operations(term: Any, w: Any) -> set[int]:
    function = casadi.Function("term", [w], [term])
    return {function.instruction_id(k) for k in range(function.n_instructions())}


def is_smooth(term: Any, w: Any) -> bool:
    """Return whether it has derivatives wherever it has a value."""
    return _operations(term, w) <= _SMOOTH


def is_linear(term: Any, w: Any) -> bool:
    """Return whether it is linear, and known to be."""
    return bool(casadi.is_linear(term, w)) and _operations(term, w) <= _RATIONAL


def _is_quadratic(term: Any, w: Any) -> bool:
    return bool(casadi.is_quadratic(term, w)) and _operations(term, w) <= _RATIONAL


def row_of(term: Any, w: Any) -> tuple[FloatArray, float]:
    """Return a and b of a'w - b."""
    slope, constant = casadi.linear_coeff(term, w)
    return casadi.DM(slope).full().ravel(), -float(constant)


def _form(term: Any, w: Any) -> tuple[FloatArray, FloatArray, float]:
    P, q, c = casadi.quadratic_coeff(term, w)
    square = casadi.DM(P).full()
    return 0.5 * (square + square.T), casadi.DM(q).full().ravel(), float(casadi.DM(c))


def convex_quadratic(term: Any, w: Any) -> Quadratic | None:
    """Return an expression as a convex quadratic, if it is one."""
    if not _is_quadratic(term, w):
        return None
    form = Quadratic(*_form(term, w))
    return None if _factor(form.P) is None else form


def _factor(P: FloatArray) -> FloatArray | None:
    """Return L with L'L = P, shape (rank, N); None if P is not positive semidefinite."""
    values, vectors = np.linalg.eigh(P)
    if not np.isfinite(P).all() or values[0] < -SEMIDEFINITE * max(values[-1], 0.0):
        return None
    kept = values > SEMIDEFINITE * values[-1]
    return np.asarray(np.sqrt(values[kept])[:, None] * vectors[:, kept].T)


def convex_block(term: Any, w: Any) -> list[tuple[FloatArray, FloatArray]] | None:
    """Return term <= 0 as h - G w in cones, if it is linear, a convex quadratic, or has one length or size."""
    if is_linear(term, w):
        row, limit = row_of(term, w)
        return [(row[None], np.array([limit]))]
    if _is_quadratic(term, w):
        return _below(*_form(term, w))
    curved, linear = [], SX(0)
    for factor, part in _summands(term):
        if is_linear(part, w):
            linear += factor * part
        else:
            curved.append((factor, part))
    if len(curved) != 1 or curved[0][0] <= 0.0:
        return None
    ((factor, part),) = curved
    row, limit = row_of(linear, w)
    if part.is_op(casadi.OP_FABS) and is_linear(part.dep(0), w):
        size, zero = row_of(part.dep(0), w)
        return [((row + a * size)[None], np.array([limit + a * zero])) for a in (factor, -factor)]
    if part.is_op(casadi.OP_SQRT) and _is_quadratic(part.dep(0), w):
        P, q, c = _form(part.dep(0), w)
        # w'P w / 2 + q'w + c = |L (w, 1)|^2
        length = _factor(np.block([[0.5 * P, 0.5 * q[:, None]], [0.5 * q[None], np.array([[c]])]]))
        if length is not None:
            rows = np.concatenate([row[None], -factor * length[:, :-1]])
            return [(rows, np.append(limit, factor * length[:, -1]))]
    return None


def _below(P: FloatArray, q: FloatArray, c: float) -> list[tuple[FloatArray, FloatArray]] | None:
    """Return w'P w / 2 + q'w + c <= 0 as a cone: with t = -(q'w + c), |(2 L w, t / k - k)| <= t / k + k."""
    length = _factor(0.5 * P)
    if length is None:
        return None
    k = math.sqrt(abs(c)) or math.sqrt(float(np.abs(q).max())) or 1.0
    G = np.concatenate([q[None] / k, -2.0 * length, q[None] / k])
    return [(G, np.concatenate([[k - c / k], np.zeros(len(length)), [-c / k - k]]))]


def _summands(term: Any) -> Iterable[tuple[float, Any]]:
    """Split a sum into (factor, expression)."""
    left = [(1.0, term)]
    while left:
        factor, part = left.pop()
        if part.is_op(casadi.OP_NEG):
            left.append((-factor, part.dep(0)))
        elif part.is_op(casadi.OP_ADD) or part.is_op(casadi.OP_SUB):
            left += [(factor, part.dep(0)), (factor if part.is_op(casadi.OP_ADD) else -factor, part.dep(1))]
        elif part.is_op(casadi.OP_TWICE):
            left.append((2.0 * factor, part.dep(0)))
        elif part.is_op(casadi.OP_MUL) and part.dep(0).is_constant():
            left.append((factor * float(part.dep(0)), part.dep(1)))
        else:
            yield factor, part
