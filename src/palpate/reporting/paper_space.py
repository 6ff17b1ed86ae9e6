"""A panel in space as matplotlib draws it."""

import numpy as np
import numpy.typing as npt
from matplotlib.cm import ScalarMappable
from matplotlib.colors import to_rgb
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d import Axes3D  # type: ignore[import-untyped]
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection  # type: ignore[import-untyped]

from palpate.errors import FloatArray
from palpate.reporting.arrow_shapes import arrow_triangles
from palpate.reporting.figure import Space
from palpate.reporting.marks import Symbol
from palpate.reporting.paper_colours import colour_bar, colour_map, norm_of
from palpate.reporting.solids import (
    Arrows,
    Labels,
    Placed,
    Polyline,
    Solid,
    Spots,
    Stepped,
    Surface,
    coloured_by,
    quantities,
)
from palpate.reporting.space_box import space_box
from palpate.runtime.palette import MAP_COLOUR, PANE_COLOUR

MILLI = 1e3

LIGHT = np.array([-0.35, -0.45, 0.82])
"""Direction to the light, of unit length within a percent."""

AMBIENT = 0.62
"""Share of a colour that is left on a face turned away from the light."""


def draw_space(axes: Axes3D, space: Space, step: int) -> None:
    """Draw a panel in space; of what moves, that step."""
    first = quantities(space.marks)[:1]
    marks = [each for mark in coloured_by(space.marks, *first or ("",)) for each in _shown(mark, step)]
    for order, mark in enumerate(marks):
        _draw(axes, mark, float(order))
    box = MILLI * space_box(space)
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


def _shown(mark: Solid, step: int) -> "list[Surface | Polyline | Spots | Arrows | Labels]":
    if isinstance(mark, Stepped):
        return list(mark.marks[step])
    if isinstance(mark, Placed):
        return [mark.at(step)]
    if isinstance(mark, Arrows) and mark.starts.ndim == 3:
        return [Arrows(mark.starts[step], mark.along[step], mark.name, mark.colour)]
    return [mark] if getattr(mark, "shown", True) else []


def _draw(axes: Axes3D, mark: Surface | Polyline | Spots | Arrows | Labels, order: float) -> None:
    match mark:
        case Surface():
            _draw_surface(axes, mark, order)
        case Polyline():
            _draw_path(axes, mark, order)
        case Spots():
            _draw_spots(axes, mark, order)
        case Arrows():
            longest = float(np.linalg.norm(mark.along, axis=1).max(initial=0.0))
            vertices, triangles = arrow_triangles(mark.starts, mark.along, longest)
            if len(triangles):
                faces = _lit(vertices[triangles], np.array(to_rgb(mark.colour.light)))
                axes.add_collection3d(
                    Poly3DCollection(
                        MILLI * vertices[triangles], facecolors=faces, zorder=order, label=mark.name or None
                    )
                )
        case Labels():
            for point, text in zip(MILLI * mark.points, mark.texts, strict=True):
                axes.text(*point, text, color=mark.colour.light, zorder=order)


def _draw_path(axes: Axes3D, mark: Polyline, order: float) -> None:
    points = MILLI * mark.points
    name, width = mark.name or None, 0.5 * mark.width
    if not mark.colourings:
        axes.plot(*points.T, color=mark.colour.light, linewidth=width, zorder=order, label=name)
        return
    colouring = mark.colourings[0]
    parts = np.stack([points[:-1], points[1:]], axis=1)
    scale = {"cmap": colour_map(colouring.scale), "norm": norm_of(colouring), "array": colouring.values[:-1]}
    line = Line3DCollection(parts, rasterized=True, linewidth=width, zorder=order, label=name, **scale)
    axes.add_collection3d(line)
    colour_bar(axes, line, colouring.label)


def _draw_spots(axes: Axes3D, mark: Spots, order: float) -> None:
    x, y, z = (MILLI * mark.points).T
    style: dict[str, object] = {"s": (0.7 * mark.size) ** 2, "linewidths": 0.6, "zorder": order}
    style |= {"depthshade": False}
    style["marker"] = {Symbol.CROSS: "x", Symbol.SQUARE: "s", Symbol.DIAMOND: "D"}.get(mark.symbol, "o")
    if not mark.colourings:
        axes.scatter(x, y, z, color=mark.colour.light, label=mark.name or None, **style)
        return
    colouring = mark.colourings[0]
    scale = {"c": colouring.values, "cmap": colour_map(colouring.scale), "norm": norm_of(colouring)}
    dots = axes.scatter(x, y, z, label=mark.name or None, rasterized=True, **scale, **style)
    colour_bar(axes, dots, colouring.label)


def _draw_surface(axes: Axes3D, mark: Surface, order: float) -> None:
    corners = mark.vertices[mark.triangles]
    colours: npt.NDArray[np.float64] = np.tile(to_rgb(mark.colour.light), (len(corners), 1))
    if mark.colourings:
        colouring = mark.colourings[0]
        mapped = ScalarMappable(norm_of(colouring), colour_map(colouring.scale))
        value = colouring.values[mark.triangles].mean(axis=1)
        colours = np.where(np.isfinite(value)[:, None], mapped.to_rgba(value)[:, :3], to_rgb(MAP_COLOUR.light))
        colour_bar(axes, mapped, colouring.label)
    faces = _lit(corners, colours)
    # edges in the colour of the face close the hairlines between neighbours; of what is seen through, they show
    drawn = Poly3DCollection(
        MILLI * corners,
        facecolors=faces,
        edgecolors=faces,
        linewidths=0.2 if mark.opacity == 1.0 else 0.0,
        alpha=mark.opacity,
        zorder=order,
        label=mark.name or None,
    )
    drawn.set_rasterized(True)
    axes.add_collection3d(drawn)


def _lit(corners: FloatArray, colours: FloatArray) -> FloatArray:
    """Colours of faces, lit from either side: meshes do not agree on the order of corners."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normal, axis=1)
    lit = np.minimum(np.abs(normal @ LIGHT) / np.where(length > 0.0, length, 1.0), 1.0)
    return np.asarray(colours * (AMBIENT + (1.0 - AMBIENT) * lit)[:, None])
