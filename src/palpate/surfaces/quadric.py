"""Centred quadrics: spheres, ellipsoids, cylinders, slabs, as one family.

In its own axes, about its centre, every one of them is (x/a)^2 + (y/b)^2 + (z/c)^2 = 1, where a semi-axis may
be infinite. The contact solver works from coefficients that are derived here once, when a fingertip is built.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from fractions import Fraction

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, rotation_matrix, vector
from palpate.surfaces.shown import Shown

LARGEST_ASPECT_RATIO = 1e60
"""Of finite semi-axes. Beyond it the squares of the coefficients leave float64, and nothing is known with 60
digits: an infinite semi-axis is meant."""


SMALLEST, LARGEST = 1e-120, 1e120
"""Finite semi-axes [m]: keeps the powers of two that scale lengths and wrenches within float64."""


class Packed(IntEnum):
    """Where the coefficients of a quadric stand in its packed array.

    Lengths are in units of 2^LENGTH_EXPONENT m, which makes the smallest semi-axis lie in [1, 2). Every
    coefficient is an unevaluated sum high + low of two float64 (double-double), correct to 106 bits.
    """

    LENGTH_EXPONENT = 0
    ALIGNED = 1
    """1 when centre and rotation are those of the sensor frame."""
    CENTER = 2
    """3 entries."""
    ROTATION = 5
    """9 entries, row by row: columns are the surface's axes."""
    A = 14
    """diag(A), A = 1/semi-axis: 3 high parts, then 3 low parts; likewise all below."""
    A_SQUARED = 20
    COFACTOR = 26
    """Diagonal of the cofactor matrix of A."""
    COFACTOR_SQUARED = 32
    DETERMINANT = 38
    """det A: high, low; zero for unbounded surfaces."""
    DETERMINANT_INVERSE = 40
    """1/det A: high, low; zero where det A is zero."""
    SIZE = 42


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class CenteredQuadric(Shown, ABC):
    """A surface (R'(x - center))' diag(1/semi_axes^2) (R'(x - center)) = 1 in sensor coordinates.

    Attributes:
        center: Centre of the surface in the sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).
        packed: Coefficients for the contact solver, laid out as `Packed` says.
    """

    center: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    packed: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("center", self.center, 3, "m"))
        object.__setattr__(self, "rotation", rotation_matrix("rotation", self.rotation))
        object.__setattr__(self, "packed", _pack(self.half_lengths, self.center, self.rotation))

    @property
    @abstractmethod
    def half_lengths(self) -> tuple[float, float, float]:
        """Semi-axes along the surface's own axes [m]; infinite where it is unbounded."""


def pack_frame(packed: FloatArray, length_exponent: int, center: FloatArray, rotation: FloatArray) -> None:
    """Write unit of length and frame of a surface into the first entries of its packed coefficients."""
    packed[Packed.LENGTH_EXPONENT] = length_exponent
    packed[Packed.ALIGNED] = not center.any() and bool((rotation == np.eye(3)).all())
    packed[Packed.CENTER : Packed.CENTER + 3] = np.ldexp(center, -length_exponent)
    packed[Packed.ROTATION : Packed.ROTATION + 9] = rotation.ravel()


def _pack(semi_axes: Sequence[float], center: FloatArray, rotation_sensor_surface: FloatArray) -> FloatArray:
    finite = [length for length in semi_axes if math.isfinite(length)]
    if not finite:
        raise InvalidValueError(f"semi_axes = {tuple(semi_axes)} m: at least one must be finite")
    if min(finite) < SMALLEST or max(finite) > LARGEST:
        raise InvalidValueError(
            f"semi_axes = {tuple(semi_axes)} m: must lie between {SMALLEST:g} m and {LARGEST:g} m, or be infinite"
        )
    if max(finite) / min(finite) > LARGEST_ASPECT_RATIO:
        raise InvalidValueError(
            f"semi_axes = {tuple(semi_axes)} m: the longest is {max(finite) / min(finite):.0e} times the "
            f"shortest, the limit is {LARGEST_ASPECT_RATIO:.0e}; make it infinite"
        )
    length_exponent = math.frexp(min(finite))[1] - 1
    length_unit = Fraction(2) ** length_exponent

    A = [length_unit / Fraction(length) if math.isfinite(length) else Fraction(0) for length in semi_axes]
    cofactor = [A[1] * A[2], A[0] * A[2], A[0] * A[1]]
    determinant = A[0] * A[1] * A[2]

    packed = np.zeros(Packed.SIZE)
    pack_frame(packed, length_exponent, center, rotation_sensor_surface)
    for start, coefficients in (
        (Packed.A, A),
        (Packed.A_SQUARED, [a * a for a in A]),
        (Packed.COFACTOR, cofactor),
        (Packed.COFACTOR_SQUARED, [c * c for c in cofactor]),
        (Packed.DETERMINANT, [determinant]),
        (Packed.DETERMINANT_INVERSE, [1 / determinant if determinant else Fraction(0)]),
    ):
        for i, exact in enumerate(coefficients):
            high = float(exact)
            packed[start + i] = high
            packed[start + i + len(coefficients)] = float(exact - Fraction(high))
    packed.setflags(write=False)
    return packed
