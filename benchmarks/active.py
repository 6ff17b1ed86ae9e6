"""How far an active exploration goes, against the best raster in hindsight.

    python benchmarks/active.py [--seeds 10] [--tune] [--shapes WORD] [--coverage] [--picture FILE]

Pure geometry: contacts at 500 Hz and 20 mm/s on 60 x 60 mm seen from above, position noise of 0.03 mm correlated
over 1 mm of path, normals off by 0.5 degrees. Both explorations feed the same map (a smoothing spline through
heights and slopes, smoothness by maximum likelihood) and stop by the same rule: true RMS error below 0.02 mm, or
largest below 0.1 mm. Rasters of 2 to 41 rows are tried and the shortest way that meets the rule is the best; the
way of the active exploration counts what lies between its strokes too.

"Detail is local" means: something flat or gently curved with 1 to 4 bumps, dents, ridges or grooves, 2 to 8 mm
wide at half height and 0.1 to 0.4 of that high, which together cover at most 5 % of the field (counted where they
are at least a tenth of their height). `--coverage` tells how the gain shrinks as details cover more. `--tune` uses
the seeds that the settings were chosen with, and details of three profiles; the report has others, and one
profile.
"""

import argparse
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
from active_exploration.explore import RULES, Rule, active_way, best_rasters
from active_exploration.picture import draw
from active_exploration.shapes import FAMILIES, Family, covered
from rich.console import Console
from rich.progress import track
from rich.table import Table

from palpate.controllers.paths import GoalError

TUNE_SEED, REPORT_SEED = 5000, 2000
COVERAGES = (0.01, 0.05, 0.1, 0.3)
LONGEST = 1.6
"""The active exploration is given up at this many ways of the best raster."""

ASKED = {
    (False, GoalError.RMS): 1.1,
    (False, GoalError.LARGEST): 1.1,
    (True, GoalError.RMS): 0.75,
    (True, GoalError.LARGEST): 0.65,
}


def ratios(family: Family, seed: int, *, tune: bool) -> list[tuple[Rule, float, bool]]:
    """Per rule: way over that of the best raster, and whether the planner stopped before the rule was met."""
    shape = (family.tuning if tune else family.report)(np.random.default_rng(seed))
    best = best_rasters(shape, seed)
    found = []
    for rule in RULES:
        longest = LONGEST * best[rule] if math.isfinite(best[rule]) else math.nan
        way, stopped = active_way(shape, rule, seed, longest) if math.isfinite(longest) else (math.nan, False)
        found.append((rule, way / best[rule], stopped))
    return found


def measure(families: list[Family], seeds: range, asked: Callable[[Family, Rule], str], *, tune: bool) -> Table:
    """Explore and tabulate."""
    table = Table(title="Way of the active exploration over that of the best raster in hindsight")
    for heading in ("shape", "stop at", "asked", "median", f"each (inf: not within {LONGEST})"):
        table.add_column(heading)
    jobs = [(family, seed) for family in families for seed in seeds]
    pooled: dict[tuple[str, Rule], list[float]] = {}
    early: dict[tuple[str, Rule], int] = {}
    for family, seed in track(jobs, "exploring", transient=True):
        for rule, ratio, stopped in ratios(family, seed, tune=tune):
            for name in (family.name, "all local" if family.local else "all homogeneous"):
                pooled.setdefault((name, rule), []).append(ratio)
                early[name, rule] = early.get((name, rule), 0) + stopped
    by_name = {family.name: family for family in families}
    by_name |= {("all local" if family.local else "all homogeneous"): family for family in families}
    for (name, rule), found in sorted(pooled.items(), key=lambda item: item[0][0].startswith("all")):
        each = "" if name.startswith("all") else " ".join(f"{ratio:.2f}" for ratio in found)
        each += f"; {early[name, rule]} stopped early" if early[name, rule] else ""
        table.add_row(name, rule.name, asked(by_name[name], rule), f"{np.nanmedian(found):.2f}", each)
    return table


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--tune", action="store_true", help="the shapes and seeds that settings were chosen with")
    parser.add_argument("--shapes", default="", help="only shapes whose name contains this")
    parser.add_argument("--coverage", action="store_true", help="how the gain shrinks as details cover more")
    parser.add_argument(
        "--picture", type=Path, help="draw one shape, the path over it and the errors; nothing else"
    )
    arguments = parser.parse_args()
    first = TUNE_SEED if arguments.tune else REPORT_SEED
    if arguments.picture is not None:
        draw(next(f for f in FAMILIES if arguments.shapes in f.name and f.local), first, arguments.picture)
        return
    families = [covered(part) for part in COVERAGES] if arguments.coverage else list(FAMILIES)
    families = [family for family in families if arguments.shapes in family.name]
    seeds = range(first, first + arguments.seeds)

    def asked(family: Family, rule: Rule) -> str:
        return "-" if arguments.coverage else f"{ASKED[family.local, rule.measure]}"

    Console(width=150).print(measure(families, seeds, asked, tune=arguments.tune))


if __name__ == "__main__":
    main()
