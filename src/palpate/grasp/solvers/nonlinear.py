"""Nonlinear programmes over cones: objective and terms at a point, and the conic problem that touches them there.

    least  f(w) + v'P v / 2 + q'v   with   A v = b,   h - G v in cones,   g(w) <= 0 or = 0,   w = S v

Newton's method on their optimality conditions is that on the conic problems, each where the last one came to:
friction cones are never rounded or linearised, their apex is no special place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.grasp.problem.own_terms import SmoothTerms
from palpate.grasp.solvers.conic import ConicProgramme, ConicSolution

__all__ = ["NonlinearProgramme", "Point", "descent_within", "most"]

NEGATIVE = 1e-7
"""Curvature, over the largest, below which it is negative."""


def descent_within(
    base: ConicProgramme,
    solution: ConicSolution,
    curvature: FloatArray,
    jacobian: FloatArray,
    multipliers: FloatArray,
) -> FloatArray | None:
    """Return a unit direction in which a stationary point falls, shape (N,); None if there is none.

    Limits with a multiplier above their slack are taken to hold; a cone that is touched away from its apex bends
    by z0 / |s1| across (Bonnans & Ramirez 2005, "Perturbation analysis of second-order cone programming").

    Args:
        base: Limits that are convex; its blocks are the last of the solution's.
        solution: The convex problem at the point.
        curvature: The Lagrangian's Hessian without cones, shape (N, N).
        jacobian: Of further limits, shape (k, N).
        multipliers: Of these.
    """
    s, z = solution.s[-len(base.h) :], solution.z[-len(base.h) :]
    held, bent = [base.A, jacobian[np.abs(multipliers) > NEGATIVE]], curvature.copy()
    for first, end in zip(base.blocks[:-1], base.blocks[1:], strict=True):
        rows = base.G[first:end]
        if end == first + 1:
            if z[first] > s[first]:
                held.append(rows)
        elif z[first] > NEGATIVE and s[first] > NEGATIVE:
            if np.linalg.norm(z[first + 1 : end]) < 0.5 * z[first]:
                continue
            held.append(z[None, first:end] @ rows)
            length = float(np.linalg.norm(s[first + 1 : end]))
            across = rows[1:] - np.outer(s[first + 1 : end], s[first + 1 : end] @ rows[1:]) / length**2
            bent += z[first] / length * across.T @ across
        elif z[first] > s[first]:
            held.append(rows)
    fixed = np.concatenate(held)
    _, values, directions = np.linalg.svd(fixed)
    free = directions[int((values > 1e-9 * values.max(initial=1.0)).sum()) :].T
    if not free.shape[1]:
        return None
    values, vectors = np.linalg.eigh(free.T @ bent @ free)
    if values[0] >= -NEGATIVE * max(float(np.abs(bent).max()), 1.0):
        return None
    return np.asarray(free @ vectors[:, 0])


@dataclass(frozen=True, slots=True, eq=False)
class Point:
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

    @property
    def is_finite(self) -> bool:
        """Whether all of it exists."""
        parts = (self.slope, self.g, self.jacobian, self.hessian)
        return math.isfinite(self.f) and all(math.isfinite(each.sum()) for each in parts)


class NonlinearProgramme:
    """One of them.

    Attributes:
        base: All that is convex.
        terms: f and g.
    """

    def __init__(self, base: ConicProgramme, units: FloatArray, terms: SmoothTerms, start: FloatArray) -> None:
        """Scale objective and limits by their slopes at a start.

        Args:
            base: All that is convex.
            units: S, shape (4 n,).
            terms: f and g, in w.
            start: v, shape (N,).
        """
        self.base, self.terms, self._units = base, terms, units
        self._over_f, self._over_g = 1.0, np.ones(terms.count)
        first = self.at(start, np.zeros(terms.count))
        if terms.has_objective:
            self._over_f = 1.0 / (max(most(first.slope), most(first.hessian)) or 1.0)
        large = np.maximum(np.abs(first.jacobian).max(axis=1, initial=0.0), np.abs(first.g))
        self._over_g = 1.0 / np.where((large > 0.0) & (large < np.inf), large, 1.0)

    @property
    def unit(self) -> float:
        """What the objective was divided by."""
        return 1.0 / self._over_f

    def at(self, v: FloatArray, multipliers: FloatArray) -> Point:
        """Return all terms, scaled, and the Lagrangian's Hessian for scaled multipliers."""
        n, units = self._units.size, self._units
        ratio = self._over_g / self._over_f
        f, slope, g, jacobian, hessian = self.terms(units * v[:n], multipliers * ratio)
        full, wide = np.zeros(v.size), np.zeros((g.size, v.size))
        full[:n], wide[:, :n] = self._over_f * units * slope, self._over_g[:, None] * jacobian * units
        square = np.zeros((v.size, v.size))
        square[:n, :n] = self._over_f * units[:, None] * hessian * units
        return Point(v, self._over_f * f, full, self._over_g * g, wide, square)

    def touching(self, point: Point) -> ConicProgramme:
        """Return the Taylor series at a point: terms that are = 0 after A's rows, the others before G's."""
        base, equal = self.base, self.terms.is_equation
        limit = point.jacobian @ point.v - point.g
        count = limit.size - int(equal.sum())
        return ConicProgramme(
            base.P + point.hessian,
            base.q + point.slope - point.hessian @ point.v,
            np.concatenate([base.A, point.jacobian[equal]]),
            np.concatenate([base.b, limit[equal]]),
            np.concatenate([point.jacobian[~equal], base.G]),
            np.concatenate([limit[~equal], base.h]),
            np.concatenate([np.arange(count), count + base.blocks]),
        )

    def multipliers(self, solution: ConicSolution) -> FloatArray:
        """Return those of the terms, shape (count,), where a problem of `touching` is solved, or nearly."""
        equal = self.terms.is_equation
        out = np.empty(equal.size)
        out[equal] = solution.y[self.base.b.size :]
        out[~equal] = solution.z[: -self.base.h.size]
        return out

    def violation(self, point: Point) -> FloatArray:
        """Return by how much each term is missed, shape (count,)."""
        return np.where(self.terms.is_equation, np.abs(point.g), np.maximum(point.g, 0.0))

    def merit(self, point: Point, penalty: float) -> float:
        """Return the objective, and the price of what is missed."""
        base = self.base
        value = 0.5 * point.v @ base.P @ point.v + base.q @ point.v + point.f
        cost = float(value + penalty * self.violation(point).sum())
        return cost if math.isfinite(cost) else math.inf


def most(array: FloatArray) -> float:
    """Return the largest size of an entry; 0 if there is none."""
    return float(np.abs(array).max(initial=0.0))
