"""Marks of a flat panel: lines, points, bands, bars, rules, cells, as data.

Colours are roles of `palpate.runtime.palette`, so that whoever draws chooses their shade by the reader's theme.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.palette import CARD, FELT, INK_COLOUR, QUIET_COLOUR, Colour


class Dash(StrEnum):
    """How a line is broken."""

    SOLID = "solid"
    DASHED = "dash"
    """Of what was set or asked for."""
    DOTTED = "dot"
    DASH_DOT = "dashdot"
    """Of limits."""


class Symbol(StrEnum):
    """What stands for a point."""

    DOT = "circle"
    RING = "circle-open"
    SQUARE = "square"
    DIAMOND = "diamond"
    CROSS = "x"
    PLUS = "cross"
    TRIANGLE = "triangle-up"
    STROKE = "line-ew-open"


class ColourScale(StrEnum):
    """From numbers to colours; distinct with colour-blind eyes."""

    HEIGHT = "viridis"
    """Of what is small or large."""
    ERROR = "signed"
    """Of what is of either sign: blue, white, red."""
    TIME = "viridis without its ends"
    """Of thin lines and small dots, seen on either ground."""
    SHARE = "viridis reversed"
    """Of shares; none is pale."""


@dataclass(frozen=True, slots=True, eq=False)
class Colouring:
    """What colours tell, at points or vertices.

    Attributes:
        quantity: What it is, as the colour bar and the switch between colourings name it.
        values: In `unit`, shape (n,); NaN where it is not known.
        unit: Of the values; "" for a ratio or a count.
        low: Value of the first colour; the least finite value if None.
        high: Of the last, likewise.
        scale: From values to colours.
    """

    quantity: str
    values: FloatArray
    unit: str = ""
    low: float | None = None
    high: float | None = None
    scale: ColourScale = ColourScale.HEIGHT

    @property
    def label(self) -> str:
        """Quantity and unit."""
        return labelled(self.quantity, self.unit)


@dataclass(frozen=True, slots=True, eq=False)
class Line:
    """A line through points; broken where one is NaN.

    Attributes:
        x: Shape (n,), in the unit of the axis.
        y: Likewise.
        name: In the legend; "" for none.
        colour: Role.
        width: [px]
        dash: How it is broken.
        opacity: From 0 to 1.
        points: Whether each point has a dot.
    """

    x: FloatArray
    y: FloatArray
    name: str = ""
    colour: Colour = FELT
    width: float = 1.5
    dash: Dash = Dash.SOLID
    opacity: float = 1.0
    points: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Points:
    """Single points.

    Attributes:
        x: Shape (n,), in the unit of the axis.
        y: Likewise.
        name: In the legend; "" for none.
        colour: Role; of the rim alone where `colouring` is given.
        size: [px]
        symbol: What stands for a point.
        x_error: How far each may be to the left and to the right, shape (2, n).
        y_error: Downwards and upwards.
        colouring: By value.
        texts: Shown beside the pointer, one per point.
    """

    x: FloatArray
    y: FloatArray
    name: str = ""
    colour: Colour = FELT
    size: float = 7.0
    symbol: Symbol = Symbol.DOT
    x_error: FloatArray | None = None
    y_error: FloatArray | None = None
    colouring: Colouring | None = None
    texts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Moving:
    """A ring that is at (x[k], y[k]) in step k of the figure.

    Attributes:
        x: Shape (steps,), in the unit of the axis; NaN where it is nowhere.
        y: Likewise.
        name: In the legend; "" for none.
        colour: Role.
        size: [px]
    """

    x: FloatArray
    y: FloatArray
    name: str = ""
    colour: Colour = INK_COLOUR
    size: float = 13.0


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """What lies between two lines.

    Attributes:
        x: Shape (n,), in the unit of the axis.
        low: Shape (n,).
        high: Likewise.
        name: In the legend; "" for none.
        colour: Role.
        opacity: From 0 to 1.
    """

    x: FloatArray
    low: FloatArray
    high: FloatArray
    name: str = ""
    colour: Colour = FELT
    opacity: float = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Polygon:
    """The inside of a polygon.

    Attributes:
        x: Corners in order, shape (n,), in the unit of the axis.
        y: Likewise.
        name: In the legend; "" for none.
        colour: Role.
        opacity: From 0 to 1.
    """

    x: FloatArray
    y: FloatArray
    name: str = ""
    colour: Colour = QUIET_COLOUR
    opacity: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Bars:
    """Bars from zero.

    Attributes:
        at: Their middles, shape (n,), in the unit of the axis.
        length: Shape (n,).
        width: Shape (n,).
        name: In the legend; "" for none.
        colour: Role.
        lying: Whether they lie: `at` is then along y.
    """

    at: FloatArray
    length: FloatArray
    width: FloatArray
    name: str = ""
    colour: Colour = FELT
    lying: bool = False

    @classmethod
    def histogram(cls, values: FloatArray, bins: int = 60) -> "Bars":
        """Return how many of finite `values` (n,), n at least 1, lie in each of some bins."""
        number, edges = np.histogram(values, bins)
        return cls(0.5 * (edges[1:] + edges[:-1]), number.astype(np.float64), np.diff(edges))


@dataclass(frozen=True, slots=True)
class Rule:
    """A straight line across the panel.

    Attributes:
        at: Where, in the unit of the axis that it crosses.
        name: In the legend; "" for none.
        colour: Role.
        width: [px]
        dash: How it is broken.
        upright: Whether it crosses the x axis.
    """

    at: float
    name: str = ""
    colour: Colour = INK_COLOUR
    width: float = 1.0
    dash: Dash = Dash.SOLID
    upright: bool = True


@dataclass(frozen=True, slots=True)
class Span:
    """A strip across the panel, behind all else.

    Attributes:
        low: Where it begins, in the unit of the axis that it crosses.
        high: Where it ends.
        name: In the legend; "" for none.
        colour: Role.
        upright: Whether it crosses the x axis.
        opacity: From 0 to 1.
    """

    low: float
    high: float
    name: str = ""
    colour: Colour = CARD
    upright: bool = True
    opacity: float = 1.0


@dataclass(frozen=True, slots=True)
class Text:
    """Words at a place.

    Attributes:
        x: In the unit of the axis.
        y: Likewise.
        text: What is written.
        colour: Role.
    """

    x: float
    y: float
    text: str
    colour: Colour = INK_COLOUR


@dataclass(frozen=True, slots=True, eq=False)
class Cells:
    """A table of coloured cells.

    Attributes:
        colouring: Of the cells, row by row, shape (rows * columns,).
        columns: Name of each.
        rows: Name of each, from above.
        texts: Written into the cells, row by row; none if empty.
    """

    colouring: Colouring
    columns: tuple[str, ...]
    rows: tuple[str, ...]
    texts: tuple[str, ...] = field(default=())


@dataclass(frozen=True, slots=True, eq=False)
class Density:
    """How often something was where: cells of a grid in one colour, the more opaque the more often.

    Attributes:
        x: Edges of the columns, shape (columns + 1,), in the unit of the axis, evenly spaced.
        y: Of the rows, shape (rows + 1,), likewise.
        shares: Of all that was counted, shape (rows, columns); 0 where nothing was.
        name: In the legend; "" for none.
        colour: Role.
    """

    x: FloatArray
    y: FloatArray
    shares: FloatArray
    name: str = ""
    colour: Colour = FELT

    @property
    def depth(self) -> FloatArray:
        """Logarithm of the shares, from 0 for the least to 1 for the largest; NaN where nothing was."""
        depth = np.log(np.where(self.shares > 0.0, self.shares, np.nan))
        low = np.nanmin(depth, initial=0.0)
        return np.asarray((depth - low) / max(float(np.nanmax(depth, initial=low) - low), 1e-12))


FAINTEST = 0.15
"""Opacity of the least density."""

Mark = Line | Points | Moving | Band | Polygon | Bars | Rule | Span | Text | Cells | Density
"""What a flat panel shows."""


def unnamed(marks: Iterable[Mark]) -> tuple[Mark, ...]:
    """Return marks without their entries in the legend, which the panel above has."""
    return tuple(mark if isinstance(mark, Text | Cells) else replace(mark, name="") for mark in marks)


def shortened(typed: str, longest: int) -> str:
    """Return a name that people typed as a legend can hold it: short, and of letters that can be seen."""
    shown = typed if len(typed) <= longest else typed[: longest - 1] + "…"
    return "".join(each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in shown)


def finite_limits(colouring: Colouring) -> tuple[float, float]:
    """Return the values of a colouring's first and last colour, which differ."""
    known = colouring.values[np.isfinite(colouring.values)]
    low = colouring.low if colouring.low is not None else float(known.min(initial=np.inf))
    high = colouring.high if colouring.high is not None else float(known.max(initial=-np.inf))
    return (low, high) if low < high else (low - 0.5, low + 0.5) if np.isfinite(low) else (0.0, 1.0)


def labelled(quantity: str, unit: str) -> str:
    """Return a quantity with its unit, as an axis or a colour bar names it."""
    return f"{quantity} [{unit}]" if unit else quantity
