"""A shape, the path over it, and the errors of its map at the end."""

from pathlib import Path

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from active_exploration.explore import RULES, explore
from active_exploration.shapes import HALF, Family
from active_exploration.spline_map import GRID_X, GRID_Y


def draw(family: Family, seed: int, path: Path) -> None:
    """Explore the shape of a seed until the second rule is met, and draw."""
    shape, rule = family.report(np.random.default_rng(seed)), RULES[1]
    lines, way, off = [], 0.0, np.zeros_like(GRID_X)
    for step in explore(shape, rule, seed):
        lines.append(step.corners)
        way = step.path_length
        if step.off is not None:
            off = step.off
            if rule.met(off):
                break
    figure = Figure(figsize=(10.0, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    extent = (-HALF, HALF, -HALF, HALF)
    heights = left.imshow(shape(GRID_X, GRID_Y)[0], origin="lower", extent=extent, cmap="Greys_r")
    left.add_collection(LineCollection(lines, array=np.arange(len(lines)), cmap="viridis", linewidths=1.2))
    figure.colorbar(heights, ax=left, label="height [mm]")
    left.set_title(f"{family.name}: {way:.0f} mm\nof path, dark to light")
    limit = 1e3 * rule.limit
    errors = right.imshow(1e3 * off, origin="lower", extent=extent, cmap="RdBu", vmin=-limit, vmax=limit)
    figure.colorbar(errors, ax=right, label="error of the map [um]")
    right.set_title(f"largest error {1e3 * float(np.abs(off).max()):.0f} um,\nRMS {1e3 * float(off.std()):.0f} um")
    for axes in (left, right):
        axes.set_xlabel("x [mm]")
        axes.set_ylabel("y [mm]")
    figure.savefig(path, dpi=130)
