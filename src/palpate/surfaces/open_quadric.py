"""Convex quadrics that open downwards: an elliptic paraboloid, one sheet of a two-sheet hyperboloid.

In its own frame, apex at the origin, each is x^2/a^2 + y^2/b^2 + beta z^2 + 2 eta z = 0 with beta <= 0 < eta. Its
projective matrix has signature (3, 1): a 4x4 matrix T maps the unit sphere's homogeneous coordinates to it, and
with them the contact problem (`palpate.sensing.kernels.projective`).
"""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from enum import IntEnum

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, positive, rotation_matrix, vector
from palpate.surfaces.quadric import pack_frame
from palpate.surfaces.shown import Shown

SMALLEST, LARGEST = 1e-60, 1e60
"""Lengths [m] whose squares and their ratios stay within float64."""


class PackedProjective(IntEnum):
    """Where the coefficients of an open quadric stand, behind unit and frame, which stand as in `Packed`."""

    SCALE_X = 14
    """a: x = a y_1."""
    SCALE_Y = 15
    """b: y = b y_2."""
    MIX = 16
    """p, q, r, s: z = p y_3 + q y_4 and w = r y_3 + s y_4, with w > 0 on the wanted sheet."""
    BETA = 20
    ETA = 21
    SIZE = 22


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class OpenQuadric(Shown, ABC):
    """A convex quadric with its apex at `center`, opening along -z of its own frame.

    Attributes:
        center: The apex, sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).
        packed: Coefficients for the contact solver, laid out as `PackedProjective` says.
    """

    center: FloatArray = field(default_factory=lambda: np.zeros(3))
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    packed: FloatArray = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "center", vector("center", self.center, 3, "m"))
        object.__setattr__(self, "rotation", rotation_matrix("rotation", self.rotation))
        a, b, beta, eta = self.coefficients
        length_exponent = int(np.frexp(min(a, b))[1]) - 1
        unit = 2.0**length_exponent
        packed = np.zeros(PackedProjective.SIZE)
        pack_frame(packed, length_exponent, self.center, self.rotation)
        # in the surface's unit of length: a/unit, and beta, eta of the equation divided by nothing else
        beta, eta = beta * unit**2, eta * unit
        packed[PackedProjective.SCALE_X] = a / unit
        packed[PackedProjective.SCALE_Y] = b / unit
        packed[PackedProjective.MIX : PackedProjective.MIX + 4] = _mix(beta, eta)
        packed[PackedProjective.BETA] = beta
        packed[PackedProjective.ETA] = eta
        packed.setflags(write=False)
        object.__setattr__(self, "packed", packed)

    @property
    @abstractmethod
    def coefficients(self) -> tuple[float, float, float, float]:
        """A [m], b [m], beta [1/m^2], eta [1/m] of x^2/a^2 + y^2/b^2 + beta z^2 + 2 eta z = 0."""


def _mix(beta: float, eta: float) -> FloatArray:
    """Return (p, q, r, s): columns (p, r), (q, s) turn [[beta, eta], [eta, 0]] into diag(1, -1)."""
    values, vectors = np.linalg.eigh(np.array([[beta, eta], [eta, 0.0]]))
    minus, plus = vectors[:, 0] / np.sqrt(-values[0]), vectors[:, 1] / np.sqrt(values[1])
    mix = np.column_stack([plus, minus])
    # the apex, z = 0 and w = 1, shall have y_4 > 0: then w > 0 for y_4 = 1 on its sheet
    if np.linalg.solve(mix, [0.0, 1.0])[1] < 0.0:
        mix[:, 1] = -mix[:, 1]
    return mix.ravel()


@dataclass(frozen=True, eq=False, repr=False)
class Paraboloid(OpenQuadric):
    """An elliptic paraboloid z = -x^2/(2 R_1) - y^2/(2 R_2).

    Args:
        radii: Radii of curvature R_1, R_2 at the apex [m].
        center: The apex, sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: A radius is not a finite number above zero.
    """

    radii: tuple[float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "radii", _lengths("radii", self.radii, 2))
        super().__post_init__()

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """See `OpenQuadric`: a^2 = R_1 R, b^2 = R_2 R, eta = 1/R with R = sqrt(R_1 R_2)."""
        mean = float(np.sqrt(self.radii[0]) * np.sqrt(self.radii[1]))
        a, b = (float(np.sqrt(radius) * np.sqrt(mean)) for radius in self.radii)
        return a, b, 0.0, 1.0 / mean


@dataclass(frozen=True, eq=False, repr=False)
class Hyperboloid(OpenQuadric):
    """One sheet of a two-sheet hyperboloid, z = c (1 - sqrt(1 + x^2/a^2 + y^2/b^2)): a rounded cone.

    Args:
        semi_axes: a, b, c [m]; far from the apex the sheet approaches a cone of slopes c/a and c/b.
        center: The apex, sensor frame, shape (3,) [m].
        rotation: Columns are the surface's axes in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: A semi-axis is not a finite number above zero.
    """

    semi_axes: tuple[float, float, float]

    def __post_init__(self) -> None:
        object.__setattr__(self, "semi_axes", _lengths("semi_axes", self.semi_axes, 3))
        super().__post_init__()

    @property
    def coefficients(self) -> tuple[float, float, float, float]:
        """See `OpenQuadric`: beta = -1/c^2, eta = 1/c."""
        a, b, c = self.semi_axes
        return a, b, -1.0 / c**2, 1.0 / c


def _lengths(name: str, value: Sequence[float], count: int) -> tuple[float, ...]:
    try:
        lengths = tuple(value)
    except TypeError:
        lengths = ()
    if len(lengths) != count:
        raise InvalidValueError(f"{name} = {value!r}: must be {count} lengths [m]")
    lengths = tuple(positive(f"{name}[{i}]", length, "m") for i, length in enumerate(lengths))
    if not SMALLEST <= min(lengths) <= max(lengths) <= LARGEST:
        raise InvalidValueError(f"{name} = {lengths} m: must lie between {SMALLEST:g} m and {LARGEST:g} m")
    return lengths
