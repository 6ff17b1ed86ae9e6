"""Pictures of a friction measurement: mu along strokes, the limit surface, e over load, mu over speed."""

import math
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.ticker import FuncFormatter, NullFormatter

from palpate.errors import FloatArray
from palpate.experiments.friction.measured import Interval
from palpate.experiments.friction.slip_points import SurfacePoints
from palpate.experiments.friction.stroke_curves import StrokeCurve
from palpate.reporting.envelope import envelope
from palpate.reporting.interval_words import interval_words
from palpate.reporting.style import (
    DASHED,
    INK,
    INSIDE,
    LOAD_COLOURS,
    MEASURED,
    MILLI,
    QUIET,
    TRUE,
    WANTED,
    Picture,
    Width,
    legend_above,
    new_figure,
    style_axes,
)

ASSUMED = (
    " p was assumed: these loads do not determine it, and the line may be any in the band; see --fit-exponents."
)
"""Of a limit surface whose p was not measured."""

CREEPING = " What creeps, as grease does, is proportional to the speed, and is left out of mu."
"""Of speeds at which it did."""

BENT = (
    " Here the normal turns along the stroke: by the normal in its middle, as it is drawn, the ratio changes all "
    "along. mu, from the angle between the forces there and back, allows for that."
)
"""Of strokes on what is not flat."""

AXIS_LIMIT = 1.25
"""Side of the picture of a limit surface, over its half axes."""


def stroke_picture(
    strokes: Sequence[StrokeCurve], friction: Sequence[Interval], *, bent: bool = False
) -> Picture | None:
    """Return the picture of mu along strokes, or None without strokes.

    Args:
        strokes: There and back.
        friction: mu at each load.
        bent: Whether the normal turns along the stroke.
    """
    if not strokes:
        return None
    figure = new_figure(Width.HALF, 3.6)
    axes = figure.subplots()
    loads = sorted({stroke.load for stroke in strokes})
    colours = {load: LOAD_COLOURS[i % len(LOAD_COLOURS)] for i, load in enumerate(loads)}
    for stroke in strokes:
        name = f"{stroke.load:g} N" if not stroke.back else None
        axes.plot(
            *envelope(MILLI * stroke.travel, stroke.ratio),
            color=colours[stroke.load],
            linewidth=0.9,
            linestyle="--" if stroke.back else "-",
            alpha=0.85,
            label=name,
        )
    slipped = [each for each in friction if not each.bound]
    if slipped:
        low, high = min(each.lower for each in slipped), max(each.upper for each in slipped)
        which = "95 %" if len(slipped) == 1 else "95 %, load by load"
        # narrower than a line, often: with an edge, and in front
        axes.axhspan(
            low,
            high,
            facecolor=(*to_rgb(WANTED), 0.3),
            edgecolor=WANTED,
            linewidth=0.8,
            zorder=3,
            label=f"{which}: {interval_words(0.5 * (low + high), low, high).partition(': ')[2]}",
        )
    true = friction[0].true if friction else None
    if true is not None:
        axes.axhline(true, color=TRUE, linewidth=1.2, linestyle=DASHED, label="true")
    axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))
    axes.margins(x=0.0)
    style_axes(axes, x="travel [mm]", y="tangential / normal force")
    legend_above(figure, [axes], columns=4)
    return Picture(
        title="Friction along the strokes",
        caption=(
            "There (solid) and back (dashed) at each load. Elastic deflection rises all along; slip stays level, "
            "and only that part counts" + _counted(friction) + (BENT if bent else "") + _band(slipped)
        ),
        full=figure,
    )


def _band(slipped: Sequence[Interval]) -> str:
    if len(slipped) < 2:
        return ""
    return " The band takes in the 95 % intervals of mu at each load; that of all loads together stands above."


def _counted(friction: Sequence[Interval]) -> str:
    bounds = [f"{each.at:.3g}" for each in friction if each.bound]
    if not bounds:
        return "."
    loads = ", ".join(bounds)
    return (
        f", if it does so in both directions and for long enough: not at {loads} N. There mu is a lower bound, "
        "and the normal, which the ratio is computed with, is known to a few degrees only."
    )


def surface_picture(found: SurfacePoints) -> Picture:
    """Return the picture of the limit surface with the loads that were measured on it."""
    figure = new_figure(Width.HALF, 4.4)
    axes = figure.subplots()
    p = found.surface.norm_exponent
    x, y = _curve(p)
    axes.fill(np.append(x, 0.0), np.append(y, 0.0), color=INSIDE, zorder=1)
    exponent = f"p = {p:.3g}, " + ("measured" if found.exponent_measured else "assumed")
    if not found.exponent_measured:
        _draw_between(axes, *found.exponents)
    axes.plot(x, y, color=INK, linewidth=1.3, zorder=2, label=exponent)
    if found.true is not None:
        q = found.true.norm_exponent
        axes.plot(*_curve(q), color=TRUE, linewidth=1.3, linestyle=DASHED, zorder=2, label=f"true, p = {q:.3g}")
    loads = sorted(set(np.round(found.loads, 1).tolist()))
    for i, load in enumerate(loads):
        colour = LOAD_COLOURS[i % len(LOAD_COLOURS)]
        at = np.round(found.loads, 1) == load
        axes.errorbar(
            found.points[at, 0],
            found.points[at, 1],
            xerr=found.errors[at, 0],
            yerr=found.errors[at, 1],
            fmt="o",
            markersize=3.5,
            color=colour,
            elinewidth=0.9,
            zorder=3,
            label=f"at {load:g} N",
        )
    axes.set_aspect("equal")
    axes.set_xlim(-0.05, AXIS_LIMIT)
    axes.set_ylim(-0.05, AXIS_LIMIT)
    style_axes(axes, x="tangential force / $\\mu f_n$", y="spin torque / $\\mu e f_n$")
    legend_above(figure, [axes], columns=3)
    return Picture(
        title="Limit surface",
        caption=(
            "Loads in full slip over what the contact bears of tangential force and of torque alone, with 95 % "
            "intervals, where these are wider than the dot. Loads inside the line are borne; dots on it are good."
            + ("" if found.exponent_measured else ASSUMED)
        ),
        full=figure,
    )


def length_picture(lengths: Sequence[Interval], growth: tuple[float, float] | None) -> Picture | None:
    """Return the picture of e over the load, or None if it was measured nowhere."""
    if not lengths:
        return None
    figure = new_figure(Width.HALF, 3.4)
    axes = figure.subplots()
    loads = np.array([each.at for each in lengths])
    span = np.geomspace(0.8 * loads.min(), 1.25 * loads.max(), 60)
    caption = "e at each load with its 95 % interval; short ones that hold the true value are good."
    if growth is not None:
        c, gamma = growth
        axes.plot(span, MILLI * c * span**gamma, color=MEASURED, linewidth=1.2, label="c $f_n^\\gamma$")
        power = f"{gamma:.2f}"
        law = "at all loads" if float(power) == 0.0 else f"(f_n / 1 N)^{power}"
        caption = (
            "Short intervals that the line goes through are good. Here are e at each load with its 95 % interval, "
            f"and e = {MILLI * c:.3g} mm {law}."
        )
    _with_intervals(axes, lengths, MILLI)
    top = MILLI * max(each.upper if math.isfinite(each.upper) else each.value for each in lengths)
    axes.set_xscale("log")
    axes.set_ylim(0.0, 1.25 * top)
    _plain_ticks(axes, loads)
    style_axes(axes, x="normal force [N]", y="spin length e [mm]")
    legend_above(figure, [axes], columns=4)
    return Picture(title="Spin length over load", caption=caption, full=figure)


def speed_picture(
    speeds: Sequence[Interval], curve: FloatArray | None, *, creeping: bool = False
) -> Picture | None:
    """Return the picture of mu over the slip speed, or None for a single speed.

    Args:
        speeds: mu at each.
        curve: Through them.
        creeping: Whether some of them only crept.
    """
    if len(speeds) < 2:
        return None
    figure = new_figure(Width.HALF, 3.4)
    axes = figure.subplots()
    if curve is not None:
        axes.plot(MILLI * curve[0], curve[1], color=MEASURED, linewidth=1.2, label="fitted")
    _with_intervals(axes, speeds, 1.0, MILLI)
    values = [each.value for each in speeds] + [each.true for each in speeds if each.true is not None]
    axes.set_xscale("log")
    axes.set_ylim(0.0, 1.3 * max(values))
    _plain_ticks(axes, MILLI * np.array([each.at for each in speeds]))
    style_axes(axes, x="slip speed [mm/s]", y="friction $\\mu$")
    legend_above(figure, [axes], columns=4)
    return Picture(
        title="Friction over speed",
        caption=f"{_over_speed(speeds)} Short intervals on the true value are good.{CREEPING if creeping else ''}",
        full=figure,
    )


def _over_speed(speeds: Sequence[Interval]) -> str:
    slipped = [each for each in speeds if not each.bound]
    if len(slipped) < 2:
        return "mu at each speed, as far as it slipped."
    low, high = min(slipped, key=lambda each: each.value), max(slipped, key=lambda each: each.value)
    if high.lower <= low.upper:
        return "mu is the same at all speeds, within its intervals."
    return (
        f"mu goes from {low.value:.3g} at {MILLI * low.at:.3g} mm/s to {high.value:.3g} at "
        f"{MILLI * high.at:.3g} mm/s."
    )


def _with_intervals(axes: Axes, intervals: Sequence[Interval], unit: float, across: float = 1.0) -> None:
    true = [(across * each.at, unit * each.true) for each in intervals if each.true is not None]
    if true:
        axes.plot(*zip(*true, strict=True), "_", color=TRUE, markersize=15, markeredgewidth=2.2, label="true")
    slipped = [each for each in intervals if not each.bound]
    bounds = [each for each in intervals if each.bound]
    if slipped:
        value = np.array([each.value for each in slipped])
        ends = np.array([[each.lower, each.upper] for each in slipped]).T
        axes.errorbar(
            [across * each.at for each in slipped],
            unit * value,
            yerr=unit * np.abs(ends - value),
            fmt="o",
            markersize=4,
            color=INK,
            elinewidth=1.2,
            capsize=3,
            label="measured",
        )
    if bounds:
        axes.plot(
            [across * each.at for each in bounds],
            [unit * each.value for each in bounds],
            "^",
            color=QUIET,
            markersize=6,
            label="at least",
        )


def _curve(p: float) -> tuple[FloatArray, FloatArray]:
    """A quarter of |x|^p + |y|^p = 1."""
    angle = np.linspace(0.0, 0.5 * np.pi, 181)
    x: FloatArray = np.cos(angle) ** (2.0 / p)
    y: FloatArray = np.abs(np.sin(angle)) ** (2.0 / p)
    return x, y


def _draw_between(axes: Axes, low: float, high: float) -> None:
    """Draw all limit surfaces whose p lies between two."""
    (x, y), (u, v) = _curve(low), _curve(high)
    axes.fill(
        np.concatenate([x, u[::-1]]),
        np.concatenate([y, v[::-1]]),
        color=QUIET,
        alpha=0.25,
        linewidth=0.0,
        zorder=1.5,
        label=f"p from {low:g} to {high:g}",
    )


def _plain_ticks(axes: Axes, values: FloatArray) -> None:
    axes.set_xticks(np.unique(np.round(values, 6)).tolist())
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
