"""How exactly touches find a fingertip, whether intervals cover, what plans are worth, and what it does to maps.

    python benchmarks/tip_calibration.py coverage [--seeds 200]
    python benchmarks/tip_calibration.py plans
    python benchmarks/tip_calibration.py map [--out docs/tip_calibration.png]

coverage: tips drawn wrong (size 5 %, centre 1 mm, tilt 3 degrees, stiffness twice or half) are touched 60 times,
by geometry solved otherwise than the estimator does, with the noise and the cross-talk of a Nano17 and of a wrist
sensor. map: an ellipsoid is explored in MuJoCo with a tip typed wrong, the calibrated one, and the true one.
"""

import argparse
import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

# matrices are small: threads of a linear algebra library only wait for one another
os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.spatial.transform import Rotation

sys.path.append(str(Path(__file__).resolve().parents[1] / "tests"))

from palpate.errors import FloatArray
from palpate.sensing.tip_calibration import Unknowns, candidate_touches, fit_tip, planned_touches
from support.touched_targets import NANO17, TARGETS, WRIST, Instrumented, robot, touches, typed_tip, wrong

SPHERE, ELLIPSOID = (0.008,), (0.008, 0.006, 0.01)
COUNT, TILT = 60, 0.5


@dataclass(frozen=True, slots=True)
class Case:
    """A tip on a sensor, on a robot that may turn it."""

    name: str
    kind: Instrumented
    semi_axes: tuple[float, ...]
    tilt: float


CASES = (
    Case("Nano17, sphere", NANO17, SPHERE, TILT),
    Case("Nano17, sphere, no turning", NANO17, SPHERE, 0.0),
    Case("Nano17, ellipsoid", NANO17, ELLIPSOID, TILT),
    Case("wrist, sphere", WRIST, SPHERE, TILT),
    Case("wrist, ellipsoid", WRIST, ELLIPSOID, TILT),
)


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """One calibration: errors of sizes and centre [m], tilt [rad], stiffness; what covered; whether it was OK."""

    length: FloatArray
    tilt: float
    stiffness: float
    covered: FloatArray
    ok: bool


def outcomes(case: Case, seeds: int, console: Console) -> Iterator[Outcome]:
    """Yield a calibration of each seed, all by the same plan."""
    tip, plan = typed_tip(case.semi_axes), robot(case.kind, case.tilt)
    candidates = candidate_touches(tip, TARGETS, plan)
    planned, _ = planned_touches(candidates, COUNT, tip, TARGETS, plan, case.kind.instrument)
    sizes = len(case.semi_axes)
    for seed in track(range(seeds), case.name, console=console, transient=True):
        rng = np.random.default_rng(seed)
        true = wrong(tip, rng)
        if sizes == 1:
            true = replace(true, semi_axes=(true.semi_axes[0],) * 3)
        fit = fit_tip(touches(true, planned, case.kind, rng), TARGETS, tip, case.kind.instrument)
        blocks, half = fit.unknowns.blocks, fit.half_widths()
        stiffness = float(fit.unknowns.of("stiffness", fit.values)[0] - np.log(true.stiffness))
        length = np.concatenate([fit.sizes - true.semi_axes[:sizes], fit.center - true.center])
        turned = Rotation.from_matrix(fit.rotation.T @ true.rotation).as_rotvec() if sizes == 3 else np.zeros(0)
        errors = np.concatenate([length, turned, [stiffness]])
        halves = np.concatenate([half[blocks[name]] for name in ("size", "center", "rotation", "stiffness")])
        tilt = float(np.linalg.norm(turned))
        yield Outcome(length, tilt, stiffness, np.abs(errors) < halves, fit.verdict.ok)


def coverage(seeds: int) -> None:
    """Print errors and coverage."""
    console = Console()
    table = Table(title=f"{COUNT} touches, {seeds} seeds")
    for column in (
        "case",
        "size, centre 95 % [um]",
        "worst [um]",
        "tilt 95 % [deg]",
        "stiffness 95 %",
        "covered",
        "OK",
    ):
        table.add_column(column)
    for case in CASES:
        found = list(outcomes(case, seeds, console))
        length = np.abs([each.length for each in found])
        tilt = np.degrees([each.tilt for each in found])
        table.add_row(
            case.name,
            f"{1e6 * np.percentile(length, 95):.1f}",
            f"{1e6 * length.max():.1f}",
            f"{np.percentile(tilt, 95):.2f}" if len(case.semi_axes) == 3 else "has none",
            f"{100 * np.percentile(np.abs([each.stiffness for each in found]), 95):.1f} %",
            f"{100 * np.mean([each.covered.mean() for each in found]):.1f} %",
            f"{sum(each.ok for each in found)} of {seeds}",
        )
    console.print(table)


def plans() -> None:
    """Print variances of random touches over those of planned ones."""
    console = Console()
    table = Table(title="variance by random touches over that by planned ones")
    for column in ("case", "touches", "size", "centre", "tilt", "stiffness"):
        table.add_column(column)
    for case in CASES:
        tip, plan = typed_tip(case.semi_axes), robot(case.kind, case.tilt)
        candidates = candidate_touches(tip, TARGETS, plan)
        blocks = Unknowns(tip, TARGETS).blocks
        for count in (20, COUNT):
            _, best = planned_touches(candidates, count, tip, TARGETS, plan, case.kind.instrument)
            rng = np.random.default_rng(0)
            some = []
            for _ in range(20):
                chosen = [candidates[i] for i in rng.choice(len(candidates), count, replace=False)]
                some.append(planned_touches(chosen, count, tip, TARGETS, plan, case.kind.instrument)[1] ** 2)
            ratio = np.mean(some, axis=0) / best**2
            shown = (np.mean(ratio[blocks[name]]) if ratio[blocks[name]].size else np.nan for name in GROUPS)
            table.add_row(case.name, str(count), *(f"{each:.1f}" if each == each else "-" for each in shown))
    console.print(table)


GROUPS = ("size", "center", "rotation", "stiffness")


def main() -> None:
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    covering = commands.add_parser("coverage")
    covering.add_argument("--seeds", type=int, default=200)
    commands.add_parser("plans")
    commands.add_parser("map").add_argument("--out", type=Path, default=Path("docs/tip_calibration.png"))
    asked = parser.parse_args()
    if asked.command == "coverage":
        coverage(asked.seeds)
    elif asked.command == "plans":
        plans()
    else:
        from tip_maps.compared import draw_maps

        draw_maps(asked.out)


if __name__ == "__main__":
    main()
