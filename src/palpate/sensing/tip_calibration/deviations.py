"""Small deviations of a tip from its shape: a field of low order in its support function.

Harmonic polynomials of degrees 2 and 3 on the sphere of normals, in the tip's own axes, as of a `NearSphere`. A
tip whose support function is off by d(u) lies d(u) further out where its normal is u.
"""

import numpy as np

from palpate.errors import FloatArray
from palpate.surfaces.near_sphere import HARMONICS


def deviation_basis(u: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the first `count` fields and the places that go with them.

    Args:
        u: Unit normals in the tip's axes, shape (n, 3).
        count: Of `HARMONICS`.

    Returns:
        Values, shape (n, count), and gradients of their extensions of degree 1, shape (n, 3, count).
    """
    n = len(u)
    values, places = np.zeros((n, count)), np.zeros((n, 3, count))
    for i, terms in enumerate(HARMONICS[:count]):
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
