"""The two explorations: rasters tried until one is good enough, and the active one leg by leg."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from active_exploration.shapes import HALF, Shape
from active_exploration.spline_map import SplineMap
from active_exploration.touch import feel, means
from palpate.controllers.paths import Active, ContactPeriod, Goal, GoalError, Hop, LegEnd, LegResult, Stroke

RASTERS = (*range(2, 26), 28, 31, 35, 41)
MOST_LEGS = 400


@dataclass(frozen=True, slots=True)
class Rule:
    """When to stop, and how the exploration is told."""

    name: str
    measure: GoalError
    limit: float  # [mm], of the true error
    goal: float  # [m], what the planner aims at

    def met(self, off: np.ndarray) -> bool:
        """Whether true errors [mm] meet it."""
        error = np.sqrt((off**2).mean()) if self.measure is GoalError.RMS else np.abs(off).max()
        return bool(error <= self.limit)


RULES = (Rule("RMS 0.02 mm", GoalError.RMS, 0.02, 2e-5), Rule("max 0.1 mm", GoalError.LARGEST, 0.1, 6e-5))


def best_rasters(shape: Shape, seed: int) -> dict[Rule, float]:
    """Length of the shortest raster that meets each rule [mm]."""
    best = dict.fromkeys(RULES, math.inf)
    for rows in RASTERS:
        corners: list[tuple[float, float]] = []
        for k, y in enumerate(np.linspace(-HALF, HALF, rows)):
            corners += [(-HALF, y), (HALF, y)][:: 1 if k % 2 == 0 else -1]
        found = SplineMap()
        found.add(*means(feel(shape, np.array(corners), np.random.default_rng((seed, 1)))))
        off = found.off(shape)
        for rule in RULES:
            if math.isinf(best[rule]) and rule.met(off):
                best[rule] = 2 * HALF * (rows + 1)
        if all(math.isfinite(way) for way in best.values()):
            break
    return best


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One leg: corners [mm], whether in contact, way so far [mm], errors of the map after it [mm]."""

    corners: np.ndarray
    sliding: bool
    way: float
    off: np.ndarray | None


def explore(shape: Shape, rule: Rule, seed: int) -> Iterator[Step]:
    """Explore until the planner has enough."""
    rng = np.random.default_rng((seed, 2))
    planner = Active(2e-3 * HALF, 2e-3 * HALF, Goal(rule.goal, rule.measure))
    found, at, way, leg = SplineMap(), np.full(2, -HALF), 0.0, planner.next(None)
    for _ in range(MOST_LEGS):
        if leg is None:
            return
        assert isinstance(leg, Hop | Stroke)
        to = [leg.to] if isinstance(leg, Hop) else list(leg.corners)
        corners = np.array([at, *(1e3 * np.array(to))])
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        corners = corners[np.concatenate([[True], lengths > 1e-6])]
        way += float(lengths.sum())
        off = None
        if isinstance(leg, Stroke):
            contacts = feel(shape, corners, rng)
            for x, y, z, zx, zy in contacts.tolist():
                s = 1.0 / math.sqrt(1.0 + zx * zx + zy * zy)
                point = (1e-3 * x, 1e-3 * y, 1e-3 * z)
                planner.feel(ContactPeriod(point, point, (-zx * s, -zy * s, s)))
            found.add(*means(contacts))
            off = found.off(shape)
        yield Step(corners, isinstance(leg, Stroke), way, off)
        at = corners[-1]
        leg = planner.next(LegResult(LegEnd.REACHED, (1e-3 * at[0], 1e-3 * at[1], 0.0)))


def active_way(shape: Shape, rule: Rule, seed: int, longest: float) -> tuple[float, bool]:
    """Way until the rule is met [mm], and whether the planner stopped by itself before."""
    for step in explore(shape, rule, seed):
        if step.off is not None and rule.met(step.off):
            return step.path_length, False
        if step.path_length > longest:
            return math.inf, False
    return math.inf, True
