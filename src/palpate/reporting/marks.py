"""Marks of a flat panel: lines, points, bands, bars, rules, cells, as data.

Colours are roles of `palpate.runtime.palette`; the page or the paper puts in their shades.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum, StrEnum

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime.palette import CARD, FELT, INK_COLOUR, QUIET_COLOUR, SIDE_BY_SIDE, Colour

MIN_OPACITY = 0.15
"""Opacity of the smallest share of a `Density`."""

_DRAWN_BINS = 900
"""Bins of a drawn line: about one per pixel of a report's width, so that no peak is lost."""


class Dash(StrEnum):
    """Dashes of a line, by the names of plotly.js."""

    SOLID = "solid"
    DASHED = "dash"
    """Set forces and other requests."""
    DOTTED = "dot"
    DASH_DOT = "dashdot"
    """Limits."""


class Symbol(StrEnum):
    """Symbols of points, by the names of plotly.js."""

    DOT = "circle"
    RING = "circle-open"
    SQUARE = "square"
    DIAMOND = "diamond"
    CROSS = "x"
    PLUS = "cross"
    TRIANGLE = "triangle-up"
    STROKE = "line-ew-open"


class ColourScale(Enum):
    """Anchors of colour scales, evenly spaced; colour-blind readers can distinguish them.

    Viridis: van der Walt and Smith, matplotlib 1.5 (2015), CC0. Signed: ColorBrewer's RdBu (Brewer, Harrower,
    2003).
    """

    HEIGHT = (
        "#440154", "#482878", "#3e4989", "#31688e", "#26828e",
        "#1f9e89", "#35b779", "#6ece58", "#b5de2b", "#fde725",
    )  # fmt: skip
    """Viridis, for small to large values."""
    TIME = HEIGHT[3:8]
    """Viridis without its ends, for thin lines and small dots on a light or dark background."""
    SHARE = HEIGHT[::-1]
    """Viridis reversed, for shares: large ones are dark."""
    ERROR = (
        "#053061", "#2166ac", "#4393c3", "#92c5de", "#d1e5f0", "#f7f7f7",
        "#fddbc7", "#f4a582", "#d6604d", "#b2182b", "#67001f",
    )  # fmt: skip
    """Blue, white, red, for values of either sign."""


def look_of(
    number: int, colours: Sequence[Colour] = SIDE_BY_SIDE, dashes: Sequence[Dash] = tuple(Dash)
) -> tuple[Colour, Dash, Symbol, float]:
    """Return colour, dash, symbol and relative width of one of many lines or point sets; no two look alike.

    The first lines differ by colour, further ones by their dash or symbol, too, and then by their width.

    Args:
        number: Number of the line, from 0.
        colours: Colours to choose from.
        dashes: Dashes to choose from, the usual one first.
    """
    again, colour = divmod(number, len(colours))
    thicker, dash = divmod(again, len(dashes))
    return colours[colour], dashes[dash], tuple(Symbol)[again % len(Symbol)], 1.0 + thicker


@dataclass(frozen=True, slots=True, eq=False)
class Colouring:
    """Values shown by colour, at points or vertices.

    Attributes:
        quantity: Name of the values, on the colour bar and in the menu of colourings.
        values: Values in `unit`, shape (n,); NaN where unknown.
        unit: Unit of the values; "" for a ratio or a count.
        low: Value of the first colour; the smallest finite value if None.
        high: Value of the last colour; the largest finite value if None.
        scale: Colour scale.
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

    @property
    def limits(self) -> tuple[float, float]:
        """Values of the first and the last colour; they always differ."""
        known = self.values[np.isfinite(self.values)]
        low = self.low if self.low is not None else float(known.min(initial=np.inf))
        high = self.high if self.high is not None else float(known.max(initial=-np.inf))
        return (low, high) if low < high else (low - 0.5, low + 0.5) if np.isfinite(low) else (0.0, 1.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Located:
    """A mark at points.

    Attributes:
        x: Shape (n,), in the unit of the axis.
        y: Shape (n,), in the unit of the axis.
        name: Name in the legend; "" for none.
        colour: Role.
    """

    x: FloatArray
    y: FloatArray
    name: str = ""
    colour: Colour = FELT


@dataclass(frozen=True, slots=True, eq=False)
class Line(_Located):
    """A line through points; broken at NaN.

    Attributes:
        width: Width [px].
        dash: Dashes.
        opacity: From 0 to 1.
        points: Whether each point has a dot.
    """

    width: float = 1.5
    dash: Dash = Dash.SOLID
    opacity: float = 1.0
    points: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Points(_Located):
    """Single points; with a colouring, `colour` is that of the error bars alone.

    Attributes:
        size: Diameter [px].
        symbol: Symbol of each point.
        x_error: Error bars to the left and to the right, shape (2, n).
        y_error: Error bars downwards and upwards, shape (2, n).
        colouring: Colours by value.
        texts: Text beside the pointer, one per point.
    """

    size: float = 7.0
    symbol: Symbol = Symbol.DOT
    x_error: FloatArray | None = None
    y_error: FloatArray | None = None
    colouring: Colouring | None = None
    texts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class Moving(_Located):
    """A ring at (x[k], y[k]) in step k of the figure; at NaN it is hidden.

    Attributes:
        size: Diameter [px].
    """

    colour: Colour = INK_COLOUR
    size: float = 13.0


@dataclass(frozen=True, slots=True, eq=False)
class Polygon(_Located):
    """The inside of a polygon; `x` and `y` are its corners in order.

    Attributes:
        opacity: From 0 to 1.
    """

    colour: Colour = QUIET_COLOUR
    opacity: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Density(_Located):
    """Shares of samples in the cells of a grid: the larger the share, the more opaque the cell.

    `x` and `y` are the evenly spaced edges of columns and rows, shapes (columns + 1,) and (rows + 1,).

    Attributes:
        shares: Shares of all samples, shape (rows, columns).
    """

    shares: FloatArray = field(kw_only=True)

    @property
    def depth(self) -> FloatArray:
        """Logarithm of the shares, scaled from 0 for the smallest to 1 for the largest; NaN in empty cells."""
        depth = np.log(np.where(self.shares > 0.0, self.shares, np.nan))
        low = np.nanmin(depth, initial=0.0)
        return np.asarray((depth - low) / max(float(np.nanmax(depth, initial=low) - low), 1e-12))


@dataclass(frozen=True, slots=True, eq=False)
class Band:
    """The area between two lines.

    Attributes:
        x: Shape (n,), in the unit of the axis.
        low: Lower line, shape (n,).
        high: Upper line, shape (n,).
        name: Name in the legend; "" for none.
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
class Bars:
    """Bars from zero.

    Attributes:
        at: Centres, shape (n,), in the unit of the axis.
        length: Lengths, shape (n,).
        width: Widths, shape (n,).
        name: Name in the legend; "" for none.
        colour: Role.
        lying: Whether the bars are horizontal: `at` is then along y.
    """

    at: FloatArray
    length: FloatArray
    width: FloatArray
    name: str = ""
    colour: Colour = FELT
    lying: bool = False

    @classmethod
    def histogram(cls, values: FloatArray, bins: int = 60) -> "Bars":
        """Return the histogram of finite `values` (n,), n at least 1."""
        number, edges = np.histogram(values, bins)
        return cls(0.5 * (edges[1:] + edges[:-1]), number.astype(np.float64), np.diff(edges))


@dataclass(frozen=True, slots=True)
class Rule:
    """A straight line across the panel.

    Attributes:
        at: Place on the axis that the line crosses, in its unit.
        name: Name in the legend; "" for none.
        colour: Role.
        width: Width [px].
        dash: Dashes.
        upright: Whether the line crosses the x axis.
    """

    at: float
    name: str = ""
    colour: Colour = INK_COLOUR
    width: float = 1.0
    dash: Dash = Dash.SOLID
    upright: bool = True


@dataclass(frozen=True, slots=True)
class Span:
    """A strip across the panel, behind all other marks.

    Attributes:
        low: Beginning on the axis that the strip crosses, in its unit.
        high: End.
        name: Name in the legend; "" for none.
        colour: Role.
        upright: Whether the strip crosses the x axis.
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
    """A text, centred at a place.

    Attributes:
        x: In the unit of the axis.
        y: In the unit of the axis.
        text: The text.
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
        colouring: Values of the cells, row by row, shape (rows * columns,).
        columns: Names of the columns.
        rows: Names of the rows, from above.
        texts: Texts in the cells, row by row; () for none.
    """

    colouring: Colouring
    columns: tuple[str, ...]
    rows: tuple[str, ...]
    texts: tuple[str, ...] = ()


Mark = Line | Points | Moving | Band | Polygon | Bars | Rule | Span | Text | Cells | Density
"""Marks of a flat panel."""


def unnamed(marks: Iterable[Mark]) -> tuple[Mark, ...]:
    """Return marks without their entries in the legend, for panels below one that has them."""
    return tuple(mark if isinstance(mark, Text | Cells) else replace(mark, name="") for mark in marks)


def shortened(name: str, longest: int) -> str:
    """Return a name for a legend: at most `longest` letters, printable ones only."""
    shown = name if len(name) <= longest else name[: longest - 1] + "…"
    return "".join(each if each.isprintable() else "\N{REPLACEMENT CHARACTER}" for each in shown)


def labelled(quantity: str, unit: str) -> str:
    """Return a quantity with its unit, for an axis or a colour bar."""
    return f"{quantity} [{unit}]" if unit else quantity


def envelope(time: FloatArray, value: FloatArray, bins: int = _DRAWN_BINS) -> tuple[FloatArray, FloatArray]:
    """Return a subset of a series that draws like the whole series.

    The samples are divided into `bins` bins of equal size. Each bin keeps its lowest and its highest value, in
    their order, and a NaN if it has one, so that lines stay broken. Series of up to 2 * `bins` samples are
    returned unchanged.

    Args:
        time: Shape (n,).
        value: Shape (n,), may hold NaN.
        bins: Number of bins, at least 1.

    Returns:
        Time and value, each of shape (m,) with m at most 3 * `bins` + 2.
    """
    count = len(time)
    if count <= 2 * bins:
        return time, value
    edges = np.linspace(0, count, bins + 1).astype(np.intp)
    starts, sizes = edges[:-1], np.diff(edges)
    missing = np.isnan(value)
    # sorted by bin, then value: the first of each bin is its lowest; NaN sorts last
    order = np.lexsort((np.where(missing, np.inf, value), np.repeat(np.arange(bins), sizes)))
    present = np.add.reduceat((~missing).astype(np.intp), starts)
    highest = order[starts + np.maximum(present, 1) - 1]
    first_missing = order[np.minimum(starts + present, edges[1:] - 1)][present < sizes]
    keep = np.unique(np.concatenate([order[starts], highest, first_missing, [0, count - 1]]))
    return time[keep], value[keep]


def thinned(line: Line, most: int) -> tuple[FloatArray, FloatArray]:
    """Return x and y of at most about `most` points of a line, with its peaks if x never decreases."""
    x, y = line.x, line.y
    if len(x) <= most:
        return x, y
    if (np.diff(x) >= 0.0).all():
        return envelope(x, y, most // 3)
    kept = np.linspace(0, len(x) - 1, most).round().astype(np.intp)
    return x[kept], y[kept]
