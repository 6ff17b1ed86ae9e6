"""How a fingertip is curved where it touches: the shape operator, for every kind of surface.

How the normal turns as the contact moves decides how noise of the wrench becomes noise of the contact
(`palpate.sensing.uncertainty`). A new kind of surface registers its own function:

    @shape_operator.register
    def _(surface: MySurface, points: FloatArray) -> FloatArray: ...
"""

from functools import singledispatch

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.surfaces.composite import Composite
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.open_quadric import OpenQuadric
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


@shape_operator.register
def _(surface: OpenQuadric, points: FloatArray) -> FloatArray:
    a, b, beta, eta = surface.coefficients
    half_hessian = np.array([1.0 / a**2, 1.0 / b**2, beta])
    local = (points - surface.center) @ surface.rotation
    gradient = local * half_hessian + np.array([0.0, 0.0, eta])
    turned = surface.rotation * half_hessian @ surface.rotation.T
    return level_set_shape_operator(gradient @ surface.rotation.T, turned)


@shape_operator.register
def _(surface: Composite, points: FloatArray) -> FloatArray:
    # the patch whose domain a point violates least, as in the solver; on a seam the curvature jumps
    best = np.full(len(points), np.inf)
    operators = np.full((len(points), 3, 3), np.nan)
    for patch in surface.patches:
        excess = points @ patch.half_spaces[:, :3].T - patch.half_spaces[:, 3]
        violation = excess.max(axis=1, initial=-np.inf)
        better = (violation < best) | np.isinf(best)
        best[better] = violation[better]
        operators[better] = shape_operator(patch.surface, points[better])
    return operators


@shape_operator.register
def _(surface: Implicit, points: FloatArray) -> FloatArray:
    local = (points - surface.center) @ surface.rotation
    rows = np.array([surface.evaluate(surface.parameters, x, y, z) for x, y, z in local.tolist()])
    rows = rows.reshape(-1, 10)  # value, gradient, then xx, yy, zz, yz, xz, xy
    order = np.array([[4, 9, 8], [9, 5, 7], [8, 7, 6]])
    hessian = surface.rotation @ rows[:, order] @ surface.rotation.T
    return level_set_shape_operator(rows[:, 1:4] @ surface.rotation.T, hessian)
