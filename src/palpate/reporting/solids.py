"""Marks of a panel in space: surfaces, paths, points, arrows, as data. Lengths in metres; drawn in millimetres."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.reporting.marks import Colouring, Symbol
from palpate.runtime.palette import FELT, INK_COLOUR, MAP_COLOUR, TRACK, Colour


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
class Polyline:
    """A line in space; broken where a point is NaN.

    Attributes:
        points: Shape (n, 3) [m].
        name: In the legend; "" for none.
        colour: Role, where no colouring is.
        width: [px]
        colourings: By value at the points, one at a time.
        shown: Whether it is shown before the reader asks for it in the legend.
    """

    points: FloatArray
    name: str = ""
    colour: Colour = TRACK
    width: float = 2.0
    colourings: tuple[Colouring, ...] = ()
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
        starts: Shape (n, 3) [m]; or in each step of the figure others, shape (steps, n, 3).
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
    """Marks of which those of one step of the figure are shown.

    Attributes:
        marks: Of each step.
    """

    marks: "tuple[tuple[Surface | Polyline | Spots | Labels, ...], ...]"


@dataclass(frozen=True, slots=True, eq=False)
class Placed:
    """A surface that moves as a rigid body.

    Attributes:
        surface: In a frame of its own.
        positions: Of that frame in each step of the figure, shape (steps, 3) [m].
        rotations: Its axes as columns, shape (steps, 3, 3).
    """

    surface: Surface
    positions: FloatArray
    rotations: FloatArray

    def at(self, step: int) -> Surface:
        """Return it where it is in a step."""
        vertices = self.surface.vertices @ self.rotations[step].T + self.positions[step]
        return replace(self.surface, vertices=vertices)


Solid = Surface | Polyline | Spots | Arrows | Labels | Stepped | Placed
"""What a panel in space shows. What has the quantity that the reader chooses is coloured by it, the rest is plain;
the first quantity of a panel is chosen at first."""


def quantities(marks: Iterable[Solid]) -> tuple[str, ...]:
    """Return all quantities by which marks of a panel can be coloured, in order."""
    flat = (each for mark in marks for each in (chain(*mark.marks) if isinstance(mark, Stepped) else (mark,)))
    coloured = (each for each in flat if isinstance(each, Surface | Polyline | Spots))
    return tuple(dict.fromkeys(each.quantity for mark in coloured for each in mark.colourings))


def coloured_by(marks: Iterable[Solid], quantity: str) -> tuple[Solid, ...]:
    """Return marks coloured by one quantity alone."""
    return tuple(_coloured_by(mark, quantity) for mark in marks)


def _coloured_by(mark: Solid, quantity: str) -> Solid:
    match mark:
        case Stepped():
            return Stepped(tuple(coloured_by(each, quantity) for each in mark.marks))  # type: ignore[misc]
        case Surface() | Polyline() | Spots() if mark.colourings:
            chosen = tuple(each for each in mark.colourings if each.quantity == quantity)
            unknown = isinstance(mark, Surface) and not chosen
            return replace(mark, colourings=chosen, colour=MAP_COLOUR if unknown else mark.colour)
        case _:
            return mark


def places(mark: Solid) -> FloatArray:
    """Return all points of a mark, those of other steps and those not shown yet among them, shape (n, 3) [m]."""
    match mark:
        case Surface():
            return mark.vertices.reshape(-1, 3)
        case Arrows():
            return np.concatenate([mark.starts.reshape(-1, 3), (mark.starts + mark.along).reshape(-1, 3)])
        case Placed():
            return np.concatenate([mark.at(step).vertices for step in range(len(mark.positions))])
        case Stepped():
            return np.concatenate([np.zeros((0, 3)), *(places(each) for marks in mark.marks for each in marks)])
        case _:
            return mark.points.reshape(-1, 3)
