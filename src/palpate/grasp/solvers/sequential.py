"""Local optima of nonlinear programmes over cones, by a sequence of convex problems and Newton's method.

From afar each step solves the problem that touches (see `nonlinear`), made convex within A dv = 0 by turning
negative eigenvalues positive (Gill, Murray & Wright 1981, "Practical Optimization", 4.4.2.1), and with g as a
penalty so that there always is one (Fletcher 1985, "An l1 penalty method for nonlinear constraints"). From where
it comes to, Newton's method on the problem as it is goes the rest of the way, or gives up.
Nothing is called solved without its optimality conditions, of first and second order, at the very forces given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.solvers.conic import ConicOutcome, ConicProgramme, ConicSolution
from palpate.grasp.solvers.nonlinear import NonlinearProgramme, Point, descent_within, most

__all__ = ["ENDLESS", "Sequence", "Stationary"]

TOLERANCE = 1e-8
"""Of the optimality conditions, where Newton's method does not reach its own: over the sizes of what they consist
of."""

MAX_STEPS = 60
"""Convex problems of one start; one to five are usual."""

NEWTON_STEPS = 12
"""Four to six are usual."""

ENOUGH = 1e-12
"""Of its conditions, at which it does no more."""

LOST = 1e3
"""By so much Newton's method may miss the conditions by more than where it began."""

FIRST_PENALTY, LAST_PENALTY = 10.0, 1e7
"""Price of a limit's violation: the first, over the objective's slope, and when to give up."""

FLAT = 1e-7
"""Least curvature, over the largest: keeps steps finite where the objective is straight."""

STAYS = 1e-6
"""Step, over the forces, that is none."""

SHORTEST = 1e-6
"""Share of a step below which there is no use."""

ASIDE = (0.1, -0.1)
"""Steps along a direction in which a saddle falls, over the load."""

ENDLESS = "the objective falls without end: give every contact a force_max"

SADDLES = 3
"""Left at most."""


@dataclass(frozen=True, slots=True, eq=False)
class Stationary:
    """Where it ended.

    Attributes:
        solution: Of the problem that touches there.
        steps: Convex problems solved, and steps of Newton's method.
        merit: Objective, with the price of limits that are exceeded.
        away: Unit direction in which it falls all the same, shape (N,); None if there is none.
        reason: Why it is not solved; "" if the conditions of first order hold.
    """

    solution: ConicSolution
    steps: int
    merit: float
    away: FloatArray | None = None
    reason: str = ""


class Sequence:
    """Searches in one nonlinear programme."""

    def __init__(self, programme: NonlinearProgramme) -> None:
        """Take it."""
        self._programme = programme
        # directions in which nothing changes that A holds
        _, values, rows = np.linalg.svd(programme.base.A)
        rank = int((values > 1e-12 * values[0]).sum())
        self._along = rows[rank:].T

    def from_(self, v: FloatArray) -> Stationary:
        """Return a local optimum near v, or how far it came."""
        found = self._descend(v)
        for _ in range(SADDLES):
            if found.reason or found.away is None:
                return found
            tried = [self._descend(found.solution.x + aside * found.away) for aside in ASIDE]
            better = min(tried, key=lambda each: math.inf if each.reason else each.merit)
            steps = found.steps + sum(each.steps for each in tried)
            if better.reason or not better.merit < found.merit - TOLERANCE * max(1.0, abs(found.merit)):
                return replace(found, away=None, steps=steps)
            found = replace(better, steps=steps)
        return replace(found, reason="it came from one saddle to the next")

    def _descend(self, v: FloatArray) -> Stationary:
        programme = self._programme
        names, penalty, steps, best = programme.terms.names, FIRST_PENALTY, 0, math.inf
        multipliers = np.zeros(len(names))
        now, solution = programme.at(v, multipliers), None
        reason = f"no local optimum after {MAX_STEPS} convex problems"
        for _ in range(MAX_STEPS):
            steps += 1
            if not now.is_finite:
                reason = "objective or limits have no value or no slope at some forces"
                break
            elastic = self._step(now, penalty)
            if elastic.outcome != ConicOutcome.SOLVED and not elastic.error < 1e3:
                reason = (
                    ENDLESS
                    if elastic.outcome == ConicOutcome.UNBOUNDED
                    else "a convex problem on the way was not solved"
                )
                break
            solution, beyond = self._inelastic(elastic), elastic.x[v.size :]
            multipliers, step = programme.multipliers(solution), solution.x - now.v
            full = programme.at(solution.x, multipliers)
            error = programme.touching(full).near(solution, 0).error if full.is_finite else math.inf
            near = newton(programme, solution)
            if near is not None:
                steps += near.steps
                if near.away is None or error <= TOLERANCE:
                    return replace(near, steps=steps)
            elif error <= TOLERANCE:
                return stationary(programme, full, solution, steps)
            stays = most(step) < STAYS * (1.0 + most(now.v)) and most(beyond) > TOLERANCE
            promised = programme.merit(now, penalty) - self._model(now, elastic, penalty)
            if stays:
                tried = None
            elif error < 0.5 * best:
                tried = full
            else:
                tried = self._lower(now, step, multipliers, penalty, promised)
            if tried is not None:
                best, now = min(best, error), tried
                continue
            missed = programme.violation(now)
            if most(missed) <= TOLERANCE:
                reason = "no step lowers the objective any more, and the optimality conditions are missed"
                break
            if penalty >= LAST_PENALTY:
                reason = f"near here no forces keep {names[int(np.argmax(missed))]} with all other limits"
                break
            penalty *= 100.0
        if solution is None:
            y, nothing = np.zeros(programme.base.b.size), np.zeros(programme.base.h.size)
            solution = ConicSolution(ConicOutcome.UNDECIDED, v, y, nothing, nothing, 0, math.inf)
        return Stationary(solution, steps, programme.merit(now, penalty), reason=reason)

    def _lower(
        self, now: Point, step: FloatArray, multipliers: FloatArray, penalty: float, promised: float
    ) -> Point | None:
        """Return where a share of a step lowers the merit by enough of what it promises; None if none does."""
        merit, share = self._programme.merit(now, penalty), 1.0
        while share > SHORTEST:
            tried = self._programme.at(now.v + share * step, multipliers)
            if self._programme.merit(tried, penalty) <= merit - 1e-4 * share * max(promised, 0.0):
                return tried
            share *= 0.5
        return None

    def _step(self, point: Point, penalty: float) -> ConicSolution:
        """Solve the convex problem at a point; unknowns are v, then by how much each g is exceeded."""
        programme, size = self._programme, point.v.size
        base, equal, Z = programme.base, programme.terms.is_equation, self._along
        count, equations = equal.size, int(equal.sum())
        values, vectors = np.linalg.eigh(Z.T @ (base.P + point.hessian) @ Z)
        values = np.maximum(np.abs(values), FLAT * max(most(values), 1e-3))
        turned = Z @ vectors
        P, q = np.zeros((size + count, size + count)), np.full(size + count, penalty)
        P[:size, :size] = (turned * values) @ turned.T
        q[:size] = base.P @ point.v + base.q + point.slope - P[:size, :size] @ point.v
        limit = point.jacobian @ point.v - point.g
        more = 2 * count + equations
        G, h = np.zeros((more + len(base.h), size + count)), np.empty(more + len(base.h))
        # by how much it is exceeded >= 0; then g less that <= 0, and -g less that where g is to be 0
        one = np.arange(count)
        G[one, size + one] = G[count + one, size + one] = -1.0
        G[count : 2 * count, :size], G[2 * count : more, :size] = point.jacobian, -point.jacobian[equal]
        G[2 * count + np.arange(equations), size + one[equal]] = -1.0
        h[:count], h[count : 2 * count], h[2 * count : more] = 0.0, limit, -limit[equal]
        G[more:, :size], h[more:] = base.G, base.h
        A = np.zeros((len(base.b), size + count))
        A[:, :size] = base.A
        blocks = np.concatenate([np.arange(more), more + base.blocks])
        return ConicProgramme(P, q, A, base.b, G, h, blocks).solve()

    def _inelastic(self, elastic: ConicSolution) -> ConicSolution:
        """Return what a problem of `_step` found as nearly a solution of the one that touches."""
        equal, rows = self._programme.terms.is_equation, self._programme.base.h.size
        count, size = equal.size, elastic.x.size - equal.size
        multipliers, slack = elastic.z[count : 2 * count].copy(), elastic.s[count : 2 * count]
        multipliers[equal] -= elastic.z[2 * count : -rows]
        return ConicSolution(
            ConicOutcome.UNDECIDED,
            elastic.x[:size],
            np.concatenate([elastic.y, multipliers[equal]]),
            np.concatenate([slack[~equal], elastic.s[-rows:]]),
            np.concatenate([multipliers[~equal], elastic.z[-rows:]]),
            elastic.iterations,
            math.inf,
        )

    def _model(self, point: Point, elastic: ConicSolution, penalty: float) -> float:
        """Return what the step promises, without curvature of f and g."""
        base, size = self._programme.base, point.v.size
        v = elastic.x[:size]
        value = 0.5 * v @ base.P @ v + base.q @ v + point.f + point.slope @ (v - point.v)
        return float(value + penalty * np.maximum(elastic.x[size:], 0.0).sum())


def newton(programme: NonlinearProgramme, start: ConicSolution) -> Stationary | None:
    """Return the stationary point that Newton's method finds near a start; None if it finds none."""
    now, first, before = start, math.inf, math.inf
    for k in range(NEWTON_STEPS + 1):
        point = programme.at(now.x, programme.multipliers(now))
        if not point.is_finite:
            return None
        touching = programme.touching(point)
        now = touching.near(now, 0)
        first = now.error if k == 0 else first
        if now.outcome == ConicOutcome.SOLVED and (now.error <= ENOUGH or not now.error < 0.5 * before):
            return stationary(programme, point, now, k)
        if not now.error <= LOST * first:
            return None
        before = now.error
        now = touching.near(now, 1)
    return None


def stationary(programme: NonlinearProgramme, point: Point, solution: ConicSolution, steps: int) -> Stationary:
    """Return a point that meets the conditions of first order, and where it falls all the same."""
    curvature, multipliers = programme.base.P + point.hessian, programme.multipliers(solution)
    away = descent_within(programme.base, solution, curvature, point.jacobian, multipliers)
    return Stationary(solution, steps, programme.merit(point, FIRST_PENALTY), away)
