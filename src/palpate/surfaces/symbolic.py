"""A fingertip from a symbolic expression: derivatives by CasADi, compiled by numba.

CasADi's virtual machine costs a third of a microsecond a call, and its C code needs a compiler on the user's
machine. Its expression graph is a short list of elementary instructions, though: written out as a Python function
it compiles with numba like any other.
"""

import math
from dataclasses import dataclass, field
from typing import Any, cast

import casadi
import numpy as np

from palpate.compiling import njit
from palpate.errors import InvalidValueError, positive
from palpate.surfaces.implicit import Evaluate, Implicit, check_shape

_UNARY = {
    casadi.OP_NEG: "-{0}",
    casadi.OP_EXP: "math.exp({0})",
    casadi.OP_LOG: "math.log({0})",
    casadi.OP_SQRT: "math.sqrt({0})",
    casadi.OP_SQ: "{0} * {0}",
    casadi.OP_TWICE: "2.0 * {0}",
    casadi.OP_SIN: "math.sin({0})",
    casadi.OP_COS: "math.cos({0})",
    casadi.OP_TAN: "math.tan({0})",
    casadi.OP_ASIN: "math.asin({0})",
    casadi.OP_ACOS: "math.acos({0})",
    casadi.OP_ATAN: "math.atan({0})",
    casadi.OP_SINH: "math.sinh({0})",
    casadi.OP_COSH: "math.cosh({0})",
    casadi.OP_TANH: "math.tanh({0})",
    casadi.OP_FABS: "abs({0})",
    casadi.OP_INV: "1.0 / {0}",
    casadi.OP_SIGN: "(0.0 if {0} == 0.0 else math.copysign(1.0, {0}))",
    casadi.OP_NOT: "(1.0 if {0} == 0.0 else 0.0)",
    casadi.OP_ASSIGN: "{0}",
}
_BINARY = {
    casadi.OP_ADD: "{0} + {1}",
    casadi.OP_SUB: "{0} - {1}",
    casadi.OP_MUL: "{0} * {1}",
    casadi.OP_DIV: "{0} / {1}",
    casadi.OP_POW: "{0} ** {1}",
    casadi.OP_CONSTPOW: "{0} ** {1}",
    casadi.OP_FMIN: "min({0}, {1})",
    casadi.OP_FMAX: "max({0}, {1})",
    casadi.OP_ATAN2: "math.atan2({0}, {1})",
    casadi.OP_HYPOT: "math.hypot({0}, {1})",
    casadi.OP_LT: "(1.0 if {0} < {1} else 0.0)",
    casadi.OP_LE: "(1.0 if {0} <= {1} else 0.0)",
    casadi.OP_EQ: "(1.0 if {0} == {1} else 0.0)",
    casadi.OP_NE: "(1.0 if {0} != {1} else 0.0)",
    casadi.OP_IF_ELSE_ZERO: "({1} if {0} != 0.0 else 0.0)",
    casadi.OP_COPYSIGN: "math.copysign({0}, {1})",
}
"""Instructions of CasADi's scalar graphs (casadi/core/calculus.hpp) as Python expressions."""

LARGEST_GRAPH = 20_000
"""More instructions than this take minutes to compile."""


@dataclass(frozen=True, eq=False, repr=False)
class SymbolicSurface(Implicit):
    """A convex surface given by a CasADi expression that is negative inside, in the surface's own frame.

    Args:
        point: The symbol that the expression is written in, `casadi.SX.sym("point", 3)`.
        value: Scalar expression of it, below 0 inside, 0 on the surface, twice differentiable.
        size: About the tip's radius [m]; a factor of ten more or less does no harm.
        center: A point inside, the origin of the expression's frame, in the sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: Not a scalar SX expression of the point, an unknown operation, or what
            `ImplicitSurface` refuses.
    """

    point: Any = field(repr=False)
    value: Any
    size: float = 0.01

    def __post_init__(self) -> None:
        size = positive("size", self.size, "m")
        if not isinstance(self.point, casadi.SX) or self.point.shape != (3, 1):
            raise InvalidValueError(f'point = {self.point!r}: must be casadi.SX.sym("point", 3)')
        if not isinstance(self.value, casadi.SX) or self.value.shape != (1, 1):
            raise InvalidValueError(f"value = {self.value!r}: must be a scalar casadi.SX expression of the point")
        hessian, gradient = casadi.hessian(self.value, self.point)
        second = [hessian[0, 0], hessian[1, 1], hessian[2, 2], hessian[1, 2], hessian[0, 2], hessian[0, 1]]
        outputs = casadi.vertcat(self.value, gradient, *second)
        try:
            function = casadi.Function("surface", [self.point], [casadi.densify(outputs)])
        except RuntimeError as error:
            raise InvalidValueError(f"value = {self.value}: must be of the point alone ({error})") from None
        evaluate = compiled(function)
        check_shape(evaluate, np.empty(0), size)
        self._settle(evaluate, np.empty(0), size)


def compiled(function: Any) -> Evaluate:
    """Return a CasADi function of one 3-vector as a compiled `Evaluate`.

    Args:
        function: Of one input (3,) and one dense output (10,), made of SX.

    Raises:
        InvalidValueError: It is too long, or has an operation that is not known here.
    """
    if function.n_instructions() > LARGEST_GRAPH:
        raise InvalidValueError(
            f"value has {function.n_instructions()} instructions with its derivatives: at most {LARGEST_GRAPH}"
        )
    names: dict[str, Any] = {"math": math, "__name__": __name__}
    lines = ["def evaluate(parameters, x, y, z):"]
    outputs = ["0.0"] * 10
    for i in range(function.n_instructions()):
        operation = function.instruction_id(i)
        given, made = function.instruction_input(i), function.instruction_output(i)
        if operation == casadi.OP_INPUT:
            lines.append(f"    w{made[0]} = {'xyz'[given[1]]}")
        elif operation == casadi.OP_OUTPUT:
            outputs[made[1]] = f"o{made[1]}"
            lines.append(f"    o{made[1]} = w{given[0]}")
        elif operation == casadi.OP_CONST:
            lines.append(f"    w{made[0]} = {function.instruction_constant(i)!r}")
        elif operation in _UNARY:
            lines.append(f"    w{made[0]} = {_UNARY[operation].format(f'w{given[0]}')}")
        elif operation in _BINARY:
            lines.append(f"    w{made[0]} = {_BINARY[operation].format(f'w{given[0]}', f'w{given[1]}')}")
        else:
            raise InvalidValueError(
                f"value uses CasADi operation {operation}, which has no smooth counterpart here: rewrite it with "
                "sums, products, powers, roots, exponentials or trigonometric functions"
            )
    lines.append(f"    return ({', '.join(outputs)})")
    exec("\n".join(lines), names)
    function_of_point: Any = names["evaluate"]
    return cast(Evaluate, njit(error_model="numpy")(function_of_point))
