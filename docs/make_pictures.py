"""Make the pictures of README and docs: `make pictures`, or `python docs/make_pictures.py`."""

import csv
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from palpate import Ellipsoid, LimitSurface, Sphere, contact_from_wrench
from palpate.experiments.explore import explore
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.surface_figure import ERROR_OF_POINTS, HEIGHT_QUANTITY, surface_figure
from palpate.friction.pressure import limit_curve
from palpate.reporting.figure import Space
from palpate.reporting.paper import write_figure
from palpate.reporting.solids import coloured_by
from palpate.runtime import palette

INK, QUIET, GRID = (each.light for each in (palette.INK_COLOUR, palette.QUIET_COLOUR, palette.GRID_COLOUR))
MEASURED, TRUE, WANTED, LIMIT = (each.light for each in (palette.FELT, palette.TRUTH, palette.SET, palette.BOUND))

WIDTH = 10.2
"""[inch]"""

DOTS_PER_INCH = 110
HERE = Path(__file__).parent


def new_figure(height: float) -> Figure:
    """Return an empty figure, `height` in inches."""
    return Figure(figsize=(WIDTH, height), layout="constrained")


def style_axes(axes: Axes, *, x: str, y: str) -> None:
    """Label `axes` with quantities and units, and give it the look of reports."""
    axes.set_xlabel(x, fontsize=9.0, color=INK)
    axes.set_ylabel(y, fontsize=9.0, color=INK)
    axes.tick_params(labelsize=8.5, colors=INK, length=3)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(QUIET)
    axes.set_axisbelow(True)
    axes.grid(visible=True, color=GRID, linewidth=0.6)


def legend_above(figure: Figure, axes: Axes, columns: int) -> None:
    """Put one legend above all, each label once."""
    handles, labels = axes.get_legend_handles_labels()
    entries = dict(zip(labels, handles, strict=True))
    figure.legend(
        list(entries.values()), list(entries), loc="outside upper center", ncols=columns, frameon=False, fontsize=9
    )


def save(figure: Figure, name: str) -> None:
    """Write a figure beside this file, and say so."""
    figure.savefig(HERE / name, dpi=DOTS_PER_INCH)
    print(name)


def exploration() -> None:
    """Explore an ellipsoid and put what was felt beside where the errors are."""
    found = explore(ExploreConfig(object="ellipsoid", width=0.05, speed=0.03, force_noise=0.01, moment_noise=1e-4))
    picture = surface_figure(found)
    assert picture is not None
    (space,) = picture.panels
    assert isinstance(space, Space)
    sides = (replace(space, marks=coloured_by(space.marks, each)) for each in (HEIGHT_QUANTITY, ERROR_OF_POINTS))
    write_figure(replace(picture, panels=tuple(sides), columns=2), HERE / "exploration.png")
    print(f"exploration.png: points {1e6 * found.point_rms:.1f} µm RMS from the true surface")


def centroid_and_wrench_axis() -> None:
    """The paper's example (Table 1): four points on top of a sphere, and what the two methods make of them."""
    radius = 10.0
    figure = new_figure(2.0)
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
        style_axes(axes, x="y", y="x")
    legend_above(figure, axes, 4)
    save(figure, "centroid_and_wrench_axis.png")


def contact_centroid() -> None:
    """Where a wrench says that a fingertip is touched: without spin on the wrench's axis, with spin beside it."""
    figure = new_figure(3.3)
    side, top = figure.subplots(1, 2)
    tip = Ellipsoid((0.008, 0.008, 0.012))
    touched = np.array([0.0045, 0.0, 0.012 * math.sqrt(1 - (4.5 / 8) ** 2)])
    normal = touched / np.array([0.008, 0.008, 0.012]) ** 2
    normal /= np.linalg.norm(normal)
    force = -1.9 * normal + 0.9 * np.array([normal[2], 0.0, -normal[0]])
    contact = contact_from_wrench(tip, np.concatenate([force, np.cross(touched, force)]))
    x, _, z = 1e3 * contact.centroid
    angle = np.linspace(0.0, 2.0 * math.pi, 200)
    side.fill(8 * np.cos(angle), 12 * np.sin(angle), color="#dfe6ee", zorder=0)
    along = 1e3 * np.outer(np.linspace(-0.006, 0.009, 2), contact.force / np.linalg.norm(contact.force))
    side.plot(x - along[:, 0], z - along[:, 2], "--", color=QUIET, linewidth=1, label="wrench axis")
    side.text(x - 2.0, z - 5.2, "wrench axis", color=QUIET, fontsize=9, ha="right")
    arrow = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.008, "zorder": 3}
    side.quiver(0, 0, *(3 * contact.force[[0, 2]]), color=MEASURED, **arrow)
    side.text(9.0, -5.6, "force f, felt with a moment m\nabout the sensor's origin +", color=MEASURED, fontsize=9)
    side.quiver(x, z, *(5 * contact.normal[[0, 2]]), color=WANTED, **arrow)
    side.text(x + 4.4, z + 1.8, "normal n,\ninto the object", color=WANTED, fontsize=9)
    side.plot(x, z, "o", color=MEASURED, markersize=9, zorder=4)
    side.text(x + 4.0, z - 3.4, "contact centroid c", color=MEASURED, fontsize=9)
    side.text(-3.6, -10.2, "fingertip", color=INK, fontsize=9)
    side.plot(0, 0, "+", color=INK, markersize=9)
    side.set_aspect("equal")
    side.set_xlim(-13, 33)
    side.set_ylim(-13, 16)
    style_axes(side, x="x in the sensor frame [mm]", y="z [mm]")
    side.set_title("From the side: no spin torque", fontsize=9)

    pressing = (0.8, 0.0, -2.0)
    for torque in (0.0, 1e-3, 2e-3, 3e-3):
        wrench = np.array([*pressing, 0.0, 0.0, 0.0])
        apex = np.array([0.0, 0.0, 0.012])
        wrench[3:] = np.cross(apex, pressing) + np.array([0.0, 0.0, torque])
        soft, hard = contact_from_wrench(tip, wrench), contact_from_wrench(tip, wrench, model="hard")
        top.plot(*(1e3 * hard.centroid[:2]), "X", color=TRUE, markersize=9, label="wrench axis method")
        top.plot(*(1e3 * soft.centroid[:2]), "o", color=MEASURED, markersize=9, label="contact centroid")
        top.annotate(
            f"{1e3 * torque:.0f} mN m",
            1e3 * hard.centroid[:2],
            xytext=(-10, -4),
            ha="right",
            textcoords="offset points",
            fontsize=9,
        )
    top.quiver(0, 0, 0.8, 0.0, color=QUIET, **arrow)
    top.text(0.25, 0.06, "tangential force, 0.8 N", color=QUIET, fontsize=9, ha="left")
    top.set_xlim(-0.6, 1.2)
    top.set_ylim(-0.75, 0.3)
    top.set_aspect("equal")
    style_axes(top, x="x [mm]", y="y [mm]")
    top.set_title("From above, pressed at the apex with 2 N: more and more spin torque", fontsize=9)
    legend_above(figure, top, 2)
    save(figure, "contact_centroid.png")


def limit_surface() -> None:
    """What a contact bears of force and torque at once, and how that shrinks and grows with the load."""
    figure = new_figure(2.9)
    shape, load = figure.subplots(1, 2)
    angle = np.linspace(0.0, math.pi / 2, 200)
    for exponent, colour, name in (
        (2.0, QUIET, "ellipse, p = 2"),
        (1.7, MEASURED, "p = 1.7"),
        (1.0, TRUE, "diamond, p = 1"),
    ):
        surface = LimitSurface(friction=1.0, spin_length=1.0, norm_exponent=exponent)
        reach = np.array([1 / surface.load_ratio(1.0, math.cos(a), math.sin(a)) for a in angle])
        shape.plot(reach * np.cos(angle), reach * np.sin(angle), color=colour, label=name)
    shape.plot(*limit_curve(2.0).T, ":", color=INK, linewidth=1.8, label="integrated, Hertz's pressure")
    shape.set_aspect("equal")
    style_axes(shape, x="tangential force / (mu normal force)", y="torque / (mu e normal force)")
    shape.legend(fontsize=8, frameon=False, loc="lower left")
    shape.set_title("At one load", fontsize=9)
    grown = LimitSurface(friction=0.8, spin_length=0.003, load_exponent=1 / 3, norm_exponent=1.7)
    for normal_force, colour in ((1.0, "#9ecae1"), (2.0, "#4292c6"), (4.0, "#08519c")):
        reach = [1 / grown.load_ratio(normal_force, math.cos(a), 0.004 * math.sin(a)) for a in angle]
        load.plot(
            reach * np.cos(angle),
            4 * np.array(reach) * np.sin(angle),
            color=colour,
            label=f"pressed with {normal_force:.0f} N",
        )
    load.set_xlim(0, None)
    load.set_ylim(0, None)
    style_axes(load, x="tangential force [N]", y="torque about the normal [mN m]")
    load.legend(fontsize=8, frameon=False)
    load.set_title("mu = 0.8, e = 3 mm at 1 N, growing with the load to the power 1/3", fontsize=9)
    save(figure, "limit_surface.png")


def hybrid_control() -> None:
    """Which directions of a contact are under force control, and which under motion control."""
    figure = new_figure(3.2)
    axes = figure.subplots()
    ring, ground = 4.2, 14.0
    angle = np.linspace(0.0, 2.0 * math.pi, 200)
    x = np.linspace(-16, 16, 200)
    axes.fill_between(x, -7, np.sqrt(ground**2 - (0.62 * x) ** 2) - ground, color="#e9e2d3", zorder=0)
    at = np.array([5.0, math.sqrt(ground**2 - (0.62 * 5.0) ** 2) - ground])
    slope = -(0.62**2) * at[0] / math.sqrt(ground**2 - (0.62 * at[0]) ** 2)
    tangent = np.array([1.0, slope]) / math.hypot(1.0, slope)
    normal = np.array([tangent[1], -tangent[0]])  # out of the fingertip, into the object
    middle = at - ring * normal
    axes.fill(middle[0] + ring * np.cos(angle), middle[1] + ring * np.sin(angle), color="#dfe6ee", zorder=1)
    axes.text(middle[0] - 1.6, middle[1] + 1.4, "fingertip", color=INK, fontsize=9)
    axes.text(-15.0, -6.2, "object, which nobody modelled", color=INK, fontsize=9)
    arrow = {"angles": "xy", "scale_units": "xy", "scale": 1, "width": 0.0045, "zorder": 3}
    axes.quiver(*at, *(4.5 * normal), color=TRUE, **arrow)
    axes.quiver(*at, *(7.0 * tangent), color=WANTED, **arrow)
    axes.quiver(*at, *(-7.0 * tangent), color=WANTED, **arrow)
    axes.plot(*at, "o", color=MEASURED, markersize=9, zorder=4)
    axes.annotate(
        "contact centroid, normal and force,\nfelt a thousand times a second",
        at,
        xytext=(-15.5, 5.6),
        color=MEASURED,
        fontsize=9,
        arrowprops={"arrowstyle": "-", "color": MEASURED, "linewidth": 0.8},
    )
    axes.text(
        *(at + 3.2 * normal + [-1.0, 0.0]),
        "along the normal: force control\nv = k (force set - force felt)",
        color=TRUE,
        fontsize=9,
        ha="right",
        va="center",
    )
    axes.text(
        *(at + 7.3 * tangent + [0.2, 0.6]),
        "along the surface: motion control\nspeed and way as the strategy asks",
        color="#00714f",
        fontsize=9,
        va="center",
    )
    axes.set_xlim(-16, 24)
    axes.set_ylim(-7, 8.5)
    axes.set_aspect("equal")
    axes.set_axis_off()
    save(figure, "hybrid_control.png")


def trust() -> None:
    """How often results are honest, reported as broken, or silently wrong, as `benchmarks/trust` last measured."""
    with (HERE.parent / "benchmarks" / "trust" / "measured.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    figure = new_figure(0.8 + 0.085 * len(rows))
    half = (len(rows) + 1) // 2
    for axes, part in zip(figure.subplots(1, 2), (rows[:half], rows[half:]), strict=True):
        left = np.zeros(len(part))
        for heading, colour in (("honest", MEASURED), ("reported", GRID), ("silently wrong", LIMIT)):
            share = np.array([float(row[heading].rstrip(" %")) for row in part])
            axes.barh(np.arange(len(part)), share, left=left, height=0.75, color=colour, label=heading)
            left += share
        names = [f"{row['estimator']}: {row['data']}" for row in part]
        axes.set_yticks(np.arange(len(part)), names, fontsize=5.5)
        for label, row in zip(axes.get_yticklabels(), part, strict=True):
            label.set_color(MEASURED if row["assumptions"] == "hold" else INK)
        axes.set(xlim=(0.0, 100.0), ylim=(half - 0.4, -0.6), xlabel="results, %")
        axes.tick_params(axis="y", length=0)
    legend_above(figure, figure.axes[0], 3)
    save(figure, "trust.png")


if __name__ == "__main__":
    trust()
    hybrid_control()
    contact_centroid()
    limit_surface()
    centroid_and_wrench_axis()
    exploration()
