"""Marks of a panel in space: surfaces, paths, points, arrows, as data. Lengths in metres; drawn in millimetres."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.reporting.marks import Colouring, Symbol
from palpate.runtime.palette import FELT, INK_COLOUR, TRACK, Colour


@dataclass(frozen=True, slots=True, eq=False)
class Surface:
    """A surface of triangles.

    Attributes:
        vertices: Shape (n, 3) [m].
        triangles: Indices of vertices, shape (m, 3).
        name: In the legend; "" for none.
        colourings: By value at the vertices, one at a time, the first at first; none: in one colour.
        colour: Role, where no colouring is.
        opacity: From 0 to 1.
        shown: Whether it is shown before the reader asks for it in the legend.
    """

    vertices: FloatArray
    triangles: npt.NDArray[np.integer]
    name: str = ""
    colourings: tuple[Colouring, ...] = ()
    colour: Colour = FELT
    opacity: float = 1.0
    shown: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """A line in space; broken where a point is NaN.

    Attributes:
        points: Shape (n, 3) [m].
        name: In the legend; "" for none.
        colour: Role.
        width: [px]
        shown: Whether it is shown before the reader asks for it in the legend.
    """

    points: FloatArray
    name: str = ""
    colour: Colour = TRACK
    width: float = 2.0
    shown: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Spots:
    """Single points in space.

    Attributes:
        points: Shape (n, 3) [m].
        name: In the legend; "" for none.
        colour: Role, where no colouring is.
        size: [px]
        symbol: What stands for a point.
        colourings: By value, one at a time, the first at first.
        texts: Shown beside the pointer, one per point.
        shown: Whether they are shown before the reader asks for them in the legend.
    """

    points: FloatArray
    name: str = ""
    colour: Colour = FELT
    size: float = 4.0
    symbol: Symbol = Symbol.DOT
    colourings: tuple[Colouring, ...] = ()
    texts: tuple[str, ...] = ()
    shown: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class Arrows:
    """Arrows of forces or moments.

    Attributes:
        starts: Shape (n, 3) [m]; or in each step of the picture others, shape (steps, n, 3).
        along: To the tips, of the same shape [m].
        name: In the legend; "" for none.
        colour: Role.
    """

    starts: FloatArray
    along: FloatArray
    name: str = ""
    colour: Colour = FELT


@dataclass(frozen=True, slots=True, eq=False)
class Labels:
    """Words at points in space.

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
    """Marks of which those of one step of the picture are shown.

    Attributes:
        marks: Of each step.
    """

    marks: "tuple[tuple[Surface | Path | Spots | Labels, ...], ...]"


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A surface that moves as a rigid body.

    Attributes:
        surface: In a frame of its own.
        positions: Of that frame in each step of the picture, shape (steps, 3) [m].
        rotations: Its axes as columns, shape (steps, 3, 3).
    """

    surface: Surface
    positions: FloatArray
    rotations: FloatArray

    def at(self, step: int) -> Surface:
        """Return it where it is in a step."""
        vertices = self.surface.vertices @ self.rotations[step].T + self.positions[step]
        return replace(self.surface, vertices=vertices)


Solid = Surface | Path | Spots | Arrows | Labels | Stepped | Placed
"""What a panel in space shows."""


def moves(mark: Solid) -> bool:
    """Return whether it is another in each step of the picture."""
    return isinstance(mark, Stepped | Placed) or (isinstance(mark, Arrows) and mark.starts.ndim == 3)


def extent(marks: Sequence[Solid]) -> tuple[FloatArray, FloatArray]:
    """Return the least and the largest coordinates of marks in any step, with some room; each (3,) [m]."""
    points = np.concatenate([np.zeros((0, 3)), *(each for mark in marks for each in _points(mark))])
    known = points[np.isfinite(points).all(axis=1)]
    low, high = (known.min(axis=0), known.max(axis=0)) if len(known) else (np.zeros(3), np.zeros(3))
    room = 0.03 * max(float((high - low).max()), 1e-3)
    return low - room, high + room


def _points(mark: Solid) -> Iterator[FloatArray]:
    match mark:
        case Stepped():
            for marks in mark.marks:
                for each in marks:
                    yield from _points(each)
        case Placed():
            for step in range(len(mark.positions)):
                yield mark.at(step).vertices
        case Surface():
            yield mark.vertices
        case Arrows():
            yield from (mark.starts.reshape(-1, 3), (mark.starts + mark.along).reshape(-1, 3))
        case _:
            yield mark.points
