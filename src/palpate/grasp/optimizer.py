"""Grasp forces: one class, which chooses the solver by what the problem is.

| problem | solved by |
|---|---|
| min_effort, cones | dual Newton steps (`least_effort`); what they leave undecided, clarabel |
| max_margin, min_peak, load_factor, actuator limits | clarabel, sharpened by Newton's method (`conic`) |
| e that depends on the load, p below 2 | `curved`: convex from the inside, then the nonlinear programme |
| own objectives, own limits, shared actuators | `coupled`: one convex problem, or a sequence of them |

A patent on solving grasp forces by barrier subproblems with dual-based stopping (US 7,650,263 B2, after Boyd &
Wegbreit 2007) may still be in force. Neither method here is that one, but whoever sells a product should judge.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import replace
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import ConcurrentUseError, FloatArray, InvalidValueError, numbers
from palpate.grasp.problem.contacts import GraspContacts
from palpate.grasp.problem.limits import checked_shared_actuators
from palpate.grasp.problem.objective_spec import Objective, Wanted
from palpate.grasp.problem.result import GraspForces, SolveStatus

if TYPE_CHECKING:
    from palpate.grasp.solvers.convex import Convex
    from palpate.grasp.solvers.coupled import Coupled
    from palpate.grasp.solvers.curved import Curved

__all__ = ["GraspForceOptimizer"]


_CONCURRENT = "this optimizer is solving in another thread: give each thread its own (copy.copy makes one)"


_HUGE = 1e150
"""[N]. Larger loads may have forces, or an effort, that no float has: that is looked at afterwards."""


class GraspForceOptimizer:
    """Finds the forces of a grasp for one load after another.

    One thread at a time: another that asks meanwhile gets a `ConcurrentUseError`. Copies share nothing.
    """

    def __init__(
        self,
        grasp: GraspContacts,
        objective: Objective | str | Callable[[Any], Any] = Objective.MIN_EFFORT,
        effort_weight: float = 0.01,
        *,
        subject_to: Callable[[Any], Any] | None = None,
        shared_actuators: tuple[Any, Any, Any] | None = None,
    ) -> None:
        """Take a grasp and the objective; compile and allocate, so that solving need not.

        Own functions get the forces w as a CasADi SX of shape (n, 4): w[i, :] is (f_n, f_t1, f_t2, tau_n) of
        contact i [N, N, N, N m], as in `GraspForces.forces`. They are called once for each number of contacts.

        Args:
            grasp: Contacts.
            objective: "min_effort": sum f_n^2 + eps (f_t^2 + (tau / c)^2); "max_margin": the largest t with
                |(f_t, tau / e)|_p <= mu f_n - t at every contact; "min_peak": the least largest f_n;
                "load_factor": the largest factor of the load that can be held; or a function of w that returns
                what is to be least, an expression of one number.
            effort_weight: eps, above 0.
            subject_to: A function of w that returns a list of relations by <=, >= and ==.
            shared_actuators: (A, lower, upper) with lower <= A w <= upper for w contact after contact: shapes
                (k, 4 n), (k,) and (k,), or numbers; infinity for none.

        Raises:
            InvalidValueError: An objective or a weight that does not exist; a function that returns something
                else; own objectives or limits together with limit surfaces that are no cones.
        """
        self._wanted = Wanted.of(objective, effort_weight, subject_to, shared_actuators)
        self._solver: Convex | Curved | Coupled | None = None
        self._in_use = Lock()
        self.update(grasp)

    @property
    def objective(self) -> Objective | Callable[[Any], Any]:
        """What is optimised: a named objective, or the function given."""
        return self._wanted.own_objective or self._wanted.objective

    @property
    def grasp(self) -> GraspContacts:
        """The contacts of now."""
        return self._grasp

    def update(self, grasp: GraspContacts, shared_actuators: tuple[Any, Any, Any] | None = None) -> None:
        """Take contacts that have moved, come or gone; while their number stays, the next solution starts warm.

        Own functions that are not convex are compiled for each number of contacts.

        Args:
            grasp: Contacts.
            shared_actuators: As at first, where they have changed; None for the same as before.

        Raises:
            InvalidValueError: max_margin, and a contact without a largest force: the margin would grow for ever.
            ConcurrentUseError: Another thread is solving with it.
        """
        wanted = self._wanted
        if shared_actuators is not None:
            wanted = replace(wanted, shared_actuators=checked_shared_actuators(shared_actuators))
        if self.objective is Objective.MAX_MARGIN and not np.isfinite(grasp.force_max).all():
            raise InvalidValueError(
                "max_margin: where force_max is infinite the margin grows for ever; give every contact one"
            )
        if not self._in_use.acquire(blocking=False):
            raise ConcurrentUseError(_CONCURRENT)
        try:
            if wanted.is_coupled:
                self._solver = _coupled(self._solver, grasp, wanted)
            else:
                kind = _solver_for(grasp)
                if isinstance(self._solver, kind):
                    self._solver.update(grasp)
                else:
                    self._solver = kind(grasp, wanted.objective, wanted.effort_weight)
            self._grasp, self._wanted = grasp, wanted
        finally:
            self._in_use.release()

    def solve(self, external_wrench: FloatArray, warm_start: bool = True) -> GraspForces:
        """Return the forces for a load.

        Args:
            external_wrench: What else acts on the object, about its origin, shape (6,) [N, N m].
            warm_start: Whether to begin where the last solution ended.

        Raises:
            InvalidValueError: Not six numbers. What is not finite gives `SolveStatus.INVALID`.
            ConcurrentUseError: Another thread is solving with it.
        """
        wrench = numbers("external_wrench", external_wrench)
        if wrench.shape != (6,):
            raise InvalidValueError(f"external_wrench has shape {wrench.shape}: must be (6,) [N, N m]")
        size = sum(map(abs, wrench.tolist()))
        if self._solver is None or not size < math.inf:
            return self._invalid()
        if not self._in_use.acquire(blocking=False):
            raise ConcurrentUseError(_CONCURRENT)
        try:
            with np.errstate(over="ignore", invalid="ignore") if size > _HUGE else nullcontext():
                found = self._solver.solve(wrench, warm=warm_start)
        finally:
            self._in_use.release()
        if math.isfinite(found.objective):
            return found
        return found if np.isfinite(found.forces).all() and not math.isnan(found.objective) else self._invalid()

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle as what it was made from: the copy begins cold."""
        return _remade, (type(self), self._grasp, self._wanted)

    def _invalid(self) -> GraspForces:
        nothing, nan = np.zeros((len(self._grasp), 4)), np.full(6, math.nan)
        return GraspForces(nothing, math.nan, np.zeros(len(nothing)), nan, nan, 0, SolveStatus.INVALID)


def _solver_for(grasp: GraspContacts) -> type[Convex] | type[Curved]:
    """Import what solves it, with CasADi: a second that only grasps need."""
    from palpate.grasp.solvers.convex import Convex
    from palpate.grasp.solvers.curved import Curved

    return Convex if grasp.is_convex else Curved


def _coupled(solver: Any, grasp: GraspContacts, wanted: Wanted) -> Coupled:
    from palpate.grasp.solvers.coupled import Coupled

    if not isinstance(solver, Coupled):
        return Coupled(grasp, wanted)
    solver.update(grasp, wanted)
    return solver


def _remade(kind: type[GraspForceOptimizer], grasp: GraspContacts, wanted: Wanted) -> GraspForceOptimizer:
    return kind(
        grasp,
        wanted.own_objective or wanted.objective,
        wanted.effort_weight,
        subject_to=wanted.subject_to,
        shared_actuators=wanted.shared_actuators,
    )
