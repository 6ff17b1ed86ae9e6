"""A sweep: the same experiment many times.

Force is held on a surface that goes up and down. The controller's gain is made for a contact stiffness that is
assumed; the true one is 20 kN/m. The sweep tries some of them, at some speeds of the surface, with several seeds
of the sensor's noise, over all cores. Then it draws its own picture from the table that a sweep leaves.

    python examples/sweep.py --seeds 3

What is typed at a terminal as `palpate sweep regulate --vary surface_speed=0.01,0.02 ...` does the same. What is
finished is kept: interrupted, and started again, it goes on. The softer the contact is taken for, the higher the
gain, and the smaller the error; it grows with the speed.
"""

import csv
from collections import defaultdict
from pathlib import Path

import numpy as np
import tyro

import palpate as pp
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Line
from palpate.reporting.paper import write_figure
from palpate.runtime.palette import SIDE_BY_SIDE

VARIED = ("surface_speed=0.01,0.02", "assumed_stiffness=10e3,20e3,40e3")  # [m/s], [N/m]
FIXED = ("surface=sine", "force=2", "duration=1", "force_noise=0.01")  # [N], [s], [N]


def main(out: Path = Path("runs/example-sweep"), vary: tuple[str, ...] = VARIED, seeds: int = 1) -> None:
    """Do what is not done yet, and draw it."""
    result = pp.sweep(pp.SweepConfig("regulate", vary=(vary,), set=(FIXED,), seeds=seeds, out=out))
    print(result.outcome)

    errors: dict[float, dict[float, list[float]]] = defaultdict(lambda: defaultdict(list))
    with (out / "runs.csv").open(encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            if row["status"] == "done":
                speed, stiffness = float(row["surface_speed"]), float(row["assumed_stiffness"])
                errors[speed][stiffness].append(float(row["force_rms_n"]))
    lines = []
    for colour, (speed, at) in zip(SIDE_BY_SIDE, errors.items(), strict=False):
        stiffness, medians = np.array(list(at)), np.array([np.median(values) for values in at.values()])
        lines.append(Line(stiffness, medians, f"{1e3 * speed:g} mm/s", colour, points=True))
    axes = Axis("assumed stiffness", "N/m", logarithmic=True), Axis("force error, RMS", "N")
    write_figure(Figure("Force error", "", (Panel(tuple(lines), *axes, title="surface"),)), out / "own.png")


if __name__ == "__main__":  # needed: other processes import this file
    tyro.cli(main)
