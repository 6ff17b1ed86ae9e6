"""Calibration of fingertips by touches: errors, coverage of intervals, and effect on maps.

    python benchmarks/tip_calibration.py [coverage | map ...] [--quick] [--picture docs/tip_calibration.png]

coverage: tips typed wrong (size 5 %, centre 1 mm, tilt 3 degrees, stiffness twice or half) are touched 60 times,
by geometry solved in another way than the estimator's, with noise and cross-talk of a Nano17 and of a wrist
sensor. map: an ellipsoid is explored in MuJoCo with a tip typed wrong, the calibrated one, and the true one;
--picture draws these maps.
"""

import os
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

# matrices are small: threads of a linear algebra library only wait for one another
os.environ.setdefault("OMP_NUM_THREADS", "1")

import matplotlib.pyplot as plt
import numpy as np
from harness.command import run
from harness.study import Effort, Study
from harness.tables import grid
from scipy.spatial.transform import Rotation

import palpate as pp
from palpate.errors import FloatArray
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.exploration import ExplorationResult
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.script import plan_for
from palpate.experiments.tip_calibration import calibrate_tip
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.sensing.tip_calibration import candidate_touches, fit_tip, planned_touches
from palpate.surfaces import Sphere
from support.touched_targets import NANO17, TARGETS, WRIST, Instrumented, robot, touches, typed_tip, wrong

SPHERE, ELLIPSOID = (0.008,), (0.008, 0.006, 0.01)
COUNT, TILT = 60, 0.5
GROUPS = ("size", "center", "rotation", "stiffness")


@dataclass(frozen=True, slots=True)
class Case:
    """A tip on a sensor, on a robot that may turn it by `tilt` [rad]."""

    name: str
    kind: Instrumented
    semi_axes: tuple[float, ...]
    tilt: float = TILT


CASES = (
    Case("Nano17, sphere", NANO17, SPHERE),
    Case("Nano17, sphere, no turning", NANO17, SPHERE, 0.0),
    Case("Nano17, ellipsoid", NANO17, ELLIPSOID),
    Case("wrist, sphere", WRIST, SPHERE),
    Case("wrist, ellipsoid", WRIST, ELLIPSOID),
)


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """One calibration: errors of sizes and centre [m], tilt [rad], stiffness; what its intervals cover; its
    verdict."""

    length: FloatArray
    tilt: float
    stiffness: float
    covered: FloatArray
    ok: bool


def outcomes(case: Case, seeds: range) -> Iterator[Outcome]:
    """Yield a calibration of each seed, all by the same plan."""
    tip, plan, sizes = typed_tip(case.semi_axes), robot(case.kind, case.tilt), len(case.semi_axes)
    candidates = candidate_touches(tip, TARGETS, plan)
    planned, _ = planned_touches(candidates, COUNT, tip, TARGETS, plan, case.kind.instrument)
    for seed in seeds:
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
        halves = np.concatenate([half[blocks[name]] for name in GROUPS])
        tilt = float(np.linalg.norm(turned))
        yield Outcome(length, tilt, stiffness, np.abs(errors) < halves, fit.verdict.ok)


def coverage(effort: Effort) -> Study:
    """Measure errors and coverage."""
    seeds = effort.of(200, 5)
    heads = ("size, centre 95 % [um]", "worst [um]", "tilt 95 % [deg]", "stiffness 95 %", "covered", "OK")
    table = grid(f"{COUNT} touches, {seeds} seeds", "case", *heads)
    for case in CASES:
        effort.tell(f"coverage: {case.name}")
        found = list(outcomes(case, range(effort.seed, effort.seed + seeds)))
        length, tilt = np.abs([each.length for each in found]), np.degrees([each.tilt for each in found])
        cells = (
            f"{1e6 * np.percentile(length, 95):.1f}",
            f"{1e6 * length.max():.1f}",
            f"{np.percentile(tilt, 95):.2f}" if len(case.semi_axes) == 3 else "has none",
            f"{100 * np.percentile(np.abs([each.stiffness for each in found]), 95):.1f} %",
            f"{100 * np.mean([each.covered.mean() for each in found]):.1f} %",
            f"{sum(each.ok for each in found)} of {seeds}",
        )
        table.add_row(case.name, *cells)
    return Study("Coverage", tables=(table,))


# -------------------------------------------------------------------------------------------------------- maps

ROBOT, RADIUS, SIZE_ERROR = "turning-stage-nano17", 0.008, 0.05
CENTER_ERROR = (6e-4, -6e-4, 5e-4)
"""[m] Offset of the true centre from the typed one: 1 mm."""

Explored = dict[str, tuple[float, float, ExplorationResult]]
"""Errors of radius and centre of the assumed tip [m], and the exploration, by name."""


@cache
def explored() -> Explored:
    """Explore an ellipsoid with the tip as typed, as calibrated, and the true one."""
    fit = calibrate_tip(TipCalibrationConfig(robot=ROBOT, size_error=SIZE_ERROR, center_error=CENTER_ERROR)).fit
    if fit is None:
        raise SystemExit("the calibration found nothing")
    true, found = RADIUS * (1.0 + SIZE_ERROR), Explored()
    errors = {
        "as typed": (-RADIUS * SIZE_ERROR, -np.array(CENTER_ERROR)),
        "calibrated": (float(fit.sizes[0] - true), fit.center - np.array(CENTER_ERROR)),
        "true": (0.0, np.zeros(3)),
    }
    for name, (radius, center) in errors.items():
        config = pp.ExploreConfig(robot=ROBOT, object="ellipsoid", size=(0.05, 0.04, 0.03), width=0.03, depth=0.02)
        plan = plan_for(Explore(), config)
        tip = plan.fingers[0].surface
        assumed = Sphere(tip.radius + radius, center=tip.center + center)
        ready = replace(plan.ready, finger=replace(plan.ready.finger, surface=assumed))
        plan = replace(plan, setup=replace(plan.setup, ready=ready))
        found[name] = radius, float(np.linalg.norm(center)), Explore().evaluate(plan, carry_out(plan))
    return found


def maps(_: Effort) -> Study:
    """Measure the maps of an ellipsoid."""
    found = explored()
    best = found["true"][2].map.rms
    heads = ("radius, centre off [um]", "map RMS [um]", "by the true tip's", "run", "message")
    table = grid("Map of an ellipsoid, Nano17, by the assumed tip", "tip", *heads)
    for name, (radius, center, each) in found.items():
        message = "" if each.tip is None else "; ".join(broken.finding for broken in each.tip.broken())
        lengths, rms = f"{1e6 * radius:.2f}, {1e6 * center:.2f}", each.map.rms
        table.add_row(name, lengths, f"{1e6 * rms:.2f}", f"{rms / best:.2f}", str(each.run), message or "agrees")
    return Study("Maps", tables=(table,))


def draw(path: Path) -> None:
    """Draw the three maps side by side."""
    figure, places = plt.subplots(1, 3, figsize=(12, 3.4), constrained_layout=True)
    for (name, (_, _, each)), axes in zip(explored().items(), places, strict=True):
        height, (x, y) = 1e6 * np.abs(each.map.error), 1e3 * each.map.mesh.vertices[:, :2].T
        shown = axes.scatter(x, y, c=height, s=3, cmap="viridis", norm="log", vmin=0.1, vmax=2e3)
        title = f"{name}: {1e6 * each.map.rms:.3g} um RMS"
        axes.set(
            title=title, xlabel="x [mm]", ylabel="y [mm]", aspect="equal", xlim=(-17.0, 17.0), ylim=(-12.0, 12.0)
        )
    figure.colorbar(shown, ax=places, label="distance to the true surface [um]")
    figure.savefig(path, dpi=110)


PARTS = {"coverage": coverage, "map": maps}

if __name__ == "__main__":
    sys.exit(run(__doc__, PARTS, picture=draw))
