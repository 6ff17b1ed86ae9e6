"""The shape operators of fingertips other than centred quadrics; registered where they are imported."""

import numpy as np

from palpate.errors import FloatArray
from palpate.sensing.curvature import level_set_shape_operator, shape_operator
from palpate.surfaces.composite import Composite
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.open_quadric import OpenQuadric


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
