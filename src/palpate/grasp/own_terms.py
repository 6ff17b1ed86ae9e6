"""Objectives and limits of one's own, as CasADi expressions in the forces: traced once, and sorted.

What is linear, a convex quadratic, or a length below something linear, becomes numbers for `conic`; the rest is
compiled with its derivatives, for `sequential`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp.compiled import BUILDING, Compiled, in_place
from palpate.grasp.coupled_limits import CoupledLimits

__all__ = ["OwnTerms", "Quadratic", "SmoothTerms"]

SX = casadi.SX

SEMIDEFINITE = 1e-12
"""Eigenvalue of a quadratic form, over its largest, down to which it counts as 0: below it is not convex."""

_LESS = (casadi.OP_LE, casadi.OP_LT)

_NO_OPERATION = {casadi.OP_ASSIGN, casadi.OP_CONST, casadi.OP_INPUT, casadi.OP_OUTPUT}

_RATIONAL = _NO_OPERATION | {
    *(casadi.OP_ADD, casadi.OP_SUB, casadi.OP_MUL, casadi.OP_DIV, casadi.OP_NEG, casadi.OP_INV),
    *(casadi.OP_SQ, casadi.OP_TWICE, casadi.OP_POW, casadi.OP_CONSTPOW),
}
"""Of others CasADi may say that they are quadratic, fabs and fmax among them, since their curvature is 0."""

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


class SmoothTerms:
    """What is not convex, or not known to be: an objective, equations and limits <= 0, with derivatives.

    Attributes:
        count: How many equations and limits.
        is_equation: Which of them are = 0, shape (count,).
        names: What a message calls them.
        has_objective: Whether the objective is among it; otherwise that is 0.
    """

    def __init__(
        self, w: Any, objective: Any | None, terms: list[tuple[Any, bool, str]], names: tuple[str, ...]
    ) -> None:
        """Derive and compile."""
        self.count, self.names, self.has_objective = len(terms), names, objective is not None
        self.is_equation = np.array([equation for _, equation, _ in terms], dtype=bool)
        f = SX(0) if objective is None else objective
        g = casadi.vertcat(SX(0, 1), *[term for term, _, _ in terms])
        multipliers = SX.sym("multipliers", self.count)
        lagrangian = f + casadi.dot(multipliers, g)
        wanted = [f, casadi.gradient(f, w), g, casadi.jacobian(g, w), casadi.hessian(lagrangian, w)[0]]
        once: Any = casadi.cse([casadi.densify(each) for each in wanted])
        (function,) = Compiled().prepare([casadi.Function("own_terms", [w, multipliers], once)])
        n = w.numel()
        self._given = np.zeros(n), np.zeros(self.count)
        # CasADi's matrices are column-major
        shapes: list[tuple[int, ...]] = [(1,), (n,), (self.count,), (n, self.count), (n, n)]
        self._found = [np.zeros(shape) for shape in shapes]
        self._call = in_place(function, list(self._given), self._found)

    def __call__(
        self, w: FloatArray, multipliers: FloatArray
    ) -> tuple[float, FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return value and gradient of the objective, the terms, their Jacobian, and the Lagrangian's Hessian.

        Args:
            w: Shape (4 n,).
            multipliers: Shape (count,).
        """
        self._given[0][:], self._given[1][:] = w, multipliers
        self._call()
        f, slope, g, jacobian, hessian = self._found
        return float(f[0]), slope.copy(), g.copy(), jacobian.T.copy(), hessian.copy()


@dataclass(frozen=True, slots=True, eq=False)
class OwnTerms:
    """What somebody wants of the forces.

    Attributes:
        objective: If it is a convex quadratic; None if there is none, or it is smooth.
        limits: Those that are convex.
        smooth: The rest; None if there is none.
    """

    objective: Quadratic | None
    limits: CoupledLimits
    smooth: SmoothTerms | None

    @classmethod
    def traced(
        cls, contacts: int, objective: Callable[[Any], Any] | None, subject_to: Callable[[Any], Any] | None
    ) -> OwnTerms:
        """Call the functions with symbols.

        Args:
            contacts: n.
            objective: Takes w, shape (n, 4); returns what is to be least.
            subject_to: Takes w; returns a list of relations.

        Raises:
            InvalidValueError: One of them raises an error, or returns something else.
        """
        with BUILDING:
            x = SX.sym("w", contacts, 4)
            w = casadi.vec(x.T)
            quadratic = smooth = None
            if objective is not None:
                value = _scalar("objective", _called("objective", objective, x), w)
                quadratic = _convex(value, w)
                smooth = value if quadratic is None else None
            equations, blocks, rest = [], [], []
            for name, relation in _relations(subject_to, x):
                if relation.is_constant() and float(relation) == 1.0:
                    continue  # CasADi knows that it always holds
                lower, upper, equal = _sides(name, relation, w)
                term = lower - upper
                if equal and _is_linear(term, w):
                    equations.append((*_row(term, w), name))
                    continue
                block = None if equal else _block(term, w)
                if block is None:
                    rest.append((term, equal, name))
                else:
                    blocks += [(G, h, name) for G, h in block]
            limits = CoupledLimits.of(contacts, equations, blocks)
            for name, term in [("objective", smooth), *((name, term) for term, _, name in rest)]:
                if term is not None and not _operations(term, w) <= _SMOOTH:
                    raise InvalidValueError(
                        f"{name}: has a kink or a jump (fabs, fmax, fmin, if_else, floor, sign or a comparison), "
                        "where no optimality condition can be checked: state each side as a limit of its own, or "
                        "what is smooth, such as sqrt(x^2 + d^2) for fabs(x)"
                    )
            if smooth is None and not rest:
                return cls(quadratic, limits, None)
            return cls(quadratic, limits, SmoothTerms(w, smooth, rest, tuple(name for _, _, name in rest)))


def _called(name: str, function: Callable[[Any], Any], x: Any) -> Any:
    try:
        return function(x)
    except Exception as error:
        raise InvalidValueError(
            f"{name}: failed when called with the forces, a CasADi SX of shape {x.shape}: {error}; "
            "it must be built of CasADi's functions, without `if` or `and` on forces"
        ) from error


def _scalar(name: str, value: Any, w: Any) -> Any:
    try:
        made = SX(value)
    except (NotImplementedError, TypeError, RuntimeError):
        raise InvalidValueError(
            f"{name}: returned a {type(value).__name__}: must return a CasADi SX expression in the forces"
        ) from None
    if made.numel() != 1:
        raise InvalidValueError(f"{name}: returned shape {made.shape}: must return one number, shape (1, 1)")
    foreign = [str(each) for each in casadi.symvar(made) if not casadi.depends_on(w, each)]
    if foreign:
        raise InvalidValueError(f"{name}: has symbols {foreign} that are no forces; give numbers for them")
    if made.is_constant() and not math.isfinite(float(made)):
        raise InvalidValueError(f"{name}: is {float(made)}: must be finite")
    return made


def _relations(subject_to: Callable[[Any], Any] | None, x: Any) -> Iterable[tuple[str, Any]]:
    if subject_to is None:
        return
    given = _called("subject_to", subject_to, x)
    if not isinstance(given, list | tuple):
        raise InvalidValueError(f"subject_to: returned a {type(given).__name__}: must return a list of relations")
    for i, each in enumerate(given):
        name = f"subject_to[{i}]"
        if not isinstance(each, SX):
            raise InvalidValueError(
                f"{name}: is a {type(each).__name__}: must be a relation of the forces, such as w[0, 0] <= 5"
            )
        if each.numel() == 1:
            yield name, each
        else:
            yield from ((f"{name}[{k}]", casadi.vec(casadi.densify(each))[k]) for k in range(each.numel()))


def _sides(name: str, relation: Any, w: Any) -> tuple[Any, Any, bool]:
    """Return (a, b, whether equal) of a <= b or a == b."""
    if relation.is_constant() and float(relation) == 0.0:
        raise InvalidValueError(f"{name}: does not hold, whatever the forces; CasADi has simplified it to 0")
    equal = relation.is_op(casadi.OP_EQ)
    if not equal and not any(relation.is_op(each) for each in _LESS):
        raise InvalidValueError(
            f"{name} = {relation}: must be a relation of the forces by <=, >= or ==, such as w[0, 0] <= 5"
        )
    return _scalar(name, relation.dep(0), w), _scalar(name, relation.dep(1), w), equal


def _operations(term: Any, w: Any) -> set[int]:
    function = casadi.Function("term", [w], [term])
    return {function.instruction_id(k) for k in range(function.n_instructions())}


def _is_linear(term: Any, w: Any) -> bool:
    return bool(casadi.is_linear(term, w)) and _operations(term, w) <= _RATIONAL


def _is_quadratic(term: Any, w: Any) -> bool:
    return bool(casadi.is_quadratic(term, w)) and _operations(term, w) <= _RATIONAL


def _row(term: Any, w: Any) -> tuple[FloatArray, float]:
    """Return a and b of a'w - b."""
    slope, constant = casadi.linear_coeff(term, w)
    return casadi.DM(slope).full().ravel(), -float(constant)


def _form(term: Any, w: Any) -> tuple[FloatArray, FloatArray, float]:
    P, q, c = casadi.quadratic_coeff(term, w)
    square = casadi.DM(P).full()
    return 0.5 * (square + square.T), casadi.DM(q).full().ravel(), float(casadi.DM(c))


def _convex(term: Any, w: Any) -> Quadratic | None:
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


def _block(term: Any, w: Any) -> list[tuple[FloatArray, FloatArray]] | None:
    """Return term <= 0 as h - G w in cones, if it is linear, a convex quadratic, or has one length or size."""
    if _is_linear(term, w):
        row, limit = _row(term, w)
        return [(row[None], np.array([limit]))]
    if _is_quadratic(term, w):
        return _below(*_form(term, w))
    curved, linear = [], SX(0)
    for factor, part in _summands(term):
        if _is_linear(part, w):
            linear += factor * part
        else:
            curved.append((factor, part))
    if len(curved) != 1 or curved[0][0] <= 0.0:
        return None
    ((factor, part),) = curved
    row, limit = _row(linear, w)
    if part.is_op(casadi.OP_FABS) and _is_linear(part.dep(0), w):
        size, zero = _row(part.dep(0), w)
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
