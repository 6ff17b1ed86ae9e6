"""Figures as a paper prints them: vectors in the width of a column or of the page, without title and caption.

Fonts are embedded as publishers accept them (TrueType, `pdf.fonttype` 42); marks with many thousand elements are
kept as pixels. Widths are those of IEEE's journals (IEEE author guidelines: 3.5 and 7.16 inch).
"""

import io
import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain, count
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize, to_rgb
from matplotlib.figure import Figure as PaperFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import MaxNLocator, NullFormatter
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # type: ignore[import-untyped]

from palpate.atomic_file import replacing
from palpate.errors import FloatArray, InvalidValueError
from palpate.reporting.figure import Figure, Panel, Space
from palpate.reporting.marks import (
    MIN_OPACITY,
    Band,
    Bars,
    Cells,
    Colouring,
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
    thinned,
)
from palpate.reporting.report import FigureFailure
from palpate.reporting.solids import (
    Arrows,
    Labels,
    Placed,
    Polyline,
    Solid,
    Spots,
    Stepped,
    Surface,
    arrow_triangles,
    bounding_box,
    coloured_by,
    quantities,
)
from palpate.runtime.palette import CARD, GRID_COLOUR, INK_COLOUR, MAP_COLOUR, PANE_COLOUR

_COLUMN, _PAGE = 3.5, 7.16
"""Width of a column and of the page [inch]."""

_INCH_PER_PIXEL = 0.0082
"""Height on paper per height on a screen [inch/px]."""

_STYLE = {
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

_DATES = {"pdf": "CreationDate", "svg": "Date", "png": None}
"""Kinds of files, and their metadata that would make equal figures differ."""

_MAX_POINTS = 3000
"""Maximum points of a line: the resolution of a printer."""

_LETTERS_PER_INCH = 21
"""Letters of a legend per inch, with the lines before them."""

_HANDLE = 7
"""Width of the line before a name, in letters."""

_DASHES = {Dash.SOLID: "-", Dash.DASHED: (0, (5, 3)), Dash.DOTTED: ":", Dash.DASH_DOT: (0, (6, 2, 1, 2))}
_SYMBOLS = dict(zip(Symbol, "oosDxP^_", strict=True))
_SPACE_SYMBOLS = {Symbol.CROSS: "x", Symbol.SQUARE: "s", Symbol.DIAMOND: "D"}

_POINT = 0.6
"""Width of a line or a point in print per width on a screen [points/px]."""

_MILLI = 1e3

_Style = dict[str, Any]
"""Keyword arguments of matplotlib."""

_LIGHT = np.array([-0.35, -0.45, 0.82])
"""Direction to the light, of unit length within a percent."""

_AMBIENT = 0.62
"""Brightness of a face turned away from the light."""


def write_figure_files(
    figure: Figure, folder: Path, kind: str, taken: set[str]
) -> tuple[Path | FigureFailure, ...]:
    """Write a figure into a folder, one file for each of its colourings.

    Args:
        figure: The figure.
        folder: An existing folder.
        kind: "pdf", "svg" or "png".
        taken: Names of files that exist already, without suffix; those of the new files are added.

    Returns:
        The files, with a failure in the place of each that could not be drawn.

    Raises:
        InvalidValueError: If the kind is another one.
        OSError: If a file cannot be written.
    """
    written: list[Path | FigureFailure] = []
    for title, single in _by_colouring(figure):
        name = "-".join("".join(each if each.isalnum() else " " for each in title.lower()).split()) or "figure"
        free = next(each for each in chain([name], (f"{name}-{i}" for i in count(2))) if each not in taken)
        taken.add(free)
        path = folder / f"{free}.{kind}"
        try:
            content = _file_content(single, kind)
        except Exception as error:
            written.append(FigureFailure.of(figure.title, error))
            continue
        with replacing(path) as file:
            file.write(content)
        written.append(path)
    return tuple(written)


def write_figure(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write a figure as a .pdf, .svg or .png file; equal figures give equal files.

    Raises:
        InvalidValueError: If the suffix is another one.
        OSError: If the file cannot be written.
    """
    kind = Path(path).suffix.removeprefix(".")
    if kind not in _DATES:
        raise InvalidValueError(f"{path}: its suffix must be one of {', '.join('.' + each for each in _DATES)}")
    content = _file_content(figure, kind)
    with replacing(path) as file:
        file.write(content)


def svg_text(figure: Figure) -> str:
    """Return a figure as an SVG document."""
    return _file_content(figure, "svg").decode("utf-8")


def _file_content(figure: Figure, kind: str) -> bytes:
    content, date = io.BytesIO(), _DATES[kind]
    with printing():
        paper_figure(figure).savefig(content, format=kind, metadata={} if date is None else {date: None})
    return content.getvalue()


@contextmanager
def printing() -> Iterator[None]:
    """Set matplotlib's style to that of a paper within the context."""
    with mpl.rc_context(_STYLE):  # type: ignore[arg-type]
        yield


def paper_figure(figure: Figure) -> PaperFigure:
    """Return a figure as a matplotlib figure; one with steps shows its first step."""
    columns = figure.columns
    heights = [
        max(each.height for each in figure.panels[first : first + columns])
        for first in range(0, len(figure.panels), columns)
    ]
    size = (_PAGE if figure.wide else _COLUMN, _INCH_PER_PIXEL * sum(heights))
    drawn = PaperFigure(figsize=size, layout=ConstrainedLayoutEngine(w_pad=0.02, h_pad=0.02))
    grid = drawn.add_gridspec(len(heights), columns, height_ratios=heights)
    for i, panel in enumerate(figure.panels):
        place = grid[divmod(i, columns)]
        if isinstance(panel, Space):
            _draw_space(drawn.add_subplot(place, projection="3d", computed_zorder=False), panel, figure.step)
        else:
            _draw_panel(drawn.add_subplot(place), panel, figure.step)
    return drawn


def _by_colouring(figure: Figure) -> Iterator[tuple[str, Figure]]:
    """Each colouring of a figure as a figure of its own, with its title."""
    spaces = (each for each in figure.panels if isinstance(each, Space))
    choices = [found for found in (quantities(each.marks) for each in spaces) if len(found) > 1]
    for quantity in dict.fromkeys(chain(*choices)):
        panels = tuple(
            replace(each, marks=coloured_by(each.marks, quantity))
            if isinstance(each, Space) and quantity in quantities(each.marks)
            else each
            for each in figure.panels
        )
        yield f"{figure.title} {quantity}", replace(figure, panels=panels)
    if not choices:
        yield figure.title, figure


# ---------------------------------------------------------------- colours


def _colour_scale(colouring: Colouring) -> _Style:
    colours = LinearSegmentedColormap.from_list(colouring.scale.name, list(colouring.scale.value))
    return {"norm": Normalize(*colouring.limits), "cmap": colours}


def _colour_bar(axes: Axes, mapped: ScalarMappable, label: str) -> None:
    figure = axes.get_figure()
    assert figure is not None
    bar = figure.colorbar(mapped, ax=axes, location="bottom", aspect=30, shrink=0.8, pad=0.02)
    bar.set_label(label)
    bar.outline.set_visible(False)


# ---------------------------------------------------------------- flat panels


def _draw_panel(axes: Axes, panel: Panel, step: int) -> None:
    for axis, set_scale in ((panel.x, axes.set_xscale), (panel.y, axes.set_yscale)):
        if axis.logarithmic:
            set_scale("log")
    for order, mark in enumerate(panel.marks):
        _draw(axes, mark, step, 2.0 + 0.01 * order)
    axes.set(xlabel=_plain(panel.x.label), ylabel=_plain(panel.y.label))
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
        axes.set_title(_plain(panel.title), fontsize=8.0, loc="left")
        return
    axes.legend(
        list(entries.values()),
        list(entries),
        title=_plain(panel.title) or None,
        title_fontsize=8.0,
        alignment="left",
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=_legend_columns(axes, list(entries)),
        frameon=False,
        borderpad=0.2,
        handlelength=1.6,
    )


def _legend_columns(axes: Axes, names: Sequence[str]) -> int:
    """Most columns of a legend that fit above its axes; matplotlib fills one after the other."""
    figure = axes.get_figure()
    assert figure is not None
    room = _LETTERS_PER_INCH * axes.get_position().width * figure.get_size_inches()[0]  # type: ignore[union-attr]
    for columns in range(len(names), 1, -1):
        parts = np.array_split(np.arange(len(names)), columns)
        if sum(_HANDLE + max(len(names[i]) for i in part) for part in parts) <= room:
            return columns
    return 1


def _plain(text: str) -> str:
    """A text in which matplotlib finds no formula."""
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
            drawn.set_ticks([at for at, _ in axis.ticks], labels=[_plain(name) for _, name in axis.ticks])
            drawn.set_minor_formatter(NullFormatter())


def _draw(axes: Axes, mark: Mark, step: int, order: float) -> None:
    if isinstance(mark, Cells):
        _draw_cells(axes, mark)
        return
    colour = mark.colour.light
    style: _Style = {"color": colour, "label": _plain(getattr(mark, "name", "")) or None, "zorder": order}
    dashed: _Style = {}
    filled: _Style = {}
    if isinstance(mark, Line | Rule):
        dashed = {"linewidth": _POINT * mark.width, "linestyle": _DASHES[mark.dash]}
    elif isinstance(mark, Band | Polygon | Span):
        filled = {"alpha": mark.opacity, "linewidth": 0.0}
    match mark:
        case Line():
            dots: _Style = {"marker": "o" if mark.points else None, "markersize": 2.5}
            axes.plot(*thinned(mark, _MAX_POINTS), alpha=mark.opacity, **style, **dashed, **dots)
        case Points():
            _draw_points(axes, mark, order)
        case Moving():
            now = slice(step, step + 1)
            ring = Points(mark.x[now], mark.y[now], mark.name, mark.colour, mark.size, Symbol.RING)
            _draw_points(axes, ring, order)
        case Band():
            axes.fill_between(mark.x, mark.low, mark.high, **style, **filled)
        case Polygon():
            axes.fill(mark.x, mark.y, **style, **filled)
        case Bars():
            (axes.barh if mark.lying else axes.bar)(mark.at, mark.length, mark.width, **style)
        case Rule():
            (axes.axvline if mark.upright else axes.axhline)(mark.at, **style, **dashed)
        case Span():
            strip = axes.axvspan if mark.upright else axes.axhspan
            strip(mark.low, mark.high, **style | filled | {"zorder": 0.5})
        case Text():
            axes.text(mark.x, mark.y, mark.text, color=colour, ha="center", va="center", zorder=order)
        case Density():
            shades = LinearSegmentedColormap.from_list(
                "", [(*to_rgb(colour), MIN_OPACITY), (*to_rgb(colour), 1.0)]
            )
            depth = np.ma.masked_invalid(mark.depth)
            axes.pcolormesh(mark.x, mark.y, depth, cmap=shades, zorder=order, rasterized=True)
            axes.scatter([], [], marker="s", color=colour, label=style["label"])  # the mesh has no legend entry


def _draw_points(axes: Axes, mark: Points, order: float) -> None:
    if mark.colouring is not None:
        style = _colour_scale(mark.colouring) | {"c": mark.colouring.values, "s": (_POINT * mark.size) ** 2}
        dots = axes.scatter(mark.x, mark.y, linewidths=0.0, rasterized=True, zorder=order, **style)
        _colour_bar(axes, dots, mark.colouring.label)
        return
    axes.errorbar(
        mark.x,
        mark.y,
        xerr=mark.x_error,
        yerr=mark.y_error,
        fmt=_SYMBOLS[mark.symbol],
        color=mark.colour.light,
        markerfacecolor="none" if mark.symbol is Symbol.RING else mark.colour.light,
        markersize=_POINT * mark.size,
        elinewidth=0.8,
        capsize=2.0 if mark.y_error is not None or mark.x_error is not None else 0.0,
        zorder=order,
        label=_plain(mark.name) or None,
    )


def _draw_cells(axes: Axes, mark: Cells) -> None:
    rows, columns = len(mark.rows), len(mark.columns)
    values = np.ma.masked_invalid(np.asarray(mark.colouring.values, dtype=np.float64).reshape(rows, columns))
    mapped = axes.pcolormesh(values, **_colour_scale(mark.colouring))
    axes.invert_yaxis()
    names = list(map(_plain, mark.columns))
    axes.set_xticks(np.arange(columns) + 0.5, names, rotation=40, ha="right", rotation_mode="anchor")
    axes.set_yticks(np.arange(rows) + 0.5, list(map(_plain, mark.rows)))
    for i, text in enumerate(mark.texts):
        row, column = divmod(i, columns)
        value = values[row, column]
        dark = value is not np.ma.masked and np.dot([0.299, 0.587, 0.114], mapped.to_rgba(value)[:3]) < 0.5
        ink = CARD if dark else INK_COLOUR
        axes.text(column + 0.5, row + 0.5, text, ha="center", va="center", color=ink.light, fontsize=7.0)
    _colour_bar(axes, mapped, mark.colouring.label)


# ---------------------------------------------------------------- panels in space


def _draw_space(axes: Axes3D, space: Space, step: int) -> None:
    first = quantities(space.marks)[:1]
    marks = [each for mark in coloured_by(space.marks, *first or ("",)) for each in _shown(mark, step)]
    for order, mark in enumerate(marks):
        _draw_solid(axes, mark, float(order))
    box = _MILLI * bounding_box(space.marks)
    size = np.ptp(box, axis=1)
    for axis, ends, s, name in zip((axes.xaxis, axes.yaxis, axes.zaxis), box, size, "xyz", strict=True):
        axis.set_view_interval(*ends, ignore=True)
        axis.set_label_text(f"{name} [mm]")
        axis.set_pane_color(PANE_COLOUR.light)
        axis.set_major_locator(MaxNLocator(nbins=max(1, round(5.0 * s / float(size.max())))))
    axes.set_box_aspect(tuple(size), zoom=0.95)
    x, y, z = space.view
    axes.view_init(elev=float(np.degrees(np.arctan2(z, np.hypot(x, y)))), azim=float(np.degrees(np.arctan2(y, x))))
    if space.title:
        axes.set_title(space.title, fontsize=8.0, loc="left")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(loc="upper left", frameon=False, borderpad=0.2)


def _shown(mark: Solid, step: int) -> Sequence[Surface | Polyline | Spots | Arrows | Labels]:
    if isinstance(mark, Stepped):
        return mark.marks[step]
    if isinstance(mark, Placed):
        return [mark.at(step)]
    if isinstance(mark, Arrows) and mark.starts.ndim == 3:
        return [replace(mark, starts=mark.starts[step], along=mark.along[step])]
    return [mark] if getattr(mark, "shown", True) else []


def _draw_solid(axes: Axes3D, mark: Surface | Polyline | Spots | Arrows | Labels, order: float) -> None:
    if isinstance(mark, Labels):
        for point, text in zip(_MILLI * mark.points, mark.texts, strict=True):
            axes.text(*point, text, color=mark.colour.light, zorder=order)
        return
    style: _Style = {"zorder": order, "label": mark.name or None}
    match mark:
        case Surface():
            _draw_surface(axes, mark, style)
        case Polyline():
            _draw_path(axes, mark, style | {"linewidth": 0.5 * mark.width})
        case Spots():
            _draw_spots(axes, mark, style)
        case Arrows():
            longest = float(np.linalg.norm(mark.along, axis=1).max(initial=0.0))
            vertices, triangles = arrow_triangles(mark.starts, mark.along, longest)
            if len(triangles):
                corners = vertices[triangles]
                faces = _lit(corners, np.array(to_rgb(mark.colour.light)))
                axes.add_collection3d(Poly3DCollection(_MILLI * corners, facecolors=faces, **style))


def _draw_path(axes: Axes3D, mark: Polyline, style: _Style) -> None:
    points = _MILLI * mark.points
    if not mark.colourings:
        axes.plot(*points.T, color=mark.colour.light, **style)
        return
    colouring = mark.colourings[0]
    parts = np.stack([points[:-1], points[1:]], axis=1)
    scale = _colour_scale(colouring) | {"array": colouring.values[:-1]}
    line = Line3DCollection(parts, rasterized=True, **style, **scale)
    axes.add_collection3d(line)
    _colour_bar(axes, line, colouring.label)


def _draw_spots(axes: Axes3D, mark: Spots, style: _Style) -> None:
    size, symbol = (0.7 * mark.size) ** 2, _SPACE_SYMBOLS.get(mark.symbol, "o")
    style = style | {"s": size, "marker": symbol, "linewidths": 0.6, "depthshade": False}
    if not mark.colourings:
        axes.scatter(*(_MILLI * mark.points).T, color=mark.colour.light, **style)
        return
    colouring = mark.colourings[0]
    scale = _colour_scale(colouring) | {"c": colouring.values, "rasterized": True}
    dots = axes.scatter(*(_MILLI * mark.points).T, **style, **scale)
    _colour_bar(axes, dots, colouring.label)


def _draw_surface(axes: Axes3D, mark: Surface, style: _Style) -> None:
    corners = mark.vertices[mark.triangles]
    colours: npt.NDArray[np.float64] = np.tile(to_rgb(mark.colour.light), (len(corners), 1))
    if mark.colourings:
        colouring = mark.colourings[0]
        mapped = ScalarMappable(**_colour_scale(colouring))
        value = colouring.values[mark.triangles].mean(axis=1)
        colours = np.where(np.isfinite(value)[:, None], mapped.to_rgba(value)[:, :3], to_rgb(MAP_COLOUR.light))
        _colour_bar(axes, mapped, colouring.label)
    faces = _lit(corners, colours)
    # edges in the colour of the face close the hairlines between opaque neighbours
    edges = {"edgecolors": faces, "linewidths": 0.2 if mark.opacity == 1.0 else 0.0}
    drawn = Poly3DCollection(_MILLI * corners, facecolors=faces, alpha=mark.opacity, **edges, **style)
    drawn.set_rasterized(True)
    axes.add_collection3d(drawn)


def _lit(corners: FloatArray, colours: FloatArray) -> FloatArray:
    """Colours of faces, lit from either side: meshes do not agree on the order of corners."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    lit = np.minimum(np.abs(normal @ _LIGHT) / np.where(length > 0.0, length, 1.0), 1.0)
    return np.asarray(colours * (_AMBIENT + (1.0 - _AMBIENT) * lit)[:, None])
