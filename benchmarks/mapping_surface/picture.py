"""Error and uncertainty of a map, side by side."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib import pyplot as plt
from PIL import Image

from mapping_surface.shapes import SHAPES, Errors, felt
from palpate.mapping import SurfaceMap

GRID = 100


def draw(path: Path) -> None:
    """Draw bumps and torus over their parameters; a hole in the raster of the bumps is hatched."""
    mpl.use("Agg")
    figure, axes = plt.subplots(2, 3, figsize=(13, 8), layout="constrained")
    for row, name in zip(axes, ("bumps", "torus"), strict=True):
        shape = next(each for each in SHAPES if each.name == name)
        u, v = shape.rows(1e-3)
        cloud = felt(*shape.surface(u, v), Errors(), np.random.default_rng(0))
        if name == "bumps":
            cloud = cloud.select(np.hypot(u - 0.012, v + 0.008) > 0.005)
        made = SurfaceMap.learned(cloud)
        U, V = np.meshgrid(np.linspace(*shape.u, GRID), np.linspace(*shape.v, GRID))
        answer = made.query(shape.surface(U.ravel(), V.ravel())[0])
        hidden = ~answer.observed
        scale = 1e3 if name == "bumps" else np.degrees(1.0)
        extent = [scale * shape.u[0], scale * shape.u[1], scale * shape.v[0], scale * shape.v[1]]
        panels = (
            ("error, mm", 1e3 * answer.distance, "RdBu_r", (-0.02, 0.02)),
            ("standard deviation, mm", 1e3 * answer.sd, "viridis", (0.0, 0.012)),
            ("|error| / 95 % band", np.abs(answer.distance) / answer.band(), "magma_r", (0.0, 1.2)),
        )
        for axis, (title, values, colours, limits) in zip(row, panels, strict=True):
            shown = np.where(hidden, np.nan, values).reshape(GRID, GRID)
            axis.set_facecolor("0.8")
            image = axis.imshow(
                shown, origin="lower", extent=extent, cmap=colours, vmin=limits[0], vmax=limits[1], aspect="auto"
            )
            figure.colorbar(image, ax=axis)
            axis.set_title(f"{name}: {title}")
            axis.set_xlabel("x, mm" if name == "bumps" else "around the axis, degrees")
            axis.set_ylabel("y, mm" if name == "bumps" else "around the tube, degrees")
    figure.suptitle(
        "Rows 1 mm apart, noise 0.03 mm kept along 1 mm of path, normals 0.5 degrees; grey: not observed"
    )
    # few pixels and no transparency instead of a palette, which would show bands where colours pass gently
    figure.savefig(path, dpi=56)
    plt.close(figure)
    with Image.open(path) as drawn:
        drawn.convert("RGB").save(path, optimize=True)
