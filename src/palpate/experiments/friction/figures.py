"""Figures of a friction measurement: mu along strokes, the limit surface, e over load, mu over speed."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.friction.measured import Interval
from palpate.experiments.friction.slip_points import SurfacePoints
from palpate.experiments.friction.stroke_curves import StrokeCurve
from palpate.reporting.data import interval_words
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Dash, Line, Mark, Points, Polygon, Rule, Span, Symbol, look_of
from palpate.runtime.palette import FELT, INK_COLOUR, QUIET_COLOUR, SET, SIDE_BY_SIDE, TRUTH

MILLI = 1e3

LOAD_COLOURS = tuple(SIDE_BY_SIDE[i] for i in (0, 3, 4))
"""Of loads beside each other; what is true, and what was found of them all, have colours of their own."""

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
"""Side of the figure of a limit surface, over its half axes."""


def stroke_figure(
    strokes: Sequence[StrokeCurve], friction: Sequence[Interval], *, bent: bool = False
) -> Figure | None:
    """Return the figure of mu along strokes, or None without strokes.

    Args:
        strokes: There and back.
        friction: mu at each load.
        bent: Whether the normal turns along the stroke.
    """
    if not strokes:
        return None
    loads = sorted({stroke.load for stroke in strokes})
    marks: list[Mark] = []
    for stroke in strokes:
        name = "" if stroke.back else f"{stroke.load:g} N"
        dashes = (Dash.DASHED, Dash.DOTTED) if stroke.back else (Dash.SOLID, Dash.DASH_DOT)
        colour, dash, _, thicker = look_of(loads.index(stroke.load), LOAD_COLOURS, dashes)
        marks.append(Line(MILLI * stroke.travel, stroke.ratio, name, colour, 1.2 * thicker, dash))
    slipped = [each for each in friction if not each.bound]
    if slipped:
        low, high = min(each.lower for each in slipped), max(each.upper for each in slipped)
        which = "95 %" if len(slipped) == 1 else "95 %, load by load"
        words = interval_words(0.5 * (low + high), low, high).partition(": ")[2]
        marks.insert(0, Span(low, high, f"{which}: {words}", SET, upright=False, opacity=0.3))
        # narrower than a line, often: with edges
        marks += [Rule(end, "", SET, upright=False) for end in (low, high)]
    true = friction[0].true if friction else None
    if true is not None:
        marks.append(Rule(true, "true", TRUTH, 1.5, Dash.DASHED, upright=False))
    least = min(float(np.nanmin(stroke.ratio)) for stroke in strokes)
    return Figure(
        title="Friction along the strokes",
        caption=(
            "There (solid) and back (dashed) at each load. Elastic deflection rises all along; slip stays level, "
            "and only that part counts" + _counted(friction) + (BENT if bent else "") + _band(slipped)
        ),
        panels=(
            Panel(
                tuple(marks),
                Axis("travel", "mm"),
                Axis("tangential / normal force", low=0.0 if least >= 0.0 else None),
                height=380,
            ),
        ),
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


def surface_figure(found: SurfacePoints) -> Figure:
    """Return the figure of the limit surface with the loads that were measured on it."""
    p = found.surface.norm_exponent
    exponent = f"p = {p:.3g}, " + ("measured" if found.exponent_measured else "assumed")
    marks: list[Mark] = [] if found.exponent_measured else [_between(*found.exponents)]
    marks.append(Line(*_curve(p), exponent, INK_COLOUR))
    if found.true is not None:
        q = found.true.norm_exponent
        marks.append(Line(*_curve(q), f"true, p = {q:.3g}", TRUTH, dash=Dash.DASHED))
    rounded = np.round(found.loads, 1)
    for i, load in enumerate(sorted(set(rounded.tolist()))):
        at = rounded == load
        (x, y), (aside, upwards) = found.points[at].T, found.errors[at].T
        colour, _, symbol, thicker = look_of(i, LOAD_COLOURS)
        dots = Points(x, y, f"at {load:g} N", colour, 6.0 * thicker, symbol)
        marks.append(replace(dots, x_error=np.tile(aside, (2, 1)), y_error=np.tile(upwards, (2, 1))))
    return Figure(
        title="Limit surface",
        caption=(
            "Loads in full slip over what the contact bears of tangential force and of torque alone, with 95 % "
            "intervals, where these are wider than the dot. Loads inside the line are borne; dots on it are good."
            + ("" if found.exponent_measured else ASSUMED)
        ),
        panels=(
            Panel(
                tuple(marks),
                Axis("tangential force / (mu f_n)", low=-0.05, high=AXIS_LIMIT),
                Axis("spin torque / (mu e f_n)", low=-0.05, high=AXIS_LIMIT),
                equal=True,
                height=400,
            ),
        ),
    )


def length_figure(lengths: Sequence[Interval], growth: tuple[float, float] | None) -> Figure | None:
    """Return the figure of e over the load, or None if it was measured nowhere."""
    if not lengths:
        return None
    loads = np.array([each.at for each in lengths])
    span = np.geomspace(0.8 * loads.min(), 1.25 * loads.max(), 60)
    caption = "e at each load with its 95 % interval; short ones that hold the true value are good."
    marks: list[Mark] = []
    if growth is not None:
        c, gamma = growth
        marks.append(Line(span, MILLI * c * span**gamma, "fitted, c f_n^gamma", FELT))
        power = f"{gamma:.2f}"
        law = "at all loads" if float(power) == 0.0 else f"(f_n / 1 N)^{power}"
        caption = (
            "Short intervals that the line goes through are good. Here are e at each load with its 95 % interval, "
            f"and e = {MILLI * c:.3g} mm {law}."
        )
    marks += _with_intervals(lengths, MILLI)
    top = MILLI * max(each.upper if math.isfinite(each.upper) else each.value for each in lengths)
    return Figure(
        title="Spin length over load",
        caption=caption,
        panels=(
            Panel(
                tuple(marks),
                Axis("normal force", "N", logarithmic=True, ticks=_plain_ticks(loads)),
                Axis("spin length e", "mm", 0.0, 1.25 * top),
            ),
        ),
    )


def speed_figure(speeds: Sequence[Interval], curve: FloatArray | None, *, creeping: bool = False) -> Figure | None:
    """Return the figure of mu over the slip speed, or None for a single speed.

    Args:
        speeds: mu at each.
        curve: Through them.
        creeping: Whether some of them only crept.
    """
    if len(speeds) < 2:
        return None
    marks = [] if curve is None else [Line(MILLI * curve[0], curve[1], "fitted", FELT)]
    values = [each.value for each in speeds] + [each.true for each in speeds if each.true is not None]
    at = MILLI * np.array([each.at for each in speeds])
    return Figure(
        title="Friction over speed",
        caption=f"{_over_speed(speeds)} Short intervals on the true value are good.{CREEPING if creeping else ''}",
        panels=(
            Panel(
                (*marks, *_with_intervals(speeds, 1.0, MILLI)),
                Axis("slip speed", "mm/s", logarithmic=True, ticks=_plain_ticks(at)),
                Axis("friction mu", low=0.0, high=1.3 * max(values)),
            ),
        ),
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


def _with_intervals(intervals: Sequence[Interval], unit: float, across: float = 1.0) -> list[Mark]:
    known = [each for each in intervals if each.true is not None]
    slipped = [each for each in intervals if not each.bound]
    bounds = [each for each in intervals if each.bound]
    ends = unit * np.array([[each.value - each.lower, each.upper - each.value] for each in slipped]).T

    def places(chosen: Sequence[Interval]) -> FloatArray:
        return across * np.array([each.at for each in chosen])

    def values(chosen: Sequence[Interval]) -> FloatArray:
        return unit * np.array([each.value for each in chosen])

    true = unit * np.array([each.true for each in known], dtype=np.float64)
    marks = (
        Points(places(known), true, "true", TRUTH, 18.0, Symbol.STROKE),
        Points(places(slipped), values(slipped), "measured", INK_COLOUR, 6.0, y_error=ends),
        Points(places(bounds), values(bounds), "at least", QUIET_COLOUR, 9.0, Symbol.TRIANGLE),
    )
    return [mark for mark in marks if len(mark.x)]


def _curve(p: float) -> tuple[FloatArray, FloatArray]:
    """A quarter of |x|^p + |y|^p = 1."""
    angle = np.linspace(0.0, 0.5 * np.pi, 181)
    x: FloatArray = np.cos(angle) ** (2.0 / p)
    y: FloatArray = np.abs(np.sin(angle)) ** (2.0 / p)
    return x, y


def _between(low: float, high: float) -> Polygon:
    """All limit surfaces whose p lies between two."""
    (x, y), (u, v) = _curve(low), _curve(high)
    name = f"p from {low:g} to {high:g}"
    return Polygon(np.concatenate([x, u[::-1]]), np.concatenate([y, v[::-1]]), name, QUIET_COLOUR, 0.25)


def _plain_ticks(values: FloatArray) -> tuple[tuple[float, str], ...]:
    return tuple((each, f"{each:.3g}") for each in np.unique(np.round(values, 6)).tolist())
