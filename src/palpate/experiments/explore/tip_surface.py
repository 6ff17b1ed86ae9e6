"""The middle of a fingertip on an object seen from above: its heights on a grid, and closed curves along it."""

import math
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from contourpy import LineType, contour_generator
from scipy.interpolate import RegularGridInterpolator
from scipy.ndimage import binary_dilation, grey_dilation

from palpate.controllers.paths import Point, Turn
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.sim import HeightField, SceneObject

GRID_STEP = 1e-3
"""Distance of grid lines [m]. Between them heights err by GRID_STEP^2 / (8 R) = 0.02 mm at most for R = 8 mm."""

_MAX_GRID_LINES = 401
"""Along each side: of larger objects the grid is coarser."""

_TRIED_HALF_SIDES = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)
"""Half sides of the square that are tried [m], until the object lies inside."""

_SURVEY_LINES = 41
"""Grid lines along each side of those."""

EDGE_LEAN = math.radians(45.0)
"""Slope at which an edge is followed: the mean of a right-angled edge's two faces."""

_MAX_DROP_RATIO = 0.5
"""Depth of a level contour below the top over the tip's half length along z: it leans by 60 degrees at most."""

_RIM_TANGENT = 1e3
"""Tangent of the slope beside the object."""

_MAX_DROP_SHARE = 0.4
"""Share of the object's height: on a flat relief a level contour stays above mid-height, where its peaks end."""

_MAX_LANDING_SLOPE = math.radians(50.0)
"""Steepest place to land on [rad]: 60 degrees are the limit from above, and the grid may be off."""

_MIN_LANDING_SLOPE = math.radians(2.0)
"""Least slope of a landing place beside a level curve [rad]: on the level, downhill is undefined."""

_MAX_SLOPE_INSIDE = math.radians(20.0)
"""Steepest place to land on before an edge [rad]: on its upper face."""

_EQUAL_DISTANCE_RATIO = 1.0
"""Curves whose distances differ by less than this many half lengths of the tip are equally near; the longest of
them is taken."""

_MIN_LENGTH_RATIO = math.pi
"""Least length of a curve over the tip's half length: half the tip's circumference; less is a single contact."""


@dataclass(frozen=True, slots=True, eq=False)
class TipSurface:
    """Heights of the middle of the tip.

    Where the tip meets nothing they go on level, a tip below the object; where unknown, they are NaN.

    Attributes:
        x: Grid lines, increasing, shape (n,) [m].
        y: Grid lines, increasing, shape (m,) [m].
        z: Heights, shape (m, n) [m].
        met: Where the tip meets the object, shape (m, n).
        reach: How far beside its middle the tip may touch [m].
    """

    x: FloatArray
    y: FloatArray
    z: FloatArray
    met: np.ndarray[tuple[int, int], np.dtype[np.bool_]]
    reach: float

    @classmethod
    def of(cls, target: SceneObject, tip: tuple[float, ...]) -> Self:
        """Return it for a tip of one (radius) or three (semi-axes) half lengths [m]: a dilation."""
        half = tip if len(tip) == 3 else tip * 3
        room = _extent(target) + max(half) + 2.0 * GRID_STEP
        step = max(GRID_STEP, 2.0 * room / (_MAX_GRID_LINES - 1))
        count = int(np.ceil(room / step))
        x: FloatArray = step * np.arange(-count, count + 1, dtype=np.float64)
        height = np.asarray(target.height(*np.meshgrid(x, x)))
        beside = target.bottom - 2.0 * max(half)
        height = np.where(np.isnan(height), beside - half[2], height)
        u, v = (step * np.arange(-int(h / step), int(h / step) + 1) / h for h in half[:2])
        inside = 1.0 - np.add.outer(v**2, u**2)
        cap = half[2] * np.sqrt(np.maximum(inside, 0.0))
        dilation: Any = grey_dilation  # whose stubs want whole numbers
        z: FloatArray = dilation(height, structure=cap, footprint=inside >= 0.0, mode="nearest")
        met = z > beside + 1e-9
        return cls(x, x, np.where(met, z, beside), met, max(half))

    @property
    def top(self) -> float:
        """Largest height [m]."""
        return float(np.nanmax(self.z))

    def within(self, x: float, y: float) -> Self:
        """Return the surface as known up to `x` and `y` [m] from the middle, less the tip's own reach."""
        reach = self.reach
        known = np.logical_and.outer(np.abs(self.y) <= y - reach, np.abs(self.x) <= x - reach)
        return replace(self, z=np.where(known, self.z, np.nan), met=self.met & known)

    def steepness(self, beside: float = np.nan) -> FloatArray:
        """Return the tangent of its slope, shape (m, n); `beside` the object and at its rim."""
        z = np.where(self.met, self.z, np.nan)
        slope_y, slope_x = np.gradient(z, self.y, self.x)
        slope = np.hypot(slope_x, slope_y)
        rim = binary_dilation(np.isfinite(self.z) & ~self.met)
        return np.asarray(np.where(np.isnan(slope) & rim, beside, slope))

    def at(self, points: FloatArray) -> FloatArray:
        """Return heights at places (n, 2), shape (n,) [m]; beside the grid those of its rim."""
        inside = np.clip(points, [self.x[0], self.y[0]], [self.x[-1], self.y[-1]])
        return np.asarray(RegularGridInterpolator((self.y, self.x), self.z)(inside[:, ::-1]))

    def meets(self, points: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return whether the tip meets the object at places (n, 2), shape (n,)."""
        columns = np.rint((points[:, 0] - self.x[0]) / (self.x[1] - self.x[0])).astype(int)
        rows = np.rint((points[:, 1] - self.y[0]) / (self.y[1] - self.y[0])).astype(int)
        known = (columns >= 0) & (columns < len(self.x)) & (rows >= 0) & (rows < len(self.y))
        found = np.zeros(len(points), dtype=np.bool_)
        found[known] = self.met[rows[known], columns[known]]
        return found


def _extent(target: SceneObject) -> float:
    """Half side of a square about the origin in which the object lies, seen from above [m]."""
    for extent in _TRIED_HALF_SIDES[:-1]:
        along = np.linspace(-extent, extent, _SURVEY_LINES)
        known = np.isfinite(target.height(*np.meshgrid(along, along)))
        if known.any() and not (known[[0, -1]].any() or known[:, [0, -1]].any()):
            return extent
    return _TRIED_HALF_SIDES[-1]


@dataclass(frozen=True, slots=True, eq=False)
class PredictedContour:
    """A closed curve.

    Attributes:
        points: Places of the middle of the fingertip in order, from the first on the curve, which is not repeated
            at the end, shape (n, 2) [m].
        heights: Heights of the middle of the fingertip there, shape (n,) [m].
        landing: Where the tip lands [m].
    """

    points: FloatArray
    heights: FloatArray
    landing: Point

    @property
    def length(self) -> float:
        """Perimeter [m]."""
        steps = np.diff(self.points, axis=0, append=self.points[:1])
        rise = np.diff(self.heights, append=self.heights[:1])
        return float(np.sqrt((steps**2).sum(axis=1) + rise**2).sum())

    @property
    def approach_length(self) -> float:
        """Distance from the landing to the curve, seen from above [m]."""
        return math.dist(self.landing, self.points[0].tolist())

    @property
    def outward(self) -> Point:
        """Unit direction from the landing to the curve."""
        length, (x, y) = self.approach_length, self.points[0].tolist()
        return ((x - self.landing[0]) / length, (y - self.landing[1]) / length) if length > 0.0 else (1.0, 0.0)


def predicted_contour(target: SceneObject, config: ExploreConfig) -> PredictedContour:
    """Return the curve of a contour around or on an object.

    Raises:
        InvalidValueError: There is none, or no place to land beside it; the message suggests a remedy.
    """
    surface = TipSurface.of(target, config.tip)
    if isinstance(target, HeightField):  # nothing is known of what lies beside it
        surface = surface.within(target.width / 2.0, target.depth / 2.0)
    turn = Turn.LEFT if config.turn == "left" else Turn.RIGHT
    if config.curve == "edge":
        loops = _loops(surface, surface.steepness(_RIM_TANGENT), math.tan(EDGE_LEAN), config)
        if not loops:
            raise InvalidValueError(
                f"curve = edge: the {config.object} leans by {math.degrees(EDGE_LEAN):g} degrees along no closed "
                "curve that the fingertip could follow; take --curve level"
            )
        loop = _chosen(loops, config)
        landing = config.middle if config.center else _beside(surface, loop, config, 0.0, _MAX_SLOPE_INSIDE)
        return _turned(loop, landing, turn, surface.at(loop))
    below = drop(target, config)
    height = surface.top - below
    loops = _loops(surface, surface.z, height, config)
    if not loops:
        room = surface.top - float(surface.z[surface.met].min())
        raise InvalidValueError(
            f"below = {below:g} m: no curve goes once round the {config.object} so far below its top; the "
            f"fingertip's height differs by {room:.3g} m over it, take --below between 0 and that"
        )
    loop = _chosen(loops, config)
    landing = (
        config.middle if config.center else _beside(surface, loop, config, _MIN_LANDING_SLOPE, _MAX_LANDING_SLOPE)
    )
    return _turned(loop, landing, turn, np.full(len(loop), height))


def drop(target: SceneObject, config: ExploreConfig) -> float:
    """Return how far below its height on the top the fingertip goes round [m]."""
    if config.below is not None:
        return config.below
    return min(_MAX_DROP_RATIO * config.tip[-1], _MAX_DROP_SHARE * (target.top - target.bottom))


def _loops(surface: TipSurface, values: FloatArray, value: float, config: ExploreConfig) -> list[FloatArray]:
    """Closed curves [m] along which `values` are `value`, each longer than a touch, none of its points twice."""
    contours = contour_generator(surface.x, surface.y, np.ma.masked_invalid(values), line_type=LineType.Separate)
    lines: list[FloatArray] = contours.lines(value)  # type: ignore[assignment]  # what Separate is
    closed = (line[:-1] for line in lines if len(line) > 3 and np.array_equal(line[0], line[-1]))
    return [loop for loop in closed if _length(loop) > _MIN_LENGTH_RATIO * min(config.tip)]


def _chosen(loops: list[FloatArray], config: ExploreConfig) -> FloatArray:
    """The longest of those nearest to the middle."""
    distances = [float(np.linalg.norm(loop - config.middle, axis=1).min()) for loop in loops]
    limit = min(distances) + _EQUAL_DISTANCE_RATIO * min(config.tip)
    return max((loop for loop, d in zip(loops, distances, strict=True) if d <= limit), key=_length)


def _beside(surface: TipSurface, loop: FloatArray, config: ExploreConfig, least: float, most: float) -> Point:
    """The place nearest to where the curve is nearest to the middle that leans by `least` to `most` [rad]."""
    x, y = np.meshgrid(surface.x, surface.y)
    slope = surface.steepness()
    good = (slope <= math.tan(most)) & (slope >= math.tan(least))
    places = np.column_stack([x[good], y[good]])
    if not len(places):
        raise InvalidValueError(
            f"center: beside the curve the {config.object} has no place to land on that leans by "
            f"{math.degrees(least):.0f} to {math.degrees(most):.0f} degrees; give a landing place (--center)"
        )
    nearest = loop[np.argmin(np.linalg.norm(loop - config.middle, axis=1))]
    u, v = places[np.argmin(np.linalg.norm(places - nearest, axis=1))].tolist()
    return (u, v)


def _turned(loop: FloatArray, landing: Point, turn: Turn, heights: FloatArray) -> PredictedContour:
    """The curve in the order that it is passed from the landing on."""
    x, y = loop[:, 0], loop[:, 1]
    area = 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
    if (area > 0.0) != (turn is Turn.LEFT):
        loop, heights = loop[::-1], heights[::-1]
    first = int(np.argmin(np.linalg.norm(loop - landing, axis=1)))
    return PredictedContour(np.roll(loop, -first, axis=0), np.roll(heights, -first), landing)


def _length(loop: FloatArray) -> float:
    return float(np.linalg.norm(np.diff(loop, axis=0, append=loop[:1]), axis=1).sum())
