"""Grasp forces by an interior point method: for every objective, and certain about what cannot be held."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.grasp.attempts import ATTEMPTS, Attempt
from palpate.grasp.compiled import BUILDING, Compiled, Executor, in_place
from palpate.grasp.grasp_proof import proof_value
from palpate.grasp.interior_result import InteriorPointResult, InteriorPointStatus
from palpate.grasp.objective import Objective
from palpate.grasp.self_dual import SelfDual, self_dual
from palpate.grasp.statement import CONTACT, FORCES, WRENCH

__all__ = ["InteriorPoint", "InteriorPointResult", "InteriorPointStatus"]

MAX_ITERATIONS = 50
"""Iterations of one attempt. Ten to twenty are usual."""

MAX_STALLED_ITERATIONS = 12
"""Iterations after which an attempt is given up that came neither nearer to a solution nor to a proof by half."""

STOP_RATIO = 0.1
"""Share of the tolerances at which it stops; between here and 1 it goes on while that helps."""

PROOF_TOLERANCE = 1e-8
"""Residual of a proof, over what it proves, from which on it is worth checking."""

ENDLESS = 1e-10
"""Residual, over theta, of forces that grow with theta without limit."""


@lru_cache(maxsize=64)
def _graphs(n: int, objective: Objective, actuators: int, effort_weight: float) -> tuple[SelfDual, Any]:
    return self_dual(n, objective, actuators, effort_weight), proof_value(n, objective, actuators)


class InteriorPoint:
    """Solves for n contacts; built once per number of contacts, objective and number of actuators."""

    def __init__(
        self,
        n: int,
        objective: Objective,
        actuators: int = 0,
        effort_weight: float = 0.01,
        executor: Executor | None = None,
    ) -> None:
        """Build, and compile unless that was done before (it takes two seconds).

        Args:
            n: Contacts.
            objective: What is wanted.
            actuators: k, actuators per contact.
            effort_weight: eps of min_effort.
            executor: What runs the functions; by default machine code, where there is a compiler.
        """
        executor = Compiled() if executor is None else executor
        with BUILDING:
            graphs, proof = _graphs(n, objective, actuators, effort_weight)
        begin, iterate, finish, proves = executor.prepare(
            [graphs.begin, graphs.iterate, graphs.finish, proof], f"the solver of grasp forces, {objective.value}"
        )
        self._n, self._k = n, actuators
        # CasADi's matrices are column-major: a row here is a column there
        self._contacts = np.zeros((n, CONTACT))
        self._load = np.zeros(WRENCH)
        self._rows, self._limits = np.zeros((n, FORCES * actuators)), np.full((n, actuators), np.inf)
        data = np.zeros((n, graphs.data))
        points = [np.zeros((n, graphs.points)) for _ in range(2)]
        shared = [np.zeros(graphs.shared.size) for _ in range(2)]
        self._forces, self._multipliers = np.zeros((n, FORCES)), np.zeros((n, graphs.multipliers))
        self._dual, self._theta, self._shy = np.zeros(WRENCH), np.zeros(1), np.zeros(1)
        self._proof, self._value = np.zeros(WRENCH), np.zeros(1)
        self._push = np.zeros((n, 2 * actuators))
        given = [self._contacts, self._load, self._rows, self._limits]
        self._begin = in_place(begin, [*given, self._shy], [data, points[0], shared[0]])
        self._iterate = [
            in_place(iterate, [data, points[a], shared[a]], [points[1 - a], shared[1 - a]]) for a in (0, 1)
        ]
        results = [self._forces, self._multipliers, self._theta, self._dual]
        self._finish = [in_place(finish, [*given[:1], *given[2:], points[a], shared[a]], results) for a in (0, 1)]
        self._proves = in_place(proves, [*given, self._proof, self._push], [self._value])
        self._views = [each.data for each in shared]
        where = graphs.shared.where
        self._error, self._of_other, self._doubt, self._drift, self._tau = (
            where[name].start for name in ("error", "error_of_other", "doubt", "drift", "tau")
        )
        self._primal, self._gap = where["primal"].start, where["gap"].start

    def solve(
        self,
        contacts: FloatArray,
        load: FloatArray,
        actuator_rows: FloatArray | None = None,
        actuator_limits: FloatArray | None = None,
    ) -> InteriorPointResult:
        """Return the forces x with sum A_i x_i + load = 0 that the objective wants.

        Args:
            contacts: Place, n, t1, t2, e, mu, f_min, f_max of each, scaled (see `statement`), shape (n, 16).
            load: Scaled, shape (6,).
            actuator_rows: J of each contact, shape (n, k, 4); required if k is above 0.
            actuator_limits: Largest |J x|, shape (n, k); likewise.

        Raises:
            InvalidValueError: Actuators are missing, or others than it was built for are given.
        """
        self._take_actuators(actuator_rows, actuator_limits)
        best, least, spent = None, (True, math.inf), 0
        for attempt in ATTEMPTS:
            result, error = self._attempt(attempt, contacts, load, spent)
            if result.status not in (InteriorPointStatus.NEARLY, InteriorPointStatus.MAX_ITERATIONS):
                return result
            spent, worth = result.iterations, (result.status is InteriorPointStatus.MAX_ITERATIONS, error)
            if best is None or worth < least:
                best, least = result, worth
        assert best is not None
        return replace(best, iterations=spent)

    def _take_actuators(self, rows: FloatArray | None, limits: FloatArray | None) -> None:
        n, k = self._n, self._k
        if not k and rows is None and limits is None:
            return
        if rows is None or limits is None or rows.shape != (n, k, FORCES) or limits.shape != (n, k):
            raise InvalidValueError(
                f"actuator_rows and actuator_limits have shapes {None if rows is None else rows.shape} and "
                f"{None if limits is None else limits.shape}: this solver was built for {n} contacts with {k} "
                f"actuators each: give ({n}, {k}, {FORCES}) and ({n}, {k})" + ("" if k else ", or none")
            )
        self._rows[:] = rows.reshape(n, -1)
        self._limits[:] = limits

    def _attempt(
        self, attempt: Attempt, contacts: FloatArray, load: FloatArray, spent: int
    ) -> tuple[InteriorPointResult, float]:
        """Return a result and its error over the tolerances, `spent` iterations being spent already."""
        self._contacts[:] = attempt.contacts(contacts[:, :CONTACT])
        self._load[:] = attempt.wrench(load)
        self._shy[0] = attempt.shy
        self._begin()
        now, last, status = 0, math.inf, InteriorPointStatus.MAX_ITERATIONS
        iterations, best, closest, since = 0, math.inf, math.inf, 0
        certificate, nearly, nearest = None, None, 1.0
        while iterations < MAX_ITERATIONS:
            self._iterate[now]()
            iterations += 1
            now = 1 - now
            shared = self._views[now]
            error = shared[self._error]
            if error <= STOP_RATIO:
                status = InteriorPointStatus.SOLVED
                break
            if last <= 1.0 and not error < last:
                now, status = 1 - now, InteriorPointStatus.SOLVED
                break
            if error != error:
                now = 1 - now
                break
            last = error
            if error > 1.0 and shared[self._of_other] < nearest:
                nearest = shared[self._of_other]
                nearly = self._result(InteriorPointStatus.NEARLY, attempt, now, spent + iterations)
            if shared[self._drift] <= ENDLESS:
                status = InteriorPointStatus.UNBOUNDED
                break
            doubt = shared[self._doubt]
            if doubt <= PROOF_TOLERANCE:
                certificate = self._certificate(now)
                if certificate is not None:
                    status = InteriorPointStatus.INFEASIBLE
                    break
            if error <= 0.5 * best or doubt <= 0.5 * closest:
                best, closest, since = min(error, best), min(doubt, closest), iterations
            elif iterations - since > MAX_STALLED_ITERATIONS:
                break
        if status is InteriorPointStatus.MAX_ITERATIONS and last <= 1.0:
            status = InteriorPointStatus.SOLVED
        if status is InteriorPointStatus.MAX_ITERATIONS and nearly is not None:
            return replace(nearly, iterations=spent + iterations), nearest
        return self._result(status, attempt, now, spent + iterations, certificate), last

    def _result(
        self,
        status: InteriorPointStatus,
        attempt: Attempt,
        now: int,
        iterations: int,
        certificate: FloatArray | None = None,
    ) -> InteriorPointResult:
        """Return where it is."""
        self._finish[now]()
        shared = self._views[now]
        forces, theta = self._forces.copy(), float(self._theta[0])
        if status is InteriorPointStatus.UNBOUNDED:
            forces, theta = forces / theta, math.inf
        return InteriorPointResult(
            status,
            forces,
            theta,
            attempt.back(self._dual),
            self._multipliers.copy(),
            iterations,
            shared[self._primal],
            shared[self._gap],
            None if certificate is None else attempt.back(certificate),
        )

    def _certificate(self, now: int) -> FloatArray | None:
        """Return y as a proof, if it is one."""
        self._finish[now]()
        size = math.sqrt(float(self._dual @ self._dual))
        np.divide(self._dual, size, out=self._proof)
        if self._k:
            np.divide(self._multipliers[:, -2 * self._k :], size, out=self._push)
        self._proves()
        return self._proof.copy() if self._value[0] > 0.0 else None
