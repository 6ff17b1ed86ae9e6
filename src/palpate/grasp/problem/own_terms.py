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
from palpate.grasp.problem.convex_forms import (
    Quadratic,
    convex_block,
    convex_quadratic,
    is_linear,
    is_smooth,
    row_of,
)
from palpate.grasp.problem.limits import CoupledLimits
from palpate.grasp.solvers.compiled import BUILDING, in_place, machine_code

__all__ = ["OwnTerms", "SmoothTerms"]

SX = casadi.SX


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
        function = machine_code(casadi.Function("own_terms", [w, multipliers], once))
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


_LESS = (casadi.OP_LE, casadi.OP_LT)


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
                quadratic = convex_quadratic(value, w)
                smooth = value if quadratic is None else None
            equations, blocks, rest = [], [], []
            for name, relation in _relations(subject_to, x):
                if relation.is_constant() and float(relation) == 1.0:
                    continue  # CasADi knows that it always holds
                lower, upper, equal = _sides(name, relation, w)
                term = lower - upper
                if equal and is_linear(term, w):
                    equations.append((*row_of(term, w), name))
                    continue
                block = None if equal else convex_block(term, w)
                if block is None:
                    rest.append((term, equal, name))
                else:
                    blocks += [(G, h, name) for G, h in block]
            limits = CoupledLimits.of(contacts, equations, blocks)
            for name, term in [("objective", smooth), *((name, term) for term, _, name in rest)]:
                if term is not None and not is_smooth(term, w):
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
