"""The curve that a contour is expected to follow, computed from the object: points, length, and where to land."""

import math
from dataclasses import dataclass

import numpy as np
from contourpy import LineType, contour_generator

from palpate.controllers.paths import Point, Turn
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.tip_surface import TipSurface
from palpate.sim import HeightField, SceneObject

LEAN = math.radians(45.0)
"""Slope at which an edge is followed: the mean of a right-angled edge's two faces."""

HALF = 0.5
"""Of the fingertip's half length along z: a level contour so far below the top leans by at most 60 degrees."""

PRECIPICE = 1e3
"""Tangent of the slope beside the object."""

FLAT = 0.4
"""Share of the object's height: on a flat relief a level contour stays above mid-height, where its peaks end."""

LANDING = math.radians(50.0)
"""Steepest place to land on [rad]: 60 degrees are the limit from above, and the grid may be off."""

LEVEL = math.radians(2.0)
"""Least slope of a landing place beside a level curve [rad]: on the level, downhill is undefined."""

INSIDE = math.radians(20.0)
"""Steepest place to land on before an edge [rad]: on its upper face."""

NEARLY_AS_NEAR = 1.0
"""Curves whose distances differ by less than this many half lengths of the tip are equally near; the longest of
them is taken."""

SHORTEST = math.pi
"""Least length of a curve over the tip's half length: half the tip's circumference; less is a single contact."""


@dataclass(frozen=True, slots=True, eq=False)
class PredictedContour:
    """A closed curve.

    Attributes:
        points: Of the middle of the fingertip, in the order that it passes them from where it meets the curve, the
            first not repeated, shape (n, 2) [m].
        heights: Of the middle of the fingertip there, shape (n,) [m].
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
        loops = _loops(surface, surface.steepness(PRECIPICE), math.tan(LEAN), config)
        if not loops:
            raise InvalidValueError(
                f"curve = edge: the {config.object} leans by {math.degrees(LEAN):g} degrees along no closed curve "
                "that the fingertip could follow; take --curve level"
            )
        loop = _chosen(loops, config)
        landing = config.middle if config.center else _beside(surface, loop, config, 0.0, INSIDE)
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
    landing = config.middle if config.center else _beside(surface, loop, config, LEVEL, LANDING)
    return _turned(loop, landing, turn, np.full(len(loop), height))


def drop(target: SceneObject, config: ExploreConfig) -> float:
    """Return how far below its height on the top the fingertip goes round [m]."""
    if config.below is not None:
        return config.below
    return min(HALF * config.tip[-1], FLAT * (target.top - target.bottom))


def _loops(surface: TipSurface, values: FloatArray, value: float, config: ExploreConfig) -> list[FloatArray]:
    """Closed curves [m] along which `values` are `value`, each longer than a touch, none of its points twice."""
    contours = contour_generator(surface.x, surface.y, np.ma.masked_invalid(values), line_type=LineType.Separate)
    lines: list[FloatArray] = contours.lines(value)  # type: ignore[assignment]  # what Separate is
    closed = (line[:-1] for line in lines if len(line) > 3 and np.array_equal(line[0], line[-1]))
    return [loop for loop in closed if _length(loop) > SHORTEST * min(config.tip)]


def _chosen(loops: list[FloatArray], config: ExploreConfig) -> FloatArray:
    """The longest of those nearest to the middle."""
    distances = [float(np.linalg.norm(loop - config.middle, axis=1).min()) for loop in loops]
    limit = min(distances) + NEARLY_AS_NEAR * min(config.tip)
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
