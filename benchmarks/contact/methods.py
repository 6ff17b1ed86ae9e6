"""The methods compared, all behind one interface: fingertip -> (wrenches -> centroids)."""

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import partial

import numpy as np

from contact.closed_forms import Rows, Solve, prepare_one_formula, prepare_paper, prepare_wrench_axis
from contact.iterations import prepare_least_squares, prepare_newton, prepare_root
from palpate import Ellipsoid, Solver, Superellipsoid, contact_from_wrench, contacts_from_wrenches
from palpate.errors import InvalidValueError
from palpate.sensing.solve import solve_on


class Pace(Enum):
    """How many contacts a method is given: enough to measure it, few enough to wait for it."""

    FAST = 1.0
    """The whole batch (a million contacts in a full run)."""
    ITERATED = 0.1
    """A tenth of it."""
    SINGLE = 0.0
    """No batch: the method takes one wrench at a time."""


@dataclass(frozen=True, slots=True)
class Method:
    """One way from wrenches to centroids.

    Attributes:
        name: For the table and the picture.
        prepare: Semi-axes (3,) [m] -> wrenches (n, 6) -> centroids (n, 3).
        pace: How large a batch it is given.
        prepare_single: The same for one wrench (6,), where the method has an entry of its own for that.
        dtype: Of the wrenches.
        most_cases: Largest number of cases per category on which the error is measured.
    """

    name: str
    prepare: Callable[[Rows], Solve]
    pace: Pace
    prepare_single: Callable[[Rows], Callable[[Rows], object]] | None = None
    dtype: type[np.floating] = np.float64
    most_cases: int = 10**6

    def one(self, semi_axes: Rows) -> Callable[[Rows], object]:
        """Return the function of one wrench, shape (6,)."""
        if self.prepare_single is not None:
            return self.prepare_single(semi_axes)
        rows = self.prepare(semi_axes)
        return lambda wrench: rows(wrench.reshape(1, 6))


def prepare_palpate(semi_axes: Rows) -> Solve:
    """Return palpate's batch call, which makes all fields and a status."""
    surface = Ellipsoid(tuple(semi_axes.tolist()))
    return lambda wrenches: contacts_from_wrenches(surface, wrenches).centroid


def one_palpate(semi_axes: Rows) -> Callable[[Rows], object]:
    """Return palpate's call for one wrench, result object included."""
    surface = Ellipsoid(tuple(semi_axes.tolist()))
    return lambda wrench: contact_from_wrench(surface, wrench)


def one_solver(semi_axes: Rows) -> Callable[[Rows], object]:
    """Return palpate's solver for loops, result object included."""
    return Solver(Ellipsoid(tuple(semi_axes.tolist())))


def one_kernel(semi_axes: Rows) -> Callable[[Rows], object]:
    """Return palpate's compiled function alone, on one wrench, into arrays that are there."""
    solve = solve_on(Ellipsoid(tuple(semi_axes.tolist())))
    result, status = np.empty(15), np.empty(1, np.int8)
    return lambda wrench: solve(wrench, False, result, status)


def prepare_implicit(semi_axes: Rows) -> Solve:
    """Return palpate's iterative solver; a superellipsoid of exponent 2 is an ellipsoid."""
    try:
        surface = Superellipsoid(semi_axes=tuple(semi_axes.tolist()), exponent=2.0)
    except InvalidValueError:  # a refused fingertip counts as failed
        return lambda wrenches: np.full((len(wrenches), 3), np.nan)
    return lambda wrenches: contacts_from_wrenches(surface, wrenches).centroid


def one_implicit(semi_axes: Rows) -> Callable[[Rows], object]:
    """Return the same for one wrench."""
    surface = Superellipsoid(semi_axes=tuple(semi_axes.tolist()), exponent=2.0)
    return lambda wrench: contact_from_wrench(surface, wrench)


PALPATE = Method("palpate", prepare_palpate, Pace.FAST, one_palpate)
SOLVER = Method("palpate, solver for loops", prepare_palpate, Pace.SINGLE, one_solver)
KERNEL = Method("palpate, kernel alone", prepare_palpate, Pace.SINGLE, one_kernel)
METHODS = (
    PALPATE,
    SOLVER,
    KERNEL,
    Method("one formula, numpy", prepare_one_formula, Pace.FAST),
    Method("one formula, float32", partial(prepare_one_formula, dtype=np.float32), Pace.FAST, dtype=np.float32),
    Method("paper, eq. 16-18", prepare_paper, Pace.FAST),
    Method("wrench axis", prepare_wrench_axis, Pace.FAST),
    Method("Newton, 1 step", partial(prepare_newton, steps=1), Pace.ITERATED),
    Method("Newton, 2 steps", partial(prepare_newton, steps=2), Pace.ITERATED),
    Method("Newton, 3 steps", partial(prepare_newton, steps=3), Pace.ITERATED),
    Method("palpate, implicit", prepare_implicit, Pace.ITERATED, one_implicit),
    Method("scipy root", prepare_root, Pace.SINGLE, most_cases=200),
    Method("scipy least_squares", prepare_least_squares, Pace.SINGLE, most_cases=40),
)
