"""Marks of a panel in space: surfaces, paths, points, arrows, as data, in metres; drawn in millimetres."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from itertools import chain

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.reporting.marks import Colouring, Symbol
from palpate.runtime.palette import FELT, INK_COLOUR, MAP_COLOUR, TRACK, Colour

_MARGIN, _MIN_HEIGHT = 0.04, 0.12
"""Space around the marks and minimum extent along any axis, relative to the largest extent."""

_MIN_EXTENT = 1e-6
"""Extent of a single point [m]."""

_SIDES = 10
"""Corners of the round parts of an arrow."""

_SHAFT, _HEAD, _HEAD_LENGTH = 0.022, 0.06, 0.22
"""Radii of shaft and head, and length of the head, relative to the longest arrow."""


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A surface of triangles.

    Attributes:
        vertices: Shape (n, 3) [m].
        triangles: Indices of vertices, shape (m, 3).
        name: Name in the legend; "" for none.
        colourings: Values at the vertices; the reader chooses one of them. () for a plain surface.
        colour: Role of a plain surface.
        opacity: From 0 to 1.
        shown: Whether the surface is shown before the reader selects it in the legend.
    """

    vertices: FloatArray
    triangles: npt.NDArray[np.integer]
    name: str = ""
    colourings: tuple[Colouring, ...] = ()
    colour: Colour = FELT
    opacity: float = 1.0
    shown: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class _Located:
    """A mark at points.

    Attributes:
        points: Shape (n, 3) [m].
        name: Name in the legend; "" for none.
        colour: Role without colouring.
        colourings: Values at the points; the reader chooses one of them. () for plain points.
        shown: Whether the mark is shown before the reader selects it in the legend.
    """

    points: FloatArray
    name: str = ""
    colour: Colour = FELT
    colourings: tuple[Colouring, ...] = field(default=(), kw_only=True)
    shown: bool = field(default=True, kw_only=True)


@dataclass(frozen=True, slots=True, eq=False)
class Polyline(_Located):
    """A line in space; broken at NaN.

    Attributes:
        width: Width [px].
    """

    colour: Colour = TRACK
    width: float = 2.0


@dataclass(frozen=True, slots=True, eq=False)
class Spots(_Located):
    """Single points in space.

    Attributes:
        size: Diameter [px].
        symbol: Symbol of each point.
        texts: Text beside the pointer, one per point.
    """

    size: float = 4.0
    symbol: Symbol = Symbol.DOT
    texts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Arrows:
    """Arrows of forces or moments.

    Attributes:
        starts: Shape (n, 3) [m]; (steps, n, 3) where they move from step to step.
        along: Vectors to the tips, of the same shape [m].
        name: Name in the legend; "" for none.
        colour: Role.
    """

    starts: FloatArray
    along: FloatArray
    name: str = ""
    colour: Colour = FELT


@dataclass(frozen=True, slots=True, eq=False)
class Labels:
    """Texts at points in space.

    Attributes:
        points: Shape (n, 3) [m].
        texts: One per point.
        colour: Role.
    """

    points: FloatArray
    texts: tuple[str, ...]
    colour: Colour = INK_COLOUR


@dataclass(frozen=True, slots=True, eq=False)
class Stepped:
    """Marks that change from step to step of the figure.

    Attributes:
        marks: Marks of each step.
    """

    marks: "tuple[tuple[Surface | Polyline | Spots | Labels, ...], ...]"


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A surface that moves as a rigid body.

    Attributes:
        surface: Surface in a frame of its own.
        positions: Origin of that frame in each step of the figure, shape (steps, 3) [m].
        rotations: Axes of that frame as columns, shape (steps, 3, 3).
    """

    surface: Surface
    positions: FloatArray
    rotations: FloatArray

    def at(self, step: int) -> Surface:
        """Return the surface at its place in a step."""
        vertices = self.surface.vertices @ self.rotations[step].T + self.positions[step]
        return replace(self.surface, vertices=vertices)


Solid = Surface | Polyline | Spots | Arrows | Labels | Stepped | Placed
"""Marks of a panel in space. The reader chooses a quantity, at first the first one of the panel: marks that have
it are coloured by it, the others are plain."""


def quantities(marks: Iterable[Solid]) -> tuple[str, ...]:
    """Return all quantities by which the marks of a panel can be coloured, in order."""
    flat = chain.from_iterable(chain(*mark.marks) if isinstance(mark, Stepped) else (mark,) for mark in marks)
    coloured = (mark.colourings for mark in flat if isinstance(mark, Surface | Polyline | Spots))
    return tuple(dict.fromkeys(each.quantity for each in chain.from_iterable(coloured)))


def coloured_by(marks: Iterable[Solid], quantity: str) -> tuple[Solid, ...]:
    """Return marks coloured by one quantity alone."""
    return tuple(_coloured_by(mark, quantity) for mark in marks)


def _coloured_by(mark: Solid, quantity: str) -> Solid:
    if isinstance(mark, Stepped):
        return Stepped(tuple(coloured_by(each, quantity) for each in mark.marks))  # type: ignore[misc]
    if not isinstance(mark, Surface | Polyline | Spots) or not mark.colourings:
        return mark
    chosen = tuple(each for each in mark.colourings if each.quantity == quantity)
    unknown = isinstance(mark, Surface) and not chosen
    return replace(mark, colourings=chosen, colour=MAP_COLOUR if unknown else mark.colour)


def bounding_box(marks: Iterable[Solid]) -> FloatArray:
    """Return the ends of the panel along each axis, shape (3, 2) [m]; they hold all steps and hidden marks."""
    points = np.concatenate([np.zeros((0, 3)), *map(_places, marks)])
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return np.array([[-1e-3, 1e-3]] * 3)
    low, high = points.min(axis=0), points.max(axis=0)
    largest = max(float((high - low).max()), _MIN_EXTENT)
    half = np.maximum(0.5 * (high - low) + _MARGIN * largest, 0.5 * _MIN_HEIGHT * largest)
    middle = 0.5 * (low + high)
    return np.column_stack([middle - half, middle + half])


def _places(mark: Solid) -> FloatArray:
    """All points of a mark, shape (n, 3) [m]."""
    match mark:
        case Surface():
            return mark.vertices.reshape(-1, 3)
        case Arrows():
            return np.concatenate([mark.starts, mark.starts + mark.along]).reshape(-1, 3)
        case Placed():
            return np.concatenate([mark.at(step).vertices for step in range(len(mark.positions))])
        case Stepped():
            return np.concatenate([np.zeros((0, 3)), *map(_places, chain(*mark.marks))])
        case _:
            return mark.points.reshape(-1, 3)


def arrow_triangles(
    starts: FloatArray, along: FloatArray, longest: float
) -> tuple[FloatArray, npt.NDArray[np.int32]]:
    """Return vertices (k, 3) and triangles (m, 3) of arrows, without those of length zero.

    Args:
        starts: Shape (n, 3).
        along: Vectors to the tips, shape (n, 3).
        longest: Length of the longest arrow of the panel, which determines the thickness.
    """
    lengths = np.linalg.norm(along, axis=1)
    drawn = np.flatnonzero(lengths > 0.0)
    vertices = [starts[i] + _profile(along[i] / lengths[i], float(lengths[i]), longest) for i in drawn]
    first = (3 * _SIDES + 1) * np.arange(len(drawn), dtype=np.int32)
    triangles = (_TRIANGLES + first[:, None, None]).reshape(-1, 3)
    return np.concatenate([np.zeros((0, 3)), *vertices]), triangles


def _profile(axis: FloatArray, length: float, longest: float) -> FloatArray:
    """Three rings and the tip of an arrow from the origin, shape (3 * _SIDES + 1, 3)."""
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    angle = np.linspace(0.0, 2.0 * np.pi, _SIDES, endpoint=False)[:, None]
    ring = np.cos(angle) * first + np.sin(angle) * np.cross(axis, first)
    neck = max(length - _HEAD_LENGTH * longest, 0.4 * length)
    rings = ((0.0, _SHAFT), (neck, _SHAFT), (neck, _HEAD))
    parts = [at * axis + radius * longest * ring for at, radius in rings]
    return np.asarray(np.concatenate([*parts, (length * axis)[None]]), dtype=np.float64)


def _arrow_indices() -> npt.NDArray[np.int32]:
    found: list[tuple[int, int, int]] = []
    for i in range(2 * _SIDES):
        after = i + 1 if (i + 1) % _SIDES else i + 1 - _SIDES
        found += [(i, after, i + _SIDES), (after, after + _SIDES, i + _SIDES)]
    rim = 2 * _SIDES
    found += [(rim + i, rim + (i + 1) % _SIDES, 3 * _SIDES) for i in range(_SIDES)]
    return np.array(found, dtype=np.int32)


_TRIANGLES = _arrow_indices()
