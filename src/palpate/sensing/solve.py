"""The compiled solver of each kind of surface, its coefficients bound to it."""

import math
from functools import partial, singledispatch
from typing import Protocol

import numpy as np
import numpy.typing as npt

from palpate.compiling import machine_code
from palpate.errors import FloatArray, InvalidValueError
from palpate.sensing.kernels.composite import solve_composite
from palpate.sensing.kernels.contact_rows import last_scalars
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
_GIVEN = (np.empty(6), False, np.empty(15), np.empty(1, np.int8))
"""The arguments of every kernel behind the surface's own, for their types."""


class Solve(Protocol):
    """Solves n wrenches on the surface that it was made for."""

    def __call__(
        self, wrenches: FloatArray, hard: bool, result: FloatArray, status: npt.NDArray[np.int8], /
    ) -> tuple[float, float, float, int]:
        """Solve them.

        Args:
            wrenches: n of them, one after the other, contiguous, shape (6 n,).
            hard: Whether to solve for hard fingers (wrench axis) instead of soft ones.
            result: Written, shape (15 n,), see `palpate.sensing.kernels.quadric.solve_quadric`.
            status: Written, shape (n,).

        Returns:
            Normal force, spin torque, condition and status of the last.
        """
        ...


@singledispatch
def solve_on(surface: object) -> Solve:
    """Return what solves wrenches on a surface, compiled.

    Raises:
        InvalidValueError: There is no solver for this kind of surface.
    """
    known = ", ".join(sorted(kind.__name__ for kind in solve_on.registry if kind is not object))
    raise InvalidValueError(f"surface is a {type(surface).__name__}: must be a {known}")


def _bound(kernel: object, *shape: object) -> Solve:
    return partial(machine_code(kernel, *shape, *_GIVEN), *shape)


@solve_on.register
def _(surface: CenteredQuadric) -> Solve:
    return _bound(solve_quadric, surface.packed)


@solve_on.register
def _(surface: Composite) -> Solve:
    return _bound(solve_composite, surface.packed, surface.domains, surface.centers, surface.tolerance)


@solve_on.register
def _(surface: OpenQuadric) -> Solve:
    return _bound(solve_projective, surface.packed, _UNIT_SPHERE)


@solve_on.register
def _(surface: Implicit) -> Solve:
    return _Iteration(surface, math.inf, 1.0, STARTS)


@solve_on.register
def _(surface: MeshSurface) -> Solve:
    facets = (surface.parameters, surface.turning_order, surface.turning_spins)
    return _Iteration(surface, math.inf, 1.0, 1, partial(vouch, *facets, surface.center, surface.rotation))


@solve_on.register
def _(surface: CompliantTip) -> Solve:
    return _Iteration(surface, surface.stiffness, surface.exponent, STARTS)


class _Iteration:
    """An iteration, compiled or not, and what looks after it."""

    def __init__(
        self,
        surface: Implicit | CompliantTip,
        stiffness: float,
        exponent: float,
        starts: int,
        check: partial[None] | None = None,
    ) -> None:
        shape = (surface.parameters, surface.half_lengths, surface.center, surface.rotation)
        self._solve = partial(solver_for(surface.evaluate, surface.level), *shape, stiffness, exponent, starts)
        self._check = check

    def __call__(
        self, wrenches: FloatArray, hard: bool, result: FloatArray, status: npt.NDArray[np.int8], /
    ) -> tuple[float, float, float, int]:
        rows = wrenches.reshape(-1, 6)
        if not rows.flags.writeable:  # it would be compiled anew for that
            rows = rows.copy()
        own = np.empty_like(status)  # in plain Python, another thread may solve in between
        self._solve(rows, hard, result, own)
        if self._check is not None:
            self._check(rows, hard, result, own)
        status[:] = own
        found: tuple[float, float, float, int] = last_scalars(result, own)
        return found
