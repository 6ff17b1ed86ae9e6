"""Models of force/torque sensors on real calibration data: errors on loads that were left out of the fit.

    python benchmarks/calibration_sets.py loads.csv
    python benchmarks/calibration_sets.py folder --channels s0 s1 s2 s3 s4 s5 s6 s7 --loads Fx Fy Fz Mx My Mz
    python benchmarks/calibration_sets.py data.mat --columns 8

Formats, nothing of which comes with palpate (docs/calibrate.md names sets that were tried):

- a CSV file with one load per line: raw channels raw_0, raw_1, ... and loads fx, fy, fz, mx, my, mz, or the names
  given; lines of one load that follow one another are averaged,
- a folder of such files, one pose of one weight each, which is averaged,
- a MATLAB file with one matrix: raw channels in the first columns, six loads in the next.

Units do not count: errors are in percent of the largest load of each axis. Every load (all its lines, or its file)
is left out in turn; what is proposed is chosen anew from the others, so that the choice is judged by
loads left out as well. Ends with 1 if that is worse than direct regression.
"""

import argparse
import csv
import sys
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table
from scipy.io import loadmat

from palpate.errors import InvalidValueError
from palpate.sensing.ft import choose_calibration
from palpate.sensing.ft.arrays import AXES
from palpate.sensing.ft.left_out import equal_loads, grouped

RAW = [f"raw_{i}" for i in range(6)]
LOADS = ["fx", "fy", "fz", "mx", "my", "mz"]
FOLDS = 60
"""Loads are left out one by one up to that many, in as many random groups beyond."""

MODELS = ("sensor model", "direct regression", "proposed")


def main() -> int:
    """Print the table; return 1 if what is proposed is worse than direct regression."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="a CSV file, a folder of them, or a MATLAB file")
    parser.add_argument("--channels", nargs="+", default=RAW, help="columns of the raw channels")
    parser.add_argument("--loads", nargs=6, default=LOADS, help="columns of the loads")
    parser.add_argument("--columns", type=int, default=8, help="raw channels of a MATLAB file")
    asked = parser.parse_args()
    raw, loads = read(asked.data, asked.channels, asked.loads, asked.columns)
    ranges = np.abs(loads).max(axis=0)
    groups = folds(loads)
    table = Table("model", "all axes", *AXES, title=f"{asked.data.name}: {len(loads)} loads, % of the largest")
    pooled = []
    for name, missed in zip(MODELS, left_out(raw, loads, ranges, groups) / ranges, strict=True):
        pooled.append(100.0 * float(np.sqrt((missed**2).mean())))
        table.add_row(name, f"{pooled[-1]:.3f}", *(f"{x:.3f}" for x in 100.0 * np.sqrt((missed**2).mean(axis=0))))
    table.caption = f"from all loads: {choose_calibration(raw, loads, ranges=ranges).proposed.model}"
    Console(width=120).print(table)
    return int(pooled[2] > pooled[1])


def left_out(raw: np.ndarray, loads: np.ndarray, ranges: np.ndarray, groups: list[np.ndarray]) -> np.ndarray:
    """Return the errors of all loads by each model, which never saw them, shape (models, n, 6)."""
    missed = np.empty((len(MODELS), *loads.shape))
    for group in track(groups, "left out", transient=True):
        others = np.setdiff1d(np.arange(len(raw)), group)
        choice = choose_calibration(raw[others], loads[others], ranges=ranges)
        for errors, fit in zip(missed, (*choice.fits[:2], choice.proposed), strict=True):
            errors[group] = fit.apply(raw[group]) - loads[group]
    return missed


def folds(loads: np.ndarray) -> list[np.ndarray]:
    """Return the rows that are left out together."""
    alone = grouped(equal_loads(loads))
    if len(alone) <= FOLDS:
        return list(alone)
    order = np.random.default_rng(0).permutation(len(alone))
    return [np.concatenate([alone[i] for i in order[k::FOLDS]]) for k in range(FOLDS)]


def read(path: Path, channels: list[str], loads: list[str], columns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return raw channels and loads."""
    if path.suffix == ".mat":
        matrices = [value for name, value in loadmat(path).items() if not name.startswith("__")]
        whole = np.asarray(matrices[0], float)
        return whole[:, :columns], whole[:, columns : columns + 6]
    if path.is_dir():
        files = [
            rows
            for rows in (columns_of(file, channels + loads) for file in sorted(path.glob("*.csv")))
            if len(rows)
        ]
        whole = np.array([rows.mean(axis=0) for rows in files])
    else:
        rows = columns_of(path, channels + loads)
        changes = np.flatnonzero((np.diff(rows[:, len(channels) :], axis=0) != 0.0).any(axis=1)) + 1
        whole = np.array([part.mean(axis=0) for part in np.split(rows, changes)])
    return whole[:, : len(channels)], whole[:, len(channels) :]


def columns_of(path: Path, names: list[str]) -> np.ndarray:
    """Return columns of a CSV file; lines without all numbers are left out."""
    with path.open(newline="") as file:
        lines = [[line.get(name) or "nan" for name in names] for line in csv.DictReader(file)]
    rows = np.array(lines, float).reshape(-1, len(names))
    return rows[np.isfinite(rows).all(axis=1)]


if __name__ == "__main__":
    try:
        sys.exit(main())
    except InvalidValueError as error:
        sys.exit(f"refused: {error}")
