"""Nonlinear programmes over cones, by a sequence of convex ones that keep the cones as they are.

    least  f(w) + v'P v / 2 + q'v   with   A v = b,   h - G v in cones,   g(w) <= 0 or = 0,   w = S v

Each step solves `conic` with f and g replaced by Taylor series: of second order with the Lagrangian's Hessian,
made convex within A dv = 0 by turning negative eigenvalues positive (Gill, Murray & Wright 1981, "Practical
Optimization", 4.4.2.1), and with g as a penalty so that there always is one (Fletcher 1985, "An l1 penalty method
for nonlinear constraints"). Friction cones are never rounded or linearised: their apex is no special place.
Nothing is called solved without its optimality conditions, of first and second order, at the very forces given.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.conic import ConicOutcome, ConicProgramme, ConicSolution
from palpate.grasp.own_terms import SmoothTerms
from palpate.grasp.second_order import descent_within

__all__ = ["ENDLESS", "Sequence", "Stationary"]

TOLERANCE = 1e-8
"""Of the optimality conditions, with objective and limits of about one."""

MAX_STEPS = 60
"""Convex problems of one start; four to ten are usual."""

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
class _Point:
    """Objective and terms at v, with derivatives.

    Attributes:
        v: Unknowns, shape (N,).
        f: The objective.
        slope: Its gradient, shape (N,).
        g: The terms, shape (count,).
        jacobian: Theirs, shape (count, N).
        hessian: The Lagrangian's, shape (N, N).
    """

    v: FloatArray
    f: float
    slope: FloatArray
    g: FloatArray
    jacobian: FloatArray
    hessian: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class Stationary:
    """Where it ended.

    Attributes:
        v: Unknowns, shape (N,).
        dual: Multipliers of A v = b.
        multipliers: Of g, shape (count,).
        steps: Convex problems solved.
        merit: Objective, with the price of limits that are exceeded.
        point: The terms there.
        last: The convex problem that led there; None if there was none.
        reason: Why it is not solved; "" if it is.
    """

    v: FloatArray
    dual: FloatArray
    multipliers: FloatArray
    steps: int
    merit: float
    point: _Point
    last: ConicSolution | None
    reason: str


class Sequence:
    """One nonlinear programme."""

    def __init__(self, base: ConicProgramme, units: FloatArray, terms: SmoothTerms, start: FloatArray) -> None:
        """Scale objective and limits by their slopes at a start.

        Args:
            base: All that is convex.
            units: S, shape (4 n,).
            terms: f and g, in w.
            start: v, shape (N,).
        """
        self._base, self._units, self._terms = base, units, terms
        self._over_f, self._over_g = 1.0, np.ones(terms.count)
        first = self._at(start, np.zeros(terms.count))
        if terms.has_objective:
            self._over_f = 1.0 / (max(_most(first.slope), _most(first.hessian)) or 1.0)
        large = np.maximum(np.abs(first.jacobian).max(axis=1, initial=0.0), np.abs(first.g))
        self._over_g = 1.0 / np.where((large > 0.0) & (large < np.inf), large, 1.0)
        # directions in which nothing changes that A holds
        _, values, rows = np.linalg.svd(base.A)
        rank = int((values > 1e-12 * values[0]).sum())
        self._along = rows[rank:].T

    @property
    def unit(self) -> float:
        """What the objective was divided by."""
        return 1.0 / self._over_f

    def from_(self, v: FloatArray, multipliers: FloatArray | None) -> Stationary:
        """Return a local optimum near v, or how far it came."""
        found = self._descend(v, multipliers)
        for _ in range(SADDLES):
            if found.reason or found.last is None:
                return found
            curvature, jacobian = self._base.P + found.point.hessian, found.point.jacobian
            away = descent_within(self._base, found.last, curvature, jacobian, found.multipliers)
            if away is None:
                return found
            tried = [self._descend(found.v + aside * away, None) for aside in ASIDE]
            better = min(tried, key=lambda each: math.inf if each.reason else each.merit)
            steps = found.steps + sum(each.steps for each in tried)
            if better.reason or not better.merit < found.merit - TOLERANCE * max(1.0, abs(found.merit)):
                return replace(found, steps=steps)
            found = replace(better, steps=steps)
        return replace(found, reason="it came from one saddle to the next")

    def _descend(self, v: FloatArray, multipliers: FloatArray | None) -> Stationary:
        terms, base = self._terms, self._base
        multipliers = np.zeros(terms.count) if multipliers is None else multipliers
        self._penalty = max(FIRST_PENALTY, 2.0 * _most(multipliers))
        now, best, steps, dual = self._at(v, multipliers), math.inf, 0, np.zeros(base.b.size)
        reason, solution = f"no local optimum after {MAX_STEPS} convex problems", None
        for _ in range(MAX_STEPS):
            steps += 1
            if not _finite(now):
                reason = "objective or limits have no value or no slope at some forces"
                break
            solution = self._step(now, self._penalty)
            if solution.outcome != ConicOutcome.SOLVED and not solution.error < 1e3:
                reason = (
                    ENDLESS
                    if solution.outcome == ConicOutcome.UNBOUNDED
                    else "a convex problem on the way was not solved"
                )
                break
            size = v.size
            reached, multipliers = solution.x[:size], self._multipliers(solution)
            dual = solution.y
            full = self._at(reached, multipliers)
            error = self._error(full, solution, multipliers) if _finite(full) else math.inf
            if error <= 1.0:
                now, reason = full, ""
                break
            beyond = solution.x[size:]
            stays = _most(reached - now.v) < STAYS * (1.0 + _most(now.v))
            if stays and _most(beyond) > TOLERANCE:
                if self._penalty >= LAST_PENALTY:
                    worst = int(np.argmax(beyond))
                    reason = f"near here no forces keep {terms.names[worst]} with all other limits"
                    now = full
                    break
                self._penalty *= 100.0
            merit, step = self._merit(now), reached - now.v
            promised = merit - self._model(now, solution)
            share = 1.0
            while share > SHORTEST:
                tried = full if share == 1.0 else self._at(now.v + share * step, multipliers)
                if share == 1.0 and error < 0.5 * best:
                    break
                if self._merit(tried) <= merit - 1e-4 * share * max(promised, 0.0):
                    break
                share *= 0.5
            else:
                reason = "no step lowers the objective any more, and the optimality conditions are missed"
                break
            best, now = min(best, error), tried
        return Stationary(now.v, dual, multipliers, steps, self._merit(now), now, solution, reason)

    def _at(self, v: FloatArray, multipliers: FloatArray) -> _Point:
        """Return all terms, scaled, and the Lagrangian's Hessian for scaled multipliers."""
        n, units = self._units.size, self._units
        ratio = self._over_g / self._over_f
        f, slope, g, jacobian, hessian = self._terms(units * v[:n], multipliers * ratio)
        full, wide = np.zeros(v.size), np.zeros((g.size, v.size))
        full[:n], wide[:, :n] = self._over_f * units * slope, self._over_g[:, None] * jacobian * units
        square = np.zeros((v.size, v.size))
        square[:n, :n] = self._over_f * units[:, None] * hessian * units
        return _Point(v, self._over_f * f, full, self._over_g * g, wide, square)

    def _step(self, point: _Point, penalty: float) -> ConicSolution:
        """Solve the convex problem at a point; unknowns are v, then by how much each g is exceeded."""
        base, count, size = self._base, self._terms.count, point.v.size
        Z = self._along
        values, vectors = np.linalg.eigh(Z.T @ (base.P + point.hessian) @ Z)
        values = np.maximum(np.abs(values), FLAT * max(_most(values), 1e-3))
        turned = Z @ vectors
        P, q = np.zeros((size + count, size + count)), np.full(size + count, penalty)
        P[:size, :size] = (turned * values) @ turned.T
        q[:size] = base.P @ point.v + base.q + point.slope - P[:size, :size] @ point.v
        equal = self._terms.is_equation
        limit = point.jacobian @ point.v - point.g
        more, equations = 2 * count + int(equal.sum()), int(equal.sum())
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

    def _multipliers(self, solution: ConicSolution) -> FloatArray:
        count, equal = self._terms.count, self._terms.is_equation
        out = solution.z[count : 2 * count].copy()
        out[equal] -= solution.z[2 * count : 2 * count + int(equal.sum())]
        return out

    def _violation(self, point: _Point) -> FloatArray:
        return np.where(self._terms.is_equation, np.abs(point.g), np.maximum(point.g, 0.0))

    def _merit(self, point: _Point) -> float:
        base = self._base
        value = 0.5 * point.v @ base.P @ point.v + base.q @ point.v + point.f
        cost = float(value + self._penalty * self._violation(point).sum())
        return cost if math.isfinite(cost) else math.inf

    def _model(self, point: _Point, solution: ConicSolution) -> float:
        """Return what the step promises, without curvature of f and g."""
        base, size = self._base, point.v.size
        v = solution.x[:size]
        value = 0.5 * v @ base.P @ v + base.q @ v + point.f + point.slope @ (v - point.v)
        return float(value + self._penalty * np.maximum(solution.x[size:], 0.0).sum())

    def _error(self, point: _Point, solution: ConicSolution, multipliers: FloatArray) -> float:
        """Return by how much the optimality conditions are missed, over the tolerance."""
        base = self._base
        z = solution.z[-len(base.h) :]
        parts = (
            base.P @ point.v + base.q,
            point.slope,
            base.A.T @ solution.y,
            base.G.T @ z,
            point.jacobian.T @ multipliers,
        )
        lacking = _most(sum(parts, np.zeros(point.v.size))) / max(1.0, *(_most(each) for each in parts))
        slack = base.h - base.G @ point.v
        first = base.blocks[:-1]
        tails = np.add.reduceat(slack**2, first) - slack[first] ** 2
        beyond = np.sqrt(np.maximum(tails, 0.0)) - slack[first]
        lost = max(float(beyond.max()), _most(base.A @ point.v - base.b)) / max(1.0, _most(slack))
        # of cones the product is the sum over a block
        product = np.add.reduceat(slack * z, first)
        products = max(_most(product), _most(np.where(self._terms.is_equation, 0.0, multipliers * point.g)))
        products /= max(1.0, _most(z), _most(multipliers))
        return max(lacking, products, _most(self._violation(point)), lost) / TOLERANCE


def _most(array: FloatArray) -> float:
    return float(np.abs(array).max(initial=0.0))


def _finite(point: _Point) -> bool:
    parts = (point.slope, point.g, point.jacobian, point.hessian)
    return math.isfinite(point.f) and all(np.isfinite(each).all() for each in parts)
