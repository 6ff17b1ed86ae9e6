"""Error-free transformations and double-double arithmetic, compiled.

A double-double is an unevaluated sum high + low of two float64 with |low| <= ulp(high)/2: about 106 bits. The
algorithms are those of Dekker (1971), Knuth (TAOCP 2, section 4.2.2) and Ogita, Rump & Oishi (2005, "Accurate
sum and dot product"). Every function is branch-free, so that loops over them vectorise; none may be compiled
with fastmath, which would cancel the error terms.
"""

from typing import Any

from llvmlite import ir
from numba import types

from palpate.compiling import njit
from palpate.sensing.kernels.intrinsic import intrinsic


@intrinsic
def fma(typing_context: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a b + c with one rounding (Python has math.fma from 3.13 on only)."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


@intrinsic
def bits(typing_context: Any, value: Any) -> Any:
    """Return the bit pattern of a float64 as an int64."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.IntType(64))

    return types.int64(types.float64), generate


@intrinsic
def from_bits(typing_context: Any, pattern: Any) -> Any:
    """Return the float64 with this bit pattern."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.bitcast(arguments[0], ir.DoubleType())

    return types.float64(types.int64), generate


@njit(error_model="numpy")
def power_of_two(exponent):
    """Return 2^exponent, for -1022 <= exponent <= 1023; 0 below, and 2^1023 above."""
    return from_bits(max(min(exponent + 1023, 2046), 0) << 52)


@njit(error_model="numpy")
def two_sum(a, b):
    """Return (s, e): s = fl(a + b) and s + e = a + b exactly."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@njit(error_model="numpy")
def fast_two_sum(a, b):
    """Return (s, e) as `two_sum`, for |a| >= |b| or a = 0."""
    s = a + b
    return s, b - (s - a)


@njit(error_model="numpy")
def two_product(a, b):
    """Return (p, e): p = fl(a b) and p + e = a b exactly, barring underflow."""
    p = a * b
    return p, fma(a, b, -p)


@njit(error_model="numpy")
def multiply(ah, al, bh, bl):
    """Return the double-double product of two double-doubles, not renormalised."""
    p = ah * bh
    return p, fma(ah, bl, fma(al, bh, fma(ah, bh, -p)))


@njit(error_model="numpy")
def square(ah, al):
    """Return the double-double square of a double-double, not renormalised."""
    p = ah * ah
    return p, fma(2.0 * ah, al, fma(ah, ah, -p))


@njit(error_model="numpy")
def add(ah, al, bh, bl):
    """Return a + b of two double-doubles, not renormalised: the absolute error is of order u^2 (|a| + |b|)."""
    s, e = two_sum(ah, bh)
    return s, e + (al + bl)
