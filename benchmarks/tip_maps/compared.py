"""One object explored with a wrong tip, the calibrated one and the true one, in MuJoCo; and a picture of it."""

from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from rich.console import Console
from rich.table import Table

import palpate as pp
from palpate.errors import FloatArray
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.explore.exploration import Exploration
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.kit.script import plan_for
from palpate.experiments.tip_calibration import calibrate_tip
from palpate.experiments.tip_calibration.config import TipConfig
from palpate.surfaces import Sphere

ROBOT = "turning-stage-nano17"
SIZE_ERROR = 0.05
CENTER_ERROR = (6e-4, -6e-4, 5e-4)
"""[m] By which the true centre is elsewhere than typed: 1 mm."""


@dataclass(frozen=True, slots=True)
class Error:
    """By how much a tip that is believed is off: radius [m] and center [m]."""

    name: str
    radius: float
    center: FloatArray


def calibrated_error() -> Error:
    """Return what is left after a calibration of a tip that was typed wrong."""
    config = TipConfig(robot=ROBOT, size_error=SIZE_ERROR, center_error=CENTER_ERROR)
    fit = calibrate_tip(config).fit
    if fit is None:
        raise SystemExit("the calibration found nothing")
    true = 0.008 * (1.0 + SIZE_ERROR)
    return Error("calibrated", float(fit.sizes[0] - true), fit.center - np.array(CENTER_ERROR))


def explored(error: Error) -> Exploration:
    """Return an ellipsoid explored by the true tip, whose contacts are found on one that is off."""
    config = pp.ExploreConfig(robot=ROBOT, object="ellipsoid", size=(0.05, 0.04, 0.03), width=0.03, depth=0.02)
    plan = plan_for(Explore(), config)
    true = plan.finger.surface
    wrong = Sphere(true.radius + error.radius, center=true.center + error.center)
    plan = replace(plan, finger=replace(plan.finger, surface=wrong))
    return Explore().found(plan, carry_out(plan))


def draw_maps(out: Path) -> None:
    """Explore three times, print the errors of the maps, and draw them side by side."""
    console = Console()
    typed = Error("as typed", -0.008 * SIZE_ERROR, -np.array(CENTER_ERROR))
    errors = (typed, calibrated_error(), Error("true", 0.0, np.zeros(3)))
    table = Table(title="map of an ellipsoid, Nano17, by what is believed of the tip")
    for column in ("tip", "radius, centre off [um]", "map RMS [um]", "by the true tip's", "run", "told"):
        table.add_column(column)
    found = [explored(each) for each in errors]
    best = found[-1].map.rms
    figure, places = plt.subplots(1, 3, figsize=(12, 3.4), constrained_layout=True)
    for error, each, axes in zip(errors, found, places, strict=True):
        rms = each.map.rms
        off = 1e6 * np.linalg.norm(error.center)
        told = "" if each.tip is None else "; ".join(broken.finding for broken in each.tip.broken())
        lengths = f"{1e6 * error.radius:.2f}, {off:.2f}"
        table.add_row(
            error.name, lengths, f"{1e6 * rms:.2f}", f"{rms / best:.2f}", str(each.run), told or "agrees"
        )
        height = 1e6 * np.abs(each.map.error)
        x, y = 1e3 * each.map.mesh.vertices[:, :2].T
        shown = axes.scatter(x, y, c=height, s=3, cmap="viridis", norm="log", vmin=0.1, vmax=2e3)
        axes.set(title=f"{error.name}: {1e6 * rms:.3g} um RMS", xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
        axes.set(xlim=(-17.0, 17.0), ylim=(-12.0, 12.0))
    figure.colorbar(shown, ax=places, label="distance to the true surface [um]")
    figure.savefig(out, dpi=110)
    console.print(table)
    console.print(f"Written: {out}")
