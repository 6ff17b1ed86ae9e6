"""The solver of each kind of surface."""

import math
from functools import singledispatch

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.kernels.composite import solve_composite
from palpate.sensing.kernels.facets import vouch
from palpate.sensing.kernels.implicit import STARTS, solver_for
from palpate.sensing.kernels.projective import solve_projective
from palpate.sensing.kernels.quadric import solve_quadric
from palpate.surfaces.compliant import CompliantTip
from palpate.surfaces.composite import Composite
from palpate.surfaces.implicit import Implicit
from palpate.surfaces.mesh import MeshSurface
from palpate.surfaces.open_quadric import OpenQuadric
from palpate.surfaces.quadric import CenteredQuadric
from palpate.surfaces.shapes import Sphere

_UNIT_SPHERE = Sphere(1.0).packed


@singledispatch
def solve(
    surface: object, wrenches: FloatArray, hard: bool, result: FloatArray, status: npt.NDArray[np.int8]
) -> None:
    """Solve n wrenches on a surface.

    Args:
        surface: The fingertip, in the sensor frame.
        wrenches: Shape (n, 6), C order.
        hard: Whether to solve for hard fingers (wrench axis) instead of soft ones.
        result: Written, shape (15 n,), see `palpate.sensing.kernels.quadric.solve_quadric`.
        status: Written, shape (n,).

    Raises:
        InvalidValueError: There is no solver for this kind of surface.
    """
    known = ", ".join(sorted(kind.__name__ for kind in solve.registry if kind is not object))
    raise InvalidValueError(f"surface is a {type(surface).__name__}: must be a {known}")


@solve.register
def _(
    surface: CenteredQuadric,
    wrenches: FloatArray,
    hard: bool,
    result: FloatArray,
    status: npt.NDArray[np.int8],
) -> None:
    solve_quadric(surface.packed, wrenches, hard, result, status)


@solve.register
def _(
    surface: Composite, wrenches: FloatArray, hard: bool, result: FloatArray, status: npt.NDArray[np.int8]
) -> None:
    shape = (surface.packed, surface.domains, surface.centers, surface.tolerance)
    solve_composite(*shape, wrenches, hard, result, status)


@solve.register
def _(
    surface: OpenQuadric, wrenches: FloatArray, hard: bool, result: FloatArray, status: npt.NDArray[np.int8]
) -> None:
    solve_projective(surface.packed, _UNIT_SPHERE, wrenches, hard, result, status)


@solve.register
def _(
    surface: Implicit, wrenches: FloatArray, hard: bool, result: FloatArray, status: npt.NDArray[np.int8]
) -> None:
    _iterate(surface, math.inf, 1.0, STARTS, wrenches, hard, result, status)


@solve.register
def _(
    surface: MeshSurface, wrenches: FloatArray, hard: bool, result: FloatArray, status: npt.NDArray[np.int8]
) -> None:
    _iterate(surface, math.inf, 1.0, 1, wrenches, hard, result, status)
    facets = (surface.parameters, surface.turning_order, surface.turning_spins)
    vouch(*facets, surface.center, surface.rotation, wrenches, hard, result, status)


@solve.register
def _(
    surface: CompliantTip, wrenches: FloatArray, hard: bool, result: FloatArray, status: npt.NDArray[np.int8]
) -> None:
    _iterate(surface, surface.stiffness, surface.exponent, STARTS, wrenches, hard, result, status)


def _iterate(
    surface: Implicit | CompliantTip,
    stiffness: float,
    exponent: float,
    starts: int,
    wrenches: FloatArray,
    hard: bool,
    result: FloatArray,
    status: npt.NDArray[np.int8],
) -> None:
    shape = (surface.parameters, surface.half_lengths, surface.center, surface.rotation)
    solver_for(surface.evaluate, surface.level)(
        *shape, stiffness, exponent, starts, wrenches, hard, result, status
    )
