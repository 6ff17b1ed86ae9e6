"""A flat panel as matplotlib draws it."""

from collections.abc import Sequence

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from matplotlib.ticker import NullFormatter

from palpate.errors import FloatArray
from palpate.reporting.envelope import thinned
from palpate.reporting.figure import Panel
from palpate.reporting.marks import (
    FAINTEST,
    Band,
    Bars,
    Cells,
    Dash,
    Density,
    Line,
    Mark,
    Moving,
    Points,
    Polygon,
    Rule,
    Span,
    Symbol,
    Text,
)
from palpate.reporting.paper_colours import colour_bar, colour_map, norm_of
from palpate.runtime.palette import CARD, GRID_COLOUR, INK_COLOUR

MOST_POINTS = 3000
"""Of a line: what a printer resolves."""

LETTERS = 21
"""Of a legend, per inch: names and the lines before them."""

HANDLE = 7
"""Letters that the line before a name takes as much room as."""

_DASHES = {Dash.SOLID: "-", Dash.DASHED: (0, (5, 3)), Dash.DOTTED: ":", Dash.DASH_DOT: (0, (6, 2, 1, 2))}
_SYMBOLS = {
    Symbol.DOT: "o",
    Symbol.RING: "o",
    Symbol.SQUARE: "s",
    Symbol.DIAMOND: "D",
    Symbol.CROSS: "x",
    Symbol.PLUS: "P",
    Symbol.TRIANGLE: "^",
    Symbol.STROKE: "_",
}
_POINT = 0.6
"""Of a line or a point in print [points], per pixel on a screen."""


def draw_panel(axes: Axes, panel: Panel, step: int) -> None:
    """Draw a flat panel; of what moves, that step."""
    for axis, ends in ((panel.x, axes.set_xscale), (panel.y, axes.set_yscale)):
        if axis.logarithmic:
            ends("log")
    for order, mark in enumerate(panel.marks):
        _draw(axes, mark, step, 2.0 + 0.01 * order)
    axes.set(xlabel=_typed(panel.x.label), ylabel=_typed(panel.y.label))
    if any(isinstance(mark, Cells) for mark in panel.marks):
        return
    axes.grid(visible=True, color=GRID_COLOUR.light, linewidth=0.4)
    axes.set_axisbelow(True)
    dotted = any(isinstance(mark, Points) or (isinstance(mark, Line) and mark.points) for mark in panel.marks)
    axes.margins(x=0.02 if panel.equal or dotted else 0.0)
    _limit(axes, panel)
    if panel.ground is not None:
        axes.set_facecolor(panel.ground.light)
    if panel.equal:
        axes.set_aspect("equal", adjustable="box")
    entries: dict[str, Artist] = {}
    for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
        entries.setdefault(name, handle)
    if not entries:
        axes.set_title(_typed(panel.title), fontsize=8.0, loc="left")
    else:
        axes.legend(
            list(entries.values()),
            list(entries),
            title=_typed(panel.title) or None,
            title_fontsize=8.0,
            alignment="left",
            loc="lower left",
            bbox_to_anchor=(0.0, 1.0),
            ncols=_columns(axes, list(entries)),
            frameon=False,
            borderpad=0.2,
            handlelength=1.6,
        )


def _columns(axes: Axes, names: Sequence[str]) -> int:
    """Most columns of a legend that have room above its axes; matplotlib fills one after the other."""
    figure = axes.get_figure()
    assert figure is not None
    room = LETTERS * axes.get_position().width * figure.get_size_inches()[0]  # type: ignore[union-attr]
    for columns in range(len(names), 1, -1):
        parts = np.array_split(np.arange(len(names)), columns)
        if sum(HANDLE + max(len(names[i]) for i in part) for part in parts) <= room:
            return columns
    return 1


def _typed(text: str) -> str:
    """Text that people may have typed, in which nothing is a formula."""
    return text.replace("$", r"\$")


def _limit(axes: Axes, panel: Panel) -> None:
    for axis, drawn, get, put in (
        (panel.x, axes.xaxis, axes.get_xlim, axes.set_xlim),
        (panel.y, axes.yaxis, axes.get_ylim, axes.set_ylim),
    ):
        low, high = get()
        if axis.low is None and axis.high is None and abs(high - low) < axis.span:
            low, high = 0.5 * (low + high - axis.span), 0.5 * (low + high + axis.span)
        put(low if axis.low is None else axis.low, high if axis.high is None else axis.high)
        if axis.ticks:
            drawn.set_ticks([at for at, _ in axis.ticks], labels=[_typed(name) for _, name in axis.ticks])
            drawn.set_minor_formatter(NullFormatter())


def _draw(axes: Axes, mark: Mark, step: int, order: float) -> None:
    name = _typed(getattr(mark, "name", "")) or None
    match mark:
        case Line():
            x, y = thinned(mark.x, mark.y, MOST_POINTS)
            axes.plot(
                x,
                y,
                color=mark.colour.light,
                linewidth=_POINT * mark.width,
                linestyle=_DASHES[mark.dash],
                alpha=mark.opacity,
                marker="o" if mark.points else None,
                markersize=2.5,
                zorder=order,
                label=name,
            )
        case Points():
            _draw_points(axes, mark, order)
        case Moving():
            ring = Points(
                mark.x[step : step + 1], mark.y[step : step + 1], mark.name, mark.colour, mark.size, Symbol.RING
            )
            _draw_points(axes, ring, order)
        case Band():
            axes.fill_between(
                mark.x,
                mark.low,
                mark.high,
                color=mark.colour.light,
                alpha=mark.opacity,
                linewidth=0.0,
                zorder=order,
                label=name,
            )
        case Polygon():
            axes.fill(
                mark.x,
                mark.y,
                color=mark.colour.light,
                alpha=mark.opacity,
                linewidth=0.0,
                zorder=order,
                label=name,
            )
        case Bars():
            draw = axes.barh if mark.lying else axes.bar
            draw(mark.at, mark.length, mark.width, color=mark.colour.light, zorder=order, label=name)
        case Rule():
            rule = axes.axvline if mark.upright else axes.axhline
            rule(
                mark.at,
                color=mark.colour.light,
                linewidth=_POINT * mark.width,
                linestyle=_DASHES[mark.dash],
                zorder=order,
                label=name,
            )
        case Span():
            span = axes.axvspan if mark.upright else axes.axhspan
            span(
                mark.low,
                mark.high,
                color=mark.colour.light,
                alpha=mark.opacity,
                linewidth=0.0,
                zorder=0.5,
                label=name,
            )
        case Text():
            axes.text(mark.x, mark.y, mark.text, color=mark.colour.light, ha="center", va="center", zorder=order)
        case Cells():
            _draw_cells(axes, mark)
        case Density():
            colour = to_rgb(mark.colour.light)
            shades = LinearSegmentedColormap.from_list("", [(*colour, FAINTEST), (*colour, 1.0)])
            depth = np.ma.masked_invalid(mark.depth)
            axes.pcolormesh(mark.x, mark.y, depth, cmap=shades, zorder=order, rasterized=True)
            axes.scatter([], [], marker="s", color=colour, label=name)  # a field has no entry in a legend


def _draw_points(axes: Axes, mark: Points, order: float) -> None:
    hollow = mark.symbol is Symbol.RING
    if mark.colouring is not None:
        dots = axes.scatter(
            mark.x,
            mark.y,
            c=mark.colouring.values,
            cmap=colour_map(mark.colouring.scale),
            norm=norm_of(mark.colouring),
            s=(_POINT * mark.size) ** 2,
            linewidths=0.0,
            rasterized=True,
            zorder=order,
        )
        colour_bar(axes, dots, mark.colouring.label)
        return
    axes.errorbar(
        mark.x,
        mark.y,
        xerr=mark.x_error,
        yerr=mark.y_error,
        fmt=_SYMBOLS[mark.symbol],
        color=mark.colour.light,
        markerfacecolor="none" if hollow else mark.colour.light,
        markersize=_POINT * mark.size,
        elinewidth=0.8,
        capsize=2.0 if mark.y_error is not None or mark.x_error is not None else 0.0,
        zorder=order,
        label=_typed(mark.name) or None,
    )


def _draw_cells(axes: Axes, mark: Cells) -> None:
    rows, columns = len(mark.rows), len(mark.columns)
    values = np.ma.masked_invalid(np.asarray(mark.colouring.values, dtype=np.float64).reshape(rows, columns))
    mapped = axes.pcolormesh(values, cmap=colour_map(mark.colouring.scale), norm=norm_of(mark.colouring))
    axes.invert_yaxis()
    axes.set_xticks(
        np.arange(columns) + 0.5, list(map(_typed, mark.columns)), rotation=40, ha="right", rotation_mode="anchor"
    )
    axes.set_yticks(np.arange(rows) + 0.5, list(map(_typed, mark.rows)))
    for i, text in enumerate(mark.texts):
        row, column = divmod(i, columns)
        shade = mapped.to_rgba(values[row, column])
        ink = CARD.light if values[row, column] is not np.ma.masked and _dark(shade) else INK_COLOUR.light
        axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", color=ink, fontsize=7.0)
    colour_bar(axes, mapped, mark.colouring.label)


def _dark(shade: FloatArray | tuple[float, ...]) -> bool:
    red, green, blue = to_rgb(tuple(np.ravel(shade)[:3].tolist()))
    return 0.299 * red + 0.587 * green + 0.114 * blue < 0.5
