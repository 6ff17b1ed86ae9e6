"""Pictures as a paper prints them: vectors in the width of a column or of the page, without title and caption.

Fonts are embedded as publishers accept them (TrueType, `pdf.fonttype` 42); what has many thousand elements
is kept as pixels. Widths are those of IEEE's journals (IEEE author guidelines: 3.5 and 7.16 inch).
"""

import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]

from palpate.atomic_file import replacing
from palpate.errors import FloatArray, InvalidValueError
from palpate.reporting.envelope import thinned
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
    Region,
    Rule,
    Span,
    Symbol,
    Text,
)
from palpate.reporting.paper_colours import colour_bar, colour_map, norm_of
from palpate.reporting.paper_space import draw_space
from palpate.reporting.picture import Panel, Picture, Space
from palpate.reporting.report import Pictures, Report
from palpate.reporting.solids import coloured_by, quantities
from palpate.runtime.palette import GRID_COLOUR, INK_COLOUR

COLUMN, PAGE = 3.5, 7.16
"""Width of a column and of the page [inch]."""

PER_PIXEL = 0.0082
"""[inch] of height for each pixel that a panel is high on a screen."""

MOST_POINTS = 3000
"""Of a line: what a printer resolves."""

STYLE = {
    "font.size": 8.0,
    "axes.labelsize": 8.0,
    "legend.fontsize": 7.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "palpate",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.6,
    "axes.edgecolor": INK_COLOUR.light,
    "savefig.dpi": 300,
}

KINDS = ("pdf", "svg", "png")
"""Of files."""

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


def write_pictures(report: Report, folder: Path, kind: str) -> tuple[Path, ...]:
    """Write each picture of a report into a folder, one file for each of its colourings.

    Args:
        report: Whose pictures.
        folder: Which is there.
        kind: "pdf", "svg" or "png".

    Returns:
        The files.

    Raises:
        InvalidValueError: Another kind.
        OSError: A file cannot be written.
    """
    parts = (part for section in report.sections for part in section.parts if isinstance(part, Pictures))
    names: set[str] = set()
    written = []
    for picture in (each for part in parts for each in part.draw() if each is not None):
        for name, single in _by_colouring(picture):
            numbered = next(n for n in _numbered(_file_name(name)) if n not in names)
            names.add(numbered)
            path = folder / f"{numbered}.{kind}"
            write_picture(single, path)
            written.append(path)
    return tuple(written)


def write_picture(picture: Picture, path: str | os.PathLike[str]) -> None:
    """Write a picture as the suffix says: .pdf, .svg or .png; the same picture gives the same file.

    Raises:
        InvalidValueError: Another suffix.
        OSError: The file cannot be written.
    """
    kind = Path(path).suffix.removeprefix(".")
    if kind not in KINDS:
        raise InvalidValueError(f"{path}: its suffix must be one of {', '.join('.' + each for each in KINDS)}")
    dated = {} if kind == "png" else {"CreationDate" if kind == "pdf" else "Date": None}
    with printing(), replacing(path) as file:
        paper_figure(picture).savefig(file, format=kind, metadata=dated)


def svg_text(picture: Picture) -> str:
    """Return a picture as an SVG document."""
    text = io.StringIO()
    with printing():
        paper_figure(picture).savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


@contextmanager
def printing() -> Iterator[None]:
    """Have matplotlib draw in the style of a paper."""
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        yield


def paper_figure(picture: Picture) -> Figure:
    """Return a picture as matplotlib's figure; of what moves, the step that is shown first."""
    rows = -(-len(picture.panels) // picture.columns)
    heights = [
        max(each.height for each in picture.panels[i * picture.columns : (i + 1) * picture.columns])
        for i in range(rows)
    ]
    size = (PAGE if picture.wide else COLUMN, PER_PIXEL * sum(heights))
    figure = Figure(figsize=size, layout=ConstrainedLayoutEngine(w_pad=0.02, h_pad=0.02))
    grid = figure.add_gridspec(rows, picture.columns, height_ratios=heights)
    for i, panel in enumerate(picture.panels):
        place = grid[divmod(i, picture.columns)]
        if isinstance(panel, Space):
            axes: Axes3D = figure.add_subplot(place, projection="3d", computed_zorder=False)
            draw_space(axes, panel, picture.step)
        else:
            _draw_panel(figure.add_subplot(place), panel, picture.step)
    return figure


def _by_colouring(picture: Picture) -> Iterator[tuple[str, Picture]]:
    """Each colouring of a picture with a name, as a picture of its own."""
    spaces = (each for each in picture.panels if isinstance(each, Space))
    choices = [found for found in (quantities(each.marks) for each in spaces) if len(found) > 1]
    for quantity in dict.fromkeys(chain(*choices)):
        panels = tuple(_coloured(each, quantity) if isinstance(each, Space) else each for each in picture.panels)
        yield f"{picture.title} {quantity}", replace(picture, panels=panels)
    if not choices:
        yield picture.title, picture


def _coloured(space: Space, quantity: str) -> Space:
    """A space coloured by a quantity, if any of its marks has it."""
    if quantity not in quantities(space.marks):
        return space
    return replace(space, marks=coloured_by(space.marks, quantity))


def _file_name(title: str) -> str:
    words = "".join(each if each.isalnum() else " " for each in title.lower()).split()
    return "-".join(words) or "picture"


def _numbered(name: str) -> Iterator[str]:
    yield name
    number = 2
    while True:
        yield f"{name}-{number}"
        number += 1


def _draw_panel(axes: Axes, panel: Panel, step: int) -> None:
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
            ncols=4 if axes.get_figure().get_size_inches()[0] > COLUMN else 3,  # type: ignore[union-attr]
            frameon=False,
            borderpad=0.2,
            handlelength=1.6,
        )


def _typed(text: str) -> str:
    """Text that people may have typed, in which nothing is a formula."""
    return text.replace("$", r"\$")


def _limit(axes: Axes, panel: Panel) -> None:
    for axis, get, put, ticks in (
        (panel.x, axes.get_xlim, axes.set_xlim, axes.set_xticks),
        (panel.y, axes.get_ylim, axes.set_ylim, axes.set_yticks),
    ):
        low, high = get()
        if axis.low is None and axis.high is None and abs(high - low) < axis.span:
            low, high = 0.5 * (low + high - axis.span), 0.5 * (low + high + axis.span)
        put(low if axis.low is None else axis.low, high if axis.high is None else axis.high)
        if axis.ticks:
            ticks([at for at, _ in axis.ticks], [_typed(name) for _, name in axis.ticks])


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
        case Region():
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
            axes.pcolormesh(mark.x, mark.y, depth, cmap=shades, zorder=order, label=name, rasterized=True)


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
        ink = "#ffffff" if values[row, column] is not np.ma.masked and _dark(shade) else INK_COLOUR.light
        axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", color=ink, fontsize=7.0)
    colour_bar(axes, mapped, mark.colouring.label)


def _dark(shade: FloatArray | tuple[float, ...]) -> bool:
    red, green, blue = to_rgb(tuple(np.ravel(shade)[:3].tolist()))
    return 0.299 * red + 0.587 * green + 0.114 * blue < 0.5
