"""Make the pictures of README and docs: `make pictures`, or `python docs/make_pictures.py`."""

from pathlib import Path

import matplotlib.image
import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from palpate import Sphere, contact_from_wrench
from palpate.experiments.explore import explore
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.explore_report import exploration_report
from palpate.reporting.error_picture import error_map
from palpate.reporting.style import MEASURED, QUIET, TRUE, Width, dress, new_figure
from palpate.reporting.surface_picture import touched_surface

DOTS_PER_INCH = 110
HERE = Path(__file__).parent


def pixels(figure: Figure) -> np.ndarray:
    """Return a figure as an RGB picture."""
    figure.set_dpi(DOTS_PER_INCH)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3]


def exploration() -> None:
    """Explore an ellipsoid and put what was felt beside where the errors are."""
    found = explore(ExploreConfig(object="ellipsoid", width=0.05, speed=0.03, force_noise=0.01, moment_noise=1e-4))
    report = exploration_report(found)
    assert report.point_error is not None
    assert report.map is not None
    left = pixels(touched_surface(report.cloud, report.map.mesh).full)
    right = pixels(error_map(report.cloud, report.point_error).full)
    height = max(len(left), len(right))
    padded = [np.pad(p, ((0, height - len(p)), (0, 0), (0, 0)), constant_values=255) for p in (left, right)]
    matplotlib.image.imsave(HERE / "exploration.png", np.hstack(padded))
    print(f"exploration.png: points {1e6 * found.point_rms:.1f} µm RMS from the true surface")


def centroid_and_wrench_axis() -> None:
    """The paper's example (Table 1): four points on top of a sphere, and what the two methods make of them."""
    radius = 10.0
    figure = new_figure(Width.FULL, 2.0)
    for axes, (delta, friction) in zip(
        figure.subplots(1, 3), ((0.125, 1.0), (0.25, 1.0), (0.5, 1.0)), strict=True
    ):
        flat = np.array([[0.0, 8 * delta], [delta, 0.0], [0.0, -8 * delta], [-delta, 0.0]])
        points = np.column_stack([flat, np.sqrt(radius**2 - np.sum(flat**2, axis=1))])
        # the paper's order of signs: -, -, +, + along the rhombus' corners
        forces = np.column_stack([friction * np.array([-1, -1, 1, 1]), np.full(4, friction), np.full(4, -1.0)])
        wrench = np.concatenate([forces.sum(axis=0), np.cross(points, forces).sum(axis=0)])
        soft = contact_from_wrench(Sphere(radius), wrench)
        hard = contact_from_wrench(Sphere(radius), wrench, model="hard")
        # the long diagonal lies along the page: y to the right, x up
        axes.fill(flat[:, 1], flat[:, 0], color="#dfe6ee", zorder=0, label="contact convex hull")
        axes.quiver(*flat.T[::-1], forces[:, 1], forces[:, 0], color=QUIET, width=0.007, scale=16, zorder=2)
        axes.plot(*flat.T[::-1], "o", color=QUIET, markersize=4, label="points in contact, with friction")
        axes.plot(*soft.centroid[1::-1], "o", color=MEASURED, markersize=8, label="contact centroid")
        axes.plot(*hard.centroid[1::-1], "X", color=TRUE, markersize=8, label="wrench axis")
        axes.set_title(f"delta = {delta:g} of a sphere with R = 10", fontsize=9)
        axes.set_aspect("equal")
        axes.set_xlim(-10 * delta, 10 * delta)
        axes.set_ylim(-2.8 * delta, 2.8 * delta)
        dress(axes, x="y", y="x")
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=4, frameon=False, fontsize=9)
    matplotlib.image.imsave(HERE / "centroid_and_wrench_axis.png", pixels(figure))
    print("centroid_and_wrench_axis.png")


if __name__ == "__main__":
    centroid_and_wrench_axis()
    exploration()
