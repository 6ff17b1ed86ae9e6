"""Places, durations and predictions of a strategy on an object.

A strategy itself is a class of `palpate.controllers.paths`. A `Scan` places it on an object.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.controllers import ExploreParameters, Raster
from palpate.controllers.paths import (
    Active,
    ActiveSettings,
    Contour,
    EdgeSteering,
    Follow,
    Goal,
    GoalError,
    LevelSteering,
    PathPlane,
    Point,
    RasterRows,
    Spiral,
    Strategy,
    Taps,
    Turn,
    Waypoints,
    tap_grid,
)
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.config import ExploreConfig, StrategyName
from palpate.experiments.explore.fit import Region, region_on
from palpate.experiments.explore.tip_surface import (
    EDGE_LEAN,
    PredictedContour,
    TipSurface,
    drop,
    predicted_contour,
)
from palpate.sim import SceneObject
from palpate.spatial import add

_CORNER_TIME = -0.02
"""Time that a corner adds to the motion from rest to rest [s]. A corner counts as reached while the tip still
moves; measured on a ball at 50 mm/s."""

_CLIMB_RATIO = 1.05
"""Path length along the surface over that seen from above: 1.03 on a ball of 40 mm over a square of 40 mm."""

_MAX_DURATION_RATIO = 4.0
"""Longest over expected duration. On slopes of 60 degrees a path is twice as long; beyond, something is wrong."""

_PROBE_DISTANCE = 5e-3
"""Distance along a path between places where the prediction looks for the object [m]."""

_MIN_FIRST_PIECE = 2e-4
"""Minimum length of the first piece of a path [m]: twice the length that gives a direction."""

_TAP_RETREAT = 5e-3
"""Retreat after a tap [m]: more than a tip of 8 mm rises on a slope of 45 degrees to the next tap."""

_MAX_ROUND_TRIPS = 1.5
"""Longest over predicted length of a contour that does not close."""

_EXTRA_CONTOUR_LENGTH = 0.05
"""Extra path length allowed for a contour [m]."""

_CONTOUR_ROWS = 4.0
"""Rows that a contour counts for: each quarter sees another side of the object."""


@dataclass(frozen=True, slots=True)
class PathTiming:
    """Durations of the pieces of a path.

    Attributes:
        parameters: Speeds.
        descent: Height of the start above the surface [m].
        miss: Length of an approach that meets nothing [m].
    """

    parameters: ExploreParameters
    descent: float
    miss: float

    def piece(self, length: float) -> float:
        """Return the duration of a straight piece from corner to corner, `length` [m] seen from above [s]."""
        own, length = self.parameters, _CLIMB_RATIO * length
        if length < own.speed**2 / own.acceleration:  # it brakes before it is at speed
            return 2.0 * math.sqrt(length / own.acceleration) + _CORNER_TIME
        return length / own.speed + own.speed / own.acceleration + _CORNER_TIME

    @property
    def ends(self) -> float:
        """Duration of the first landing with its settling, and of the last lift-off [s]."""
        own = self.parameters
        return self.descent / own.landing_speed + own.settle_time + own.lift_distance / own.lift_speed

    @property
    def missing(self) -> float:
        """Duration of an approach that meets nothing [s]."""
        return self.miss / self.parameters.landing_speed + self.miss / self.parameters.lift_speed

    def hop(self, length: float, height: float) -> float:
        """Return the duration of lifting by a height, travelling a length [m], landing and settling [s]."""
        own = self.parameters
        return height / own.lift_speed + length / own.travel_speed + height / own.landing_speed + own.settle_time


_Duration = Callable[[PathTiming], float]
"""Gives a duration [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class Scan:
    """A strategy on an object. Places are those of the middle of the tip, seen from above [m].

    Attributes:
        kind: Name of the strategy.
        line: Description for a report.
        begin: Place of the first landing [m].
        corners: Corners of the path, in order; the outline of the field where contacts decide on the path [m].
        box: Least and largest place [m].
        row: Path length over which contacts share one error: each row counts as one observation of a shape [m].
        row_gap: Distance between rows, turns or taps at first [m].
        strategy: Returns a fresh strategy in a plane whose coordinates are those of the middle of the tip.
        duration: Expected duration.
        longest: _Duration after which something is wrong.
        passes: Returns whether places (n, 2) lie in the field that is to be touched everywhere, shape (n,).
        length: Path length seen from above, without landings [m]; NaN where contacts decide on the path.
        contour: Predicted curve of a contour.
        goal: Goal of an active exploration.
    """

    kind: StrategyName
    line: str
    begin: Point
    corners: tuple[Point, ...]
    box: tuple[Point, Point]
    row: float
    row_gap: float
    strategy: Callable[[PathPlane, PathTiming], Strategy]
    duration: _Duration
    longest: _Duration
    passes: Callable[[FloatArray], npt.NDArray[np.bool_]]
    length: float = math.nan
    contour: PredictedContour | None = None
    goal: Goal | None = None


@dataclass(frozen=True, slots=True)
class _OffObjectPrediction:
    """Prediction for a field that may extend beyond the object.

    Attributes:
        begin: Place of the first landing [m]. An exploration ends where that meets nothing.
        missed: Number of places at which the tip is expected to meet nothing.
    """

    begin: Point
    missed: int


def scan_on(target: SceneObject, config: ExploreConfig) -> Scan:
    """Return the scan of a configuration, as it fits the object.

    Raises:
        InvalidValueError: If it does not fit; the message names what would fit.
    """
    if config.strategy == "contour":
        return _contour(target, config)
    region = region_on(target, config)
    match config.strategy:
        case "raster":
            return _raster(target, config, region)
        case "spiral":
            return _spiral(target, config, region)
        case "taps":
            return _taps(target, config, region)
        case "active":
            return _active(target, config, region)


def _raster(target: SceneObject, config: ExploreConfig, region: Region) -> Scan:
    raster = Raster(region.width, region.depth, config.gap, region.center)
    corners = raster.corners()
    off = _predicted_rows(target, config, raster)

    def strategy(plane: PathPlane, timing: PathTiming) -> Strategy:
        return Follow(raster, plane) if off is None else RasterRows(raster, plane, off.begin)

    def duration(timing: PathTiming) -> float:
        pieces = sum(timing.piece(math.dist(*ends)) for ends in pairwise(corners))
        # most rows stop at rims: about one landing each that meets nothing
        missed = 0 if off is None else min(off.missed, raster.rows)
        return timing.ends + pieces + missed * timing.missing

    def longest(timing: PathTiming) -> float:
        hops = 0.0 if off is None else _longest_hops(raster.length, timing)
        return _MAX_DURATION_RATIO * duration(timing) + hops

    return Scan(
        kind="raster",
        line=f"{region.line}, rows {1e3 * config.gap:g} mm apart",
        begin=corners[0] if off is None else off.begin,
        corners=corners,
        box=region.corners,
        row=region.width,
        row_gap=config.gap,
        strategy=strategy,
        duration=duration,
        longest=longest,
        passes=region.holds,
        length=raster.length,
    )


def _spiral(target: SceneObject, config: ExploreConfig, region: Region) -> Scan:
    radius, spacing = 0.5 * region.width, config.gap
    spiral = Spiral(radius, spacing, region.center)
    corners, missed = spiral.corners(), 0
    path: Spiral | Waypoints = spiral
    if config.beyond:
        missed = _missed_places(target, config, in_pieces(corners, _PROBE_DISTANCE))
        path = _path_from_object(target, config, corners)

    def passes(places: FloatArray) -> npt.NDArray[np.bool_]:
        """Return whether places lie within the outermost turn, which is no circle."""
        x, y = (places - region.center).T
        turns = radius / spacing
        outermost = turns - (turns - np.arctan2(y, x) / (2.0 * np.pi)) % 1.0
        return np.asarray(np.hypot(x, y) <= spacing * outermost)

    def duration(timing: PathTiming) -> float:
        own, turn = timing.parameters, 2.0 * math.pi / spacing
        # on its inner turns it is as slow as they are narrow: speed^2 / radius is bounded
        inner = min(radius, own.speed**2 / own.acceleration)
        slow = turn * inner * math.sqrt(inner / own.acceleration) / 1.5
        outer = _CLIMB_RATIO * (0.5 * turn * (radius**2 - inner**2)) / own.speed
        return timing.ends + _CLIMB_RATIO * slow + outer + missed * timing.missing

    def longest(timing: PathTiming) -> float:
        hops = _longest_hops(spiral.length, timing) if config.beyond else 0.0
        return _MAX_DURATION_RATIO * duration(timing) + hops

    return Scan(
        kind="spiral",
        line=f"{region.line}, turns {1e3 * spacing:g} mm apart",
        begin=path.corners()[0],
        corners=path.corners(),
        box=region.corners,
        row=0.5 * math.pi * region.width,  # half the outermost turn, a turn's mean
        row_gap=spacing,
        strategy=lambda plane, timing: Follow(path, plane),
        duration=duration,
        longest=longest,
        passes=passes,
        length=spiral.length,
    )


def _taps(target: SceneObject, config: ExploreConfig, region: Region) -> Scan:
    spacing = config.gap
    points = tap_grid(region.width, region.depth, spacing, region.center)
    missed = _missed_places(target, config, points)

    def duration(timing: PathTiming) -> float:
        each = timing.hop(spacing, _TAP_RETREAT) + 0.1
        return timing.ends + len(points) * each + missed * timing.missing

    def longest(timing: PathTiming) -> float:
        return 3.0 * duration(timing) + len(points) * timing.hop(spacing, timing.descent)

    return Scan(
        kind="taps",
        line=f"{len(points)} over {region.line}, {1e3 * spacing:g} mm apart",
        begin=points[0],
        corners=points,
        box=region.corners,
        row=spacing,  # every tap is a new observation
        row_gap=spacing,
        strategy=lambda plane, timing: Taps(points, _TAP_RETREAT, plane),
        duration=duration,
        longest=longest,
        passes=region.holds,
    )


def _active(target: SceneObject, config: ExploreConfig, region: Region) -> Scan:
    """Return the scan whose coarse rows are followed by closer ones where the map would err."""
    measure = GoalError.RMS if config.measure == "rms" else GoalError.LARGEST
    wanted = Goal(
        config.wanted_error, measure, area=config.area, time=math.inf if config.time is None else config.time
    )
    settings = ActiveSettings.suited(measure)
    ends = Raster(region.width, region.depth, min(settings.prior, region.depth), region.center)
    missed = _missed_places(target, config, ends.corners())
    (x0, y0), (x1, y1) = region.corners

    def row_time(timing: PathTiming) -> float:
        """Return the duration of a row and of the slide to it, without obstacles [s]."""
        return timing.piece(region.width) + timing.piece(settings.prior)

    def begun_rows(timing: PathTiming) -> float:
        """Return the number of rows that begin within the time of the goal, without landings; may be infinite."""
        rows = wanted.time / row_time(timing)
        return rows if math.isinf(rows) else math.ceil(rows)

    def strategy(plane: PathPlane, timing: PathTiming) -> Strategy:
        # the goal assumes one mean speed: that of a whole row with the travel to it
        goal = replace(wanted, speed=(region.width + settings.prior) / row_time(timing))
        return Active(region.width, region.depth, goal, center=region.center, plane=plane)

    def duration(timing: PathTiming) -> float:
        """Return the duration of rows as close as a smooth surface needs, and half as many for its details.

        If the time is over before, only the rows that have begun by then count: a row is finished.
        """
        rows = 1.5 * (region.depth / settings.prior + 1.0)
        begun = max(min(rows, begun_rows(timing)), 1.0)
        return timing.ends + begun * row_time(timing) + missed * timing.missing * begun / rows

    def longest(timing: PathTiming) -> float:
        """Return the duration of all rows as close as they may be, or of those begun and one more, with hops."""
        rows = min(region.depth / (2.0 * settings.finest), begun_rows(timing)) + 1.0
        each = row_time(timing) + timing.hop(region.width, timing.descent)
        return timing.ends + _MAX_DURATION_RATIO * rows * each

    kind = "RMS" if measure is GoalError.RMS else "at most"
    return Scan(
        kind="active",
        line=f"{region.line}, until the map errs by {1e3 * wanted.error:.3g} mm {kind}",
        begin=(x0, y0),
        corners=((x0, y0), (x1, y0), (x1, y1), (x0, y1)),
        box=region.corners,
        row=region.width,
        row_gap=settings.prior,
        strategy=strategy,
        duration=duration,
        longest=longest,
        passes=region.holds,
        goal=wanted,
    )


def _contour(target: SceneObject, config: ExploreConfig) -> Scan:
    predicted = predicted_contour(target, config)
    turn = Turn.LEFT if config.turn == "left" else Turn.RIGHT
    approach, length = predicted.approach_length, predicted.length

    def strategy(plane: PathPlane, timing: PathTiming) -> Strategy:
        begin = predicted.landing
        longest = _MAX_ROUND_TRIPS * length + 2.0 * approach + _EXTRA_CONTOUR_LENGTH
        if config.curve == "edge":
            steering = EdgeSteering(plane, EDGE_LEAN, min(config.tip), (*predicted.outward, 0.0), turn)
            return Contour(begin, steering, plane, longest)
        height = (0.0, 0.0, float(predicted.heights[0]))
        level = PathPlane(add(plane.origin, height), plane.rotation_base_plane)
        return Contour(begin, LevelSteering(level, turn), plane, longest)

    def duration(timing: PathTiming) -> float:
        return timing.ends + (length + _CLIMB_RATIO * approach) / timing.parameters.speed

    def longest(timing: PathTiming) -> float:
        return 3.0 * duration(timing) + _EXTRA_CONTOUR_LENGTH / timing.parameters.speed

    places = np.vstack([predicted.points, predicted.landing])
    (a, b), (c, d) = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    curve = "an edge" if config.curve == "edge" else f"{1e3 * drop(target, config):.3g} mm below the top"
    return Scan(
        kind="contour",
        line=f"along {curve}, about {1e3 * length:.0f} mm, {turn.name.lower()} round",
        begin=predicted.landing,
        corners=tuple((x, y) for x, y in predicted.points.tolist()),
        box=((a, b), (c, d)),
        row=length / _CONTOUR_ROWS,
        row_gap=config.gap,
        strategy=strategy,
        duration=duration,
        longest=longest,
        passes=lambda places: np.zeros(len(places), dtype=np.bool_),  # a line encloses no field
        length=length,
        contour=predicted,
    )


def in_pieces(corners: Sequence[Point], longest: float) -> list[Point]:
    """Return a polygon with corners in between, so that none of its pieces is longer than `longest` [m]."""
    path = list(corners[:1])
    for a, b in pairwise(corners):
        count = max(1, math.ceil(math.dist(a, b) / longest - 1e-9))
        path += [(a[0] + (b[0] - a[0]) * k / count, a[1] + (b[1] - a[1]) * k / count) for k in range(1, count + 1)]
    return path


def _longest_hops(length: float, timing: PathTiming) -> float:
    """Return the duration of landing again and again along a path of a length [m], in [s]."""
    return length / _PROBE_DISTANCE * timing.hop(_PROBE_DISTANCE, timing.miss)


def _predicted_rows(target: SceneObject, config: ExploreConfig, raster: Raster) -> _OffObjectPrediction | None:
    """Return the prediction for rows that may leave the object; None if they may not.

    They begin on a row, as far as possible from places that cannot be touched.

    Raises:
        InvalidValueError: If none of the places can be touched.
    """
    if not config.beyond:
        return None
    places = in_pieces(raster.corners(), min(_PROBE_DISTANCE, raster.width / 4.0))
    reached = np.array([target.reachable(*place, min(config.tip)) for place in places])
    if not reached.any():
        raise _unreachable(config)
    on, off = np.array(places)[reached], np.array(places)[~reached]
    depth = KDTree(off).query(on)[0] if len(off) else -np.linalg.norm(on - raster.center, axis=1)
    x, y = on[int(np.argmax(depth))].tolist()
    begin = (x, min((v for _, v in raster.corners()), key=lambda v: abs(v - y)))
    return _OffObjectPrediction(begin, _missed_places(target, config, places))


def _path_from_object(target: SceneObject, config: ExploreConfig, corners: tuple[Point, ...]) -> Waypoints:
    """Return the rest of a path from the first place on that can be touched.

    Raises:
        InvalidValueError: If no place of the path can be touched.
    """
    path = list(corners)
    while len(path) > 1:
        pieces = in_pieces(path[:2], _PROBE_DISTANCE)
        first = next((place for place in pieces[:-1] if target.reachable(*place, min(config.tip))), None)
        if first is not None:
            rest = path[1:] if math.dist(path[1], first) > _MIN_FIRST_PIECE else path[2:]
            return Waypoints((first, *rest))
        path.pop(0)
    raise _unreachable(config)


def _unreachable(config: ExploreConfig) -> InvalidValueError:
    return InvalidValueError(
        f"beyond: the {config.strategy} nowhere meets a part of the {config.object} that can be touched from "
        "above; move it there (--center)"
    )


def _missed_places(target: SceneObject, config: ExploreConfig, places: Sequence[Point]) -> int:
    """Return the number of places at which the tip would meet nothing; 0 where it may not go there."""
    if not config.beyond:
        return 0
    return int((~TipSurface.of(target, config.tip).meets(np.array(places))).sum())
