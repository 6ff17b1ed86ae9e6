"""Path length of an active exploration relative to the best raster in hindsight.

    python benchmarks/active.py [--quick] [--seed N]

Pure geometry in millimetres: contacts at 500 Hz and 20 mm/s on 60 x 60 mm seen from above, position noise of 0.03
mm correlated over 1 mm of path, normals off by 0.5 degrees. Both explorations feed the same map (a smoothing
spline through heights and slopes, smoothness by maximum likelihood) and stop by the same rule: true RMS error
below 0.02 mm, or largest below 0.1 mm. Rasters of 2 to 41 rows are tried; the shortest path that meets the rule is
the best one. The path of the active exploration includes what lies between its strokes.

Detail is local on something flat or gently curved with 1 to 4 bumps, dents, ridges or grooves, 2 to 8 mm wide at
half height and 0.1 to 0.4 of that high, which together cover at most 5 % of the field. Shapes and seeds (2000 + N
on) are held out: settings were chosen with others.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from active_shapes import FAMILIES, HALF, Family, Shape
from harness.command import start
from harness.study import Check, Effort, Study
from harness.tables import grid
from spline_map import SplineMap, feel, means

from palpate.controllers.paths import Active, ContactPeriod, Goal, GoalError, Hop, LegEnd, LegResult, Stroke

FIRST_SEED = 2000
"""First seed of the held-out shapes."""

LONGEST = 1.6
"""The active exploration is stopped at this multiple of the best raster's path."""

RASTERS = (*range(2, 26), 28, 31, 35, 41)
MOST_LEGS = 400


@dataclass(frozen=True, slots=True)
class Rule:
    """When to stop: limit on the true error [mm], and the goal of the planner [m]."""

    name: str
    measure: GoalError
    limit: float
    goal: float
    asked: tuple[float, float]
    """Largest median ratio on homogeneous shapes, and where detail is local."""

    def met(self, off: np.ndarray) -> bool:
        """Return whether true errors [mm] meet the limit."""
        error = np.sqrt((off**2).mean()) if self.measure is GoalError.RMS else np.abs(off).max()
        return bool(error <= self.limit)


RULES = (
    Rule("RMS 0.02 mm", GoalError.RMS, 0.02, 2e-5, (1.1, 0.75)),
    Rule("max 0.1 mm", GoalError.LARGEST, 0.1, 6e-5, (1.1, 0.65)),
)


def best_rasters(shape: Shape, seed: int) -> dict[Rule, float]:
    """Return the length of the shortest raster that meets each rule [mm]."""
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
        if all(map(math.isfinite, best.values())):
            break
    return best


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """One leg: path so far [mm], errors of the map after it [mm] (None: not in contact)."""

    path: float
    off: np.ndarray | None


def explore(shape: Shape, rule: Rule, seed: int) -> Iterator[Step]:
    """Explore until the planner has enough."""
    rng = np.random.default_rng((seed, 2))
    planner = Active(2e-3 * HALF, 2e-3 * HALF, Goal(rule.goal, rule.measure))
    found, at, path, leg = SplineMap(), np.full(2, -HALF), 0.0, planner.next(None)
    for _ in range(MOST_LEGS):
        if leg is None:
            return
        assert isinstance(leg, Hop | Stroke)
        to = [leg.to] if isinstance(leg, Hop) else list(leg.corners)
        corners = np.array([at, *(1e3 * np.array(to))])
        lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
        corners = corners[np.concatenate([[True], lengths > 1e-6])]
        path += float(lengths.sum())
        off = None
        if isinstance(leg, Stroke):
            contacts = feel(shape, corners, rng)
            for x, y, z, zx, zy in contacts.tolist():
                s = 1.0 / math.sqrt(1.0 + zx * zx + zy * zy)
                point = (1e-3 * x, 1e-3 * y, 1e-3 * z)
                planner.feel(ContactPeriod(point, point, (-zx * s, -zy * s, s)))
            found.add(*means(contacts))
            off = found.off(shape)
        yield Step(path, off)
        at = corners[-1]
        leg = planner.next(LegResult(LegEnd.REACHED, (1e-3 * at[0], 1e-3 * at[1], 0.0)))


def active_path(shape: Shape, rule: Rule, seed: int, longest: float) -> tuple[float, bool]:
    """Return the path until the rule is met [mm], and whether the planner stopped too early."""
    for step in explore(shape, rule, seed):
        if step.off is not None and rule.met(step.off):
            return step.path, False
        if step.path > longest:
            return math.inf, False
    return math.inf, True


def report(effort: Effort, families: Sequence[Family] = FAMILIES) -> Study:
    """Explore all shapes; the ratio is NaN where no raster meets the rule."""
    pooled: dict[tuple[str, bool, Rule], list[float]] = {}
    early = 0
    for family in families:
        for seed in range(FIRST_SEED + effort.seed, FIRST_SEED + effort.seed + effort.of(10, 1)):
            effort.tell(f"active: {family.name}, seed {seed}")
            shape = family.draw(np.random.default_rng(seed))
            for rule, best in best_rasters(shape, seed).items():
                path, stopped = (
                    active_path(shape, rule, seed, LONGEST * best) if math.isfinite(best) else (math.nan, False)
                )
                early += stopped
                for name in (family.name, "all local" if family.local else "all homogeneous"):
                    pooled.setdefault((name, family.local, rule), []).append(path / best)
    title, checks = "Path of the active exploration over that of the best raster", []
    table = grid(title, "shape", "stop at", "median", f"each (inf: not within {LONGEST})")
    for (name, local, rule), ratios in sorted(pooled.items(), key=lambda item: item[0][0].startswith("all")):
        median, asked = float(np.nanmedian(ratios)), rule.asked[local]
        if name.startswith("all"):
            checks.append(Check.at_most(f"{name}, {rule.name}", asked, median))
        table.add_row(name, rule.name, f"{median:.2f}", " ".join(f"{ratio:.2f}" for ratio in ratios))
    return Study(title, f"Stopped too early: {early}.", checks=tuple(checks), tables=(table,))


PARTS = {"report": report}

if __name__ == "__main__":
    start(__doc__, PARTS)
