"""A sphere with small deviations: how moulded fingertips come out of their moulds.

The surface is |x| = R + d(x/|x|), with d a sum of harmonic polynomials of degrees 2 and 3 (degree 0 would be the
radius and 1 the centre). Where its normal is u, it lies d(u) further out than the sphere, up to the square of the
deviations over the radius: 0.1 mm on 8 mm err by 2 um.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from palpate.compiling import njit
from palpate.errors import InvalidValueError, positive
from palpate.surfaces.implicit import DIFFERENCE_STEP, Implicit, check_shape

HARMONICS = (
    {(1, 1, 0): 1.0},
    {(0, 1, 1): 1.0},
    {(1, 0, 1): 1.0},
    {(2, 0, 0): 0.5, (0, 2, 0): -0.5},
    {(0, 0, 2): 1.0, (2, 0, 0): -0.5, (0, 2, 0): -0.5},
    {(1, 1, 1): 1.0},
    {(0, 0, 3): 1.0, (2, 0, 1): -1.5, (0, 2, 1): -1.5},
    {(1, 0, 2): 1.0, (3, 0, 0): -0.25, (1, 2, 0): -0.25},
    {(0, 1, 2): 1.0, (2, 1, 0): -0.25, (0, 3, 0): -0.25},
    {(2, 0, 1): 0.5, (0, 2, 1): -0.5},
    {(3, 0, 0): 0.25, (1, 2, 0): -0.75},
    {(2, 1, 0): 0.75, (0, 3, 0): -0.25},
)
"""Harmonic polynomials by exponents of x, y, z: five of degree 2, seven of degree 3; at most about 1 on the unit
sphere."""

COUNTS = {0: 0, 2: 5, 3: len(HARMONICS)}
"""Of them, by the highest degree."""

MONOMIALS = tuple(sorted({powers for each in HARMONICS for powers in each}, key=lambda p: (sum(p), p)))
POWERS = np.array(MONOMIALS, dtype=np.int64)


@njit(cache=True)
def _level(parameters: Any, powers: Any, x: Any, y: Any, z: Any) -> Any:
    """Value and gradient of |x| - R - d(x/|x|); parameters: R, step, then one factor per monomial."""
    size = np.sqrt(x * x + y * y + z * z)
    if size == 0.0:
        return -parameters[0], 0.0, 0.0, 0.0
    v = np.array([x / size, y / size, z / size])
    further = 0.0
    slope = np.zeros(3)  # of the polynomials on the unit sphere, radial part left out below
    for i in range(powers.shape[0]):
        factor = parameters[2 + i]
        if factor == 0.0:
            continue
        term = factor
        for k in range(3):
            term *= v[k] ** powers[i, k]
        further += term
        for k in range(3):
            if powers[i, k]:
                part = factor * powers[i, k]
                for j in range(3):
                    part *= v[j] ** (powers[i, j] - (1 if j == k else 0))
                slope[k] += part
    radial = slope[0] * v[0] + slope[1] * v[1] + slope[2] * v[2]
    g = v - (slope - radial * v) / size
    return size - parameters[0] - further, g[0], g[1], g[2]


@njit(error_model="numpy", cache=True)
def evaluate_near_sphere(parameters: Any, x: Any, y: Any, z: Any) -> Any:
    """Value, gradient and, by differences of it, second derivatives; parameters as in `_level`."""
    step = parameters[1]
    value, gx, gy, gz = _level(parameters, POWERS, x, y, z)
    _, axx, axy, axz = _level(parameters, POWERS, x + step, y, z)
    _, bxx, bxy, bxz = _level(parameters, POWERS, x - step, y, z)
    _, ayx, ayy, ayz = _level(parameters, POWERS, x, y + step, z)
    _, byx, byy, byz = _level(parameters, POWERS, x, y - step, z)
    _, azx, azy, azz = _level(parameters, POWERS, x, y, z + step)
    _, bzx, bzy, bzz = _level(parameters, POWERS, x, y, z - step)
    half = 0.5 / step
    yz = 0.5 * half * (ayz - byz + azy - bzy)
    xz = 0.5 * half * (axz - bxz + azx - bzx)
    xy = 0.5 * half * (axy - bxy + ayx - byx)
    return (value, gx, gy, gz, half * (axx - bxx), half * (ayy - byy), half * (azz - bzz), yz, xz, xy)


@dataclass(frozen=True, eq=False, repr=False)
class NearSphere(Implicit):
    """A sphere with small deviations.

    Args:
        radius: Of the sphere [m].
        deviations: Factors of `HARMONICS` [m], up to 12; those left out are 0.
        center: Sensor frame, shape (3,) [m].
        rotation: Columns are the axes that deviations are written in, in sensor coordinates, shape (3, 3).

    Raises:
        InvalidValueError: Too many deviations, or such large ones that it bends inwards.
    """

    radius: float
    deviations: Sequence[float]

    def __post_init__(self) -> None:
        radius = positive("radius", self.radius, "m")
        given = tuple(float(each) for each in self.deviations)
        if len(given) > len(HARMONICS) or not np.isfinite(given).all():
            raise InvalidValueError(f"deviations = {given}: must be at most {len(HARMONICS)} finite numbers")
        object.__setattr__(self, "deviations", given)
        factors = dict.fromkeys(MONOMIALS, 0.0)
        for deviation, terms in zip(given, HARMONICS, strict=False):
            for powers, factor in terms.items():
                factors[powers] += deviation * factor
        parameters = np.array([radius, DIFFERENCE_STEP * radius, *factors.values()])
        check_shape(evaluate_near_sphere, parameters, radius)
        self._settle(evaluate_near_sphere, parameters, radius)
