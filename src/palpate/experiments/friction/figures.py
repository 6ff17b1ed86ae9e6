"""Figures of a friction measurement: mu along strokes, the limit surface, e over load, mu over speed."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.friction.estimate import spun
from palpate.experiments.friction.result import FrictionResult, bound_reason
from palpate.friction import LimitSurface
from palpate.friction.friction_file import FrictionEstimate, How
from palpate.friction.rubbing.stroke import RubbingStroke
from palpate.reporting.data import interval_words
from palpate.reporting.figure import Axis, Figure, Panel
from palpate.reporting.marks import Dash, Line, Mark, Points, Polygon, Rule, Span, Symbol, look_of
from palpate.reporting.report import FigureSource
from palpate.runtime.palette import FELT, INK_COLOUR, QUIET_COLOUR, SET, SIDE_BY_SIDE, TRUTH

_MILLI = 1e3

_LOAD_COLOURS = tuple(SIDE_BY_SIDE[i] for i in (0, 3, 4))
"""Colours of single loads; true values and estimates of all loads have colours of their own."""

_ASSUMED_EXPONENT = (
    " p was assumed: these loads do not determine it, and the line may be any in the band; see --fit-exponents."
)
"""Caption of a limit surface whose p was not measured."""

_CREEPING = " Creep, as of grease, is proportional to the speed, and is left out of mu."
"""Caption of speeds at which the surface crept."""

_BENT = (
    " Here the normal turns along the stroke. The figure uses the normal in its middle, so that the ratio changes "
    "all along. mu, from the angle between the forces there and back, allows for that."
)
"""Caption of strokes on a bent surface."""

_AXIS_LIMIT = 1.25
"""Side of the figure of a limit surface, relative to its half axes."""

_CURVE_POINTS = 80
"""Number of points of the fitted curve of mu over speed."""

_SMOOTHING_TIME = 0.01
"""Window of the moving average of mu along a stroke [s]; without it, noise of 10 mN at 1 N is a cloud."""


@dataclass(frozen=True, slots=True)
class Interval:
    """An estimate with its 95 % interval, or a lower bound, at one load or speed.

    Attributes:
        at: Load [N] or speed [m/s].
        value: Estimate, or the bound.
        lower: Lower end of the interval.
        upper: Upper end of the interval; infinite for a bound.
        true: Simulated value; None on a robot.
        bound: Whether the value is a lower bound.
        reason: Reason why it is only a bound.
    """

    at: float
    value: float
    lower: float
    upper: float
    true: float | None = None
    bound: bool = False
    reason: str = ""

    @classmethod
    def of(cls, at: float, found: FrictionEstimate, true: float | None, reason: str = "") -> "Interval":
        """Return the interval of an estimate."""
        return cls(at, found.value, found.lower, found.upper, true, found.how is How.BOUND, reason)


@dataclass(frozen=True, slots=True, eq=False)
class SurfacePoints:
    """Loads in full slip, relative to the limit of pure tangential force and of pure torque.

    Attributes:
        surface: Estimated limit surface.
        true: Simulated limit surface; None on a robot.
        exponent_measured: Whether p of `surface` was measured, not assumed.
        points: f_t / (mu f_n) and tau / (mu e f_n), shape (n, 2).
        errors: Half of the 95 % interval of each, shape (n, 2).
        loads: Requested normal force of each, shape (n,) [N].
        exponents: Lower and upper end of the interval of p.
    """

    surface: LimitSurface
    true: LimitSurface | None
    exponent_measured: bool
    points: FloatArray
    errors: FloatArray
    loads: FloatArray
    exponents: tuple[float, float]


@dataclass(frozen=True, slots=True, eq=False)
class StrokeCurve:
    """Tangential over normal force along one direction of a stroke.

    Attributes:
        load: Normal force [N].
        back: Whether it is the return.
        travel: Distance since the start of the motion, shape (n,) [m].
        ratio: Force against the motion over normal force, shape (n,).
    """

    load: float
    back: bool
    travel: FloatArray
    ratio: FloatArray


def frictions(result: FrictionResult) -> tuple[Interval, ...]:
    """Return mu at each load [N], at the main speed."""
    if result.file is None:
        return ()
    true = result.plan.true_friction(result.file.speed)
    return tuple(
        Interval.of(at.normal_force, at.friction, true, bound_reason(each.friction))
        for at, each in zip(result.file.loads, result.found.loads, strict=True)
    )


def lengths(result: FrictionResult) -> tuple[Interval, ...]:
    """Return e [m] at each load [N] at which the tip slipped about the normal."""
    return tuple(
        Interval.of(at.normal_force, at.spin_length, result.plan.true_spin_length(at.normal_force))
        for at in (() if result.file is None else result.file.loads)
        if at.spin_length is not None
    )


def speeds(result: FrictionResult) -> tuple[Interval, ...]:
    """Return mu at each speed [m/s], at one load."""
    if result.file is None:
        return ()
    return tuple(
        Interval.of(each.speed, each.friction, result.plan.true_friction(each.speed), bound_reason(at.friction))
        for each, at in zip(result.file.speeds, result.found.speeds, strict=True)
    )


def friction_figures(result: FrictionResult) -> Iterator[FigureSource]:
    """Yield the figures of the estimates."""
    points, file, curve, found = _slip_points(result), result.file, result.found.curve, result.found
    creeping = file is not None and any(each.creeping for each in file.speeds)
    bent = result.plan.config.object == "sphere"
    yield lambda: stroke_figure(stroke_curves(result), frictions(result), bent=bent)
    if points is not None:
        yield partial(surface_figure, points)
    growth = None
    if file is not None and file.spin_length is not None and len(spun(found.loads)) > 1:
        growth = file.spin_length.value, file.load_exponent.value
    yield lambda: length_figure(lengths(result), growth)
    fitted = None
    if curve is not None:
        v = np.geomspace(0.8 * found.speeds[0].speed, 1.25 * found.speeds[-1].speed, _CURVE_POINTS)
        fitted = np.stack([v, [curve.friction_at(speed) for speed in v.tolist()]])
    yield lambda: speed_figure(speeds(result), fitted, creeping=creeping)


def stroke_curves(result: FrictionResult) -> tuple[StrokeCurve, ...]:
    """Return the last, longest stroke of each load at the main speed, there and back."""
    last = {
        pair.rub.normal_force: pair
        for pair in result.pairs
        if pair.rub.spin == pair.rub.heading == 0.0 and pair.rub.speed == result.plan.wanted.speed
    }
    normals = {at.load: at.friction.normal for at in result.found.loads}
    return tuple(
        _stroke_curve(load, back, stroke, normals[load])
        for load, pair in last.items()
        if load in normals
        for back, stroke in ((False, pair.pair.there), (True, pair.pair.back))
    )


def _stroke_curve(load: float, back: bool, stroke: RubbingStroke, normal: FloatArray) -> StrokeCurve:
    velocity = stroke.contact_velocity
    along = velocity - np.outer(velocity @ normal, normal)
    direction = along.sum(axis=0) / np.linalg.norm(along.sum(axis=0))
    travel = np.concatenate([[0.0], np.cumsum((along @ direction)[:-1] * np.diff(stroke.time))])
    ratio = (stroke.force @ direction) / (stroke.force @ normal)
    width = max(1, round(_SMOOTHING_TIME / float(np.median(np.diff(stroke.time)))))
    ratio = np.convolve(ratio, np.full(width, 1.0 / width), "same")
    # at both ends the window of the moving average is incomplete
    kept = slice(width, len(ratio) - width)
    return StrokeCurve(load, back, travel[kept], ratio[kept])


def _slip_points(result: FrictionResult) -> SurfacePoints | None:
    """Return the loads in full slip; None if nothing slipped both along the surface and about its normal."""
    found, file = result.found, result.file
    if (
        file is None
        or file.spin_length is None
        or not (file.friction.measured and found.slips and spun(found.loads))
    ):
        return None
    surface, length = file.limit_surface(), file.spin_length
    limits = [surface.friction * slip.normal_force for slip in found.slips]
    points = np.array(
        [
            (
                slip.tangential_force / limit,
                slip.spin_torque
                / (surface.friction * surface.spin_length_at(slip.normal_force) * slip.normal_force),
            )
            for slip, limit in zip(found.slips, limits, strict=True)
        ]
    )
    scatter = 0.0 if found.fitted is None else found.fitted.scatter
    half = 0.5 * (file.friction.upper - file.friction.lower) / file.friction.value
    torque = 0.5 * (length.upper - length.lower) / length.value
    relative = np.array([np.hypot(half, 2.0 * scatter), np.hypot(torque, 2.0 * scatter)])
    loads = [at.load for at in found.loads]
    return SurfacePoints(
        surface,
        result.plan.true_limit_surface,
        found.fitted is not None,
        points,
        np.abs(points) * relative,
        np.array([min(loads, key=lambda load: abs(load - slip.normal_force)) for slip in found.slips]),
        (file.norm_exponent.lower, file.norm_exponent.upper),
    )


def stroke_figure(
    strokes: Sequence[StrokeCurve], friction: Sequence[Interval], *, bent: bool = False
) -> Figure | None:
    """Return the figure of mu along strokes, or None without strokes.

    Args:
        strokes: Strokes there and back.
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
        colour, dash, _, thicker = look_of(loads.index(stroke.load), _LOAD_COLOURS, dashes)
        marks.append(Line(_MILLI * stroke.travel, stroke.ratio, name, colour, 1.2 * thicker, dash))
    slipped = [each for each in friction if not each.bound]
    if slipped:
        low, high = min(each.lower for each in slipped), max(each.upper for each in slipped)
        which = "95 %" if len(slipped) == 1 else "95 %, load by load"
        words = interval_words(0.5 * (low + high), low, high).partition(": ")[2]
        marks.insert(0, Span(low, high, f"{which}: {words}", SET, upright=False, opacity=0.3))
        # often narrower than a line: with edges
        marks += [Rule(end, "", SET, upright=False) for end in (low, high)]
    true = friction[0].true if friction else None
    if true is not None:
        marks.append(Rule(true, "true", TRUTH, 1.5, Dash.DASHED, upright=False))
    least = min(float(np.nanmin(stroke.ratio)) for stroke in strokes)
    return Figure(
        title="Friction along the strokes",
        caption=(
            "There (solid) and back (dashed) at each load. Elastic deflection rises all along; slip stays level, "
            "and only that part counts" + _counted(friction) + (_BENT if bent else "") + _band(slipped)
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
    return " The band covers the 95 % intervals of mu at each load; that of all loads together stands above."


def _counted(friction: Sequence[Interval]) -> str:
    bounds = [f"{each.at:.3g}" for each in friction if each.bound]
    if not bounds:
        return "."
    loads = ", ".join(bounds)
    return (
        f", if it does so in both directions and for long enough: not at {loads} N. There mu is a lower bound, "
        "and the normal of the ratio is known to a few degrees only."
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
        colour, _, symbol, thicker = look_of(i, _LOAD_COLOURS)
        dots = Points(x, y, f"at {load:g} N", colour, 6.0 * thicker, symbol)
        marks.append(replace(dots, x_error=np.tile(aside, (2, 1)), y_error=np.tile(upwards, (2, 1))))
    return Figure(
        title="Limit surface",
        caption=(
            "Loads in full slip, relative to the limit of tangential force alone and of torque alone, with 95 % "
            "intervals if they are wider than the dot. The contact carries loads inside the line; dots on it "
            "are good." + ("" if found.exponent_measured else _ASSUMED_EXPONENT)
        ),
        panels=(
            Panel(
                tuple(marks),
                Axis("tangential force / (mu f_n)", low=-0.05, high=_AXIS_LIMIT),
                Axis("spin torque / (mu e f_n)", low=-0.05, high=_AXIS_LIMIT),
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
        marks.append(Line(span, _MILLI * c * span**gamma, "fitted, c f_n^gamma", FELT))
        power = f"{gamma:.2f}"
        law = "at all loads" if float(power) == 0.0 else f"(f_n / 1 N)^{power}"
        caption = (
            "Points: e at each load with its 95 % interval. Short intervals that the line goes through are good, "
            f"and e = {_MILLI * c:.3g} mm {law}."
        )
    marks += _with_intervals(lengths, _MILLI)
    top = _MILLI * max(each.upper if math.isfinite(each.upper) else each.value for each in lengths)
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
        speeds: mu at each speed.
        curve: Speeds and mu of the fitted curve, shape (2, n); None without one.
        creeping: Whether the surface only crept at some speeds.
    """
    if len(speeds) < 2:
        return None
    marks = [] if curve is None else [Line(_MILLI * curve[0], curve[1], "fitted", FELT)]
    values = [each.value for each in speeds] + [each.true for each in speeds if each.true is not None]
    at = _MILLI * np.array([each.at for each in speeds])
    return Figure(
        title="Friction over speed",
        caption=(
            f"{_over_speed(speeds)} Short intervals on the true value are good.{_CREEPING if creeping else ''}"
        ),
        panels=(
            Panel(
                (*marks, *_with_intervals(speeds, 1.0, _MILLI)),
                Axis("slip speed", "mm/s", logarithmic=True, ticks=_plain_ticks(at)),
                Axis("friction mu", low=0.0, high=1.3 * max(values)),
            ),
        ),
    )


def _over_speed(speeds: Sequence[Interval]) -> str:
    slipped = [each for each in speeds if not each.bound]
    if len(slipped) < 2:
        return "mu at each speed at which it slipped."
    low, high = min(slipped, key=lambda each: each.value), max(slipped, key=lambda each: each.value)
    if high.lower <= low.upper:
        return "mu is the same at all speeds, within its intervals."
    return (
        f"mu goes from {low.value:.3g} at {_MILLI * low.at:.3g} mm/s to {high.value:.3g} at "
        f"{_MILLI * high.at:.3g} mm/s."
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
    """Return a quarter of |x|^p + |y|^p = 1."""
    angle = np.linspace(0.0, 0.5 * np.pi, 181)
    x: FloatArray = np.cos(angle) ** (2.0 / p)
    y: FloatArray = np.abs(np.sin(angle)) ** (2.0 / p)
    return x, y


def _between(low: float, high: float) -> Polygon:
    """Return the region of all limit surfaces whose p lies between two values."""
    (x, y), (u, v) = _curve(low), _curve(high)
    name = f"p from {low:g} to {high:g}"
    return Polygon(np.concatenate([x, u[::-1]]), np.concatenate([y, v[::-1]]), name, QUIET_COLOUR, 0.25)


def _plain_ticks(values: FloatArray) -> tuple[tuple[float, str], ...]:
    return tuple((each, f"{each:.3g}") for each in np.unique(np.round(values, 6)).tolist())
