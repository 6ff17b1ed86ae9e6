"""The path of a contact's load inside its limit surface, and where it slips."""

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction import LimitSurface
from palpate.reporting.style import (
    INK,
    INSIDE,
    QUIET,
    TIME_COLOURS,
    TRUE,
    Picture,
    Width,
    colour_bar,
    legend_above,
    new_figure,
    style_axes,
)

MAX_LOAD_RATIO = 1.3
"""Loads beyond this ratio are drawn there: while landing and lifting they are noise over noise."""

MOST_POINTS = 2000
"""Points of the path, evenly in time: more than a page can resolve."""

BoolArray = npt.NDArray[np.bool_]


def limit_surface_picture(
    surface: LimitSurface, time: FloatArray, loads: FloatArray, slipping: BoolArray | None = None
) -> Picture:
    """Return the picture of a load's path inside a limit surface.

    Args:
        surface: As measured, or as assumed.
        time: Shape (n,) [s].
        loads: Normal force [N], tangential force (its length, or along one direction with its sign) [N], spin
            torque [N m], shape (n, 3). Instants that do not push are left out.
        slipping: Which instants slipped, shape (n,); None where that is unknown.

    Raises:
        InvalidValueError: Shapes that do not go together.
    """
    if loads.shape != (len(time), 3) or (slipping is not None and slipping.shape != time.shape):
        shape = None if slipping is None else slipping.shape
        raise InvalidValueError(
            f"loads has shape {loads.shape} and slipping {shape}: must be ({len(time)}, 3) and "
            f"({len(time)},), as time has"
        )
    ratios = load_ratios(surface, loads)
    slipped = np.zeros(len(time), dtype=np.bool_) if slipping is None else slipping
    return Picture(
        title="Load inside the limit surface",
        caption=(
            "Tangential force and spin torque over what the contact bears of each alone, coloured by time; on the "
            "line it slips. Well inside is good. Instants that do not push are left out, loads far "
            "outside are drawn at the rim."
        ),
        full=_draw(surface.norm_exponent, time, ratios, slipped),
    )


def load_ratios(surface: LimitSurface, loads: FloatArray) -> FloatArray:
    """Return f_t / (mu f_n) and tau / (mu e f_n), shape (n, 2); NaN where nothing pushes.

    Args:
        surface: That bears the loads.
        loads: f_n [N], f_t [N], tau [N m], shape (n, 3).
    """
    normal = np.where(loads[:, 0] > 0.0, loads[:, 0], np.nan)
    most = surface.friction * normal
    e = surface.spin_length * normal**surface.load_exponent
    return np.column_stack([loads[:, 1] / most, loads[:, 2] / (most * e)])


def _draw(p: float, time: FloatArray, ratios: FloatArray, slipped: BoolArray) -> Figure:
    figure = new_figure(Width.HALF, 4.6)
    axes = figure.subplots()
    signed = bool((ratios[:, 0] < 0.0).any())
    _draw_surface(axes, p, signed)
    size = np.sum(np.abs(ratios) ** p, axis=1) ** (1.0 / p)
    shown = ratios * np.minimum(1.0, MAX_LOAD_RATIO / np.where(size > 0.0, size, 1.0))[:, None]
    kept = np.unique(np.linspace(0, len(time) - 1, min(len(time), MOST_POINTS)).round().astype(int))
    path, at = shown[kept], time[kept]
    pieces = np.stack([path[:-1], path[1:]], axis=1)
    whole = np.isfinite(pieces).all(axis=(1, 2))
    line = LineCollection(list(pieces[whole]), cmap=TIME_COLOURS, linewidths=1.4, capstyle="round", zorder=3)
    line.set_array(0.5 * (at[:-1] + at[1:])[whole])
    axes.add_collection(line)
    slipped = slipped & np.isfinite(size)
    begins = np.flatnonzero(slipped & ~np.concatenate([[False], slipped[:-1]]))
    axes.plot(*shown[slipped].T, ".", color=TRUE, markersize=3, zorder=4)
    axes.plot(*shown[begins].T, "o", color=TRUE, markersize=7, fillstyle="none", markeredgewidth=1.4, zorder=5)
    if whole.any():
        colour_bar(figure, line, axes, "time [s]", shrink=0.7, pad=0.02)
    axes.plot([], [], color=INK, label="limit surface")
    if slipped.any():
        axes.add_line(Line2D([], [], color=TRUE, marker=".", linestyle="none", label="slips"))
        axes.add_line(
            Line2D([], [], color=TRUE, marker="o", fillstyle="none", linestyle="none", label="begins to slip")
        )
    axes.set_aspect("equal")
    rim = 1.1 * max(1.0, float(np.abs(shown[np.isfinite(size)]).max(initial=0.0)))
    axes.set_xlim(-rim if signed else -0.05, rim)
    axes.set_ylim(-rim, rim)
    style_axes(axes, x="tangential force / $\\mu f_n$", y="spin torque / $\\mu e f_n$")
    legend_above(figure, [axes], columns=3)
    return figure


def _draw_surface(axes: Axes, p: float, signed: bool) -> None:
    """Draw |x|^p + |y|^p = 1, its right half only where x is a length."""
    angle = np.linspace(-np.pi, np.pi, 721) if signed else np.linspace(-0.5 * np.pi, 0.5 * np.pi, 361)
    x, y = np.cos(angle), np.sin(angle)
    x, y = np.sign(x) * np.abs(x) ** (2.0 / p), np.sign(y) * np.abs(y) ** (2.0 / p)
    axes.fill(x, y, color=INSIDE, zorder=1)
    axes.plot(x, y, color=INK, linewidth=1.2, zorder=2)
    axes.axhline(0.0, color=QUIET, linewidth=0.6, zorder=2)
    axes.axvline(0.0, color=QUIET, linewidth=0.6, zorder=2)
