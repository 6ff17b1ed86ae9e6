"""How a fingertip is curved where it touches: the shape operator, for every kind of surface.

How the normal turns as the contact moves decides how noise of the wrench becomes noise of the contact
(`palpate.sensing.uncertainty`). A new kind of surface registers its own function:

    @shape_operator.register
    def _(surface: MySurface, points: FloatArray) -> FloatArray: ...
"""

from functools import singledispatch

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.surfaces.quadric import CenteredQuadric


@singledispatch
def shape_operator(surface: object, points: FloatArray) -> FloatArray:
    """Return W with dn = W dc: how the outward normal turns when a point moves along the surface.

    W is symmetric, W n = 0, and its other two eigenvalues are the principal curvatures [1/m]: 1/R on a sphere,
    positive wherever the surface is convex.

    Args:
        surface: The fingertip, in the sensor frame.
        points: On the surface, sensor frame, shape (n, 3) [m].

    Returns:
        Shape (n, 3, 3) [1/m], sensor frame.

    Raises:
        InvalidValueError: Nobody registered this kind of surface.
    """
    raise InvalidValueError(
        f"surface = {surface!r}: the curvature of a {type(surface).__name__} is not known; register a function "
        "with palpate.sensing.curvature.shape_operator.register"
    )


def level_set_shape_operator(gradient: FloatArray, hessian: FloatArray) -> FloatArray:
    """Return the shape operator of a level set S(r) = const: W = P H P / |g|, with P = 1 - n n', n = g/|g|.

    Args:
        gradient: g = dS/dr at each point, pointing outwards, shape (n, 3), not zero.
        hessian: H = d2S/dr2 at each point, shape (n, 3, 3) or (3, 3) where it is the same everywhere.

    Returns:
        Shape (n, 3, 3) [1/m].
    """
    length = np.linalg.norm(gradient, axis=1)[:, None]
    normal = gradient / length
    tangent = np.eye(3) - normal[:, :, None] * normal[:, None, :]
    return np.asarray(tangent @ (hessian / length[:, :, None]) @ tangent)


@shape_operator.register
def _(surface: CenteredQuadric, points: FloatArray) -> FloatArray:
    # S = (r - o)' B (r - o) / 2; an infinite semi-axis gives a zero in B. Lengths in the smallest semi-axis keep
    # squares within float64 whatever the surface's size.
    half_lengths = np.array(surface.half_lengths)
    size = half_lengths.min()
    B = surface.rotation * (size / half_lengths) ** 2 @ surface.rotation.T
    return np.asarray(level_set_shape_operator((points - surface.center) / size @ B, B) / size)
