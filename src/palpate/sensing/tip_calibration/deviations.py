"""Small deviations of a tip from its shape: a field of low order in its support function.

Harmonic polynomials of degrees 2 and 3 on the sphere of normals, in the tip's own axes; degree 0 would be its size
and 1 its place. A tip whose support function is off by d(u) lies d(u) further out where its normal is u.
"""

import numpy as np

from palpate.errors import FloatArray

_QUADRATIC = (
    {(1, 1, 0): 1.0},
    {(0, 1, 1): 1.0},
    {(1, 0, 1): 1.0},
    {(2, 0, 0): 0.5, (0, 2, 0): -0.5},
    {(0, 0, 2): 1.0, (2, 0, 0): -0.5, (0, 2, 0): -0.5},
)
_CUBIC = (
    {(1, 1, 1): 1.0},
    {(0, 0, 3): 1.0, (2, 0, 1): -1.5, (0, 2, 1): -1.5},
    {(1, 0, 2): 1.0, (3, 0, 0): -0.25, (1, 2, 0): -0.25},
    {(0, 1, 2): 1.0, (2, 1, 0): -0.25, (0, 3, 0): -0.25},
    {(2, 0, 1): 0.5, (0, 2, 1): -0.5},
    {(3, 0, 0): 0.25, (1, 2, 0): -0.75},
    {(2, 1, 0): 0.75, (0, 3, 0): -0.25},
)

POLYNOMIALS = (*_QUADRATIC, *_CUBIC)
"""By exponents of x, y, z."""

COUNTS = {0: 0, 2: len(_QUADRATIC), 3: len(POLYNOMIALS)}
"""Of terms, by the highest degree."""


def deviation_basis(u: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the first `count` fields and the places that go with them.

    Args:
        u: Unit normals in the tip's axes, shape (n, 3).
        count: Of `POLYNOMIALS`.

    Returns:
        Values, shape (n, count), and gradients of their extensions of degree 1, shape (n, 3, count).
    """
    n = len(u)
    values, places = np.zeros((n, count)), np.zeros((n, 3, count))
    for i, terms in enumerate(POLYNOMIALS[:count]):
        degree = sum(next(iter(terms)))
        for powers, factor in terms.items():
            values[:, i] += factor * np.prod(u ** np.array(powers), axis=1)
            for axis in range(3):
                if powers[axis]:
                    lower = np.array(powers)
                    lower[axis] -= 1
                    places[:, axis, i] += factor * powers[axis] * np.prod(u**lower, axis=1)
        places[:, :, i] += (1 - degree) * values[:, i, None] * u
    return values, places
