"""Panels in space as plotly.js draws them."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.reporting.arrow_shapes import arrow_triangles
from palpate.reporting.figure import Space
from palpate.reporting.marks import Colouring
from palpate.reporting.solids import Arrows, Labels, Placed, Polyline, Solid, Spots, Stepped, Surface
from palpate.reporting.space_box import space_box
from palpate.reporting.traces import Json, Plot, colouring_of, named, packed, role, typed
from palpate.runtime.palette import CARD, MAP_COLOUR, PANE_COLOUR, Colour

MILLI = 1e3

TICKS = 5
"""At most so many along the longest axis of a space."""

SIZE = 1.95
"""Of the diagonal of a space, in plotly.js's unit: it fits into its panel, however it is turned."""

RIMMED = 6.0
"""Spots from this size on have a rim [px]: they stand out on every colour of a surface."""

LIGHT: Mapping[str, float] = {"ambient": 0.65, "diffuse": 0.4, "specular": 0.06, "roughness": 0.9}
"""Dull surfaces: a highlight would be taken for a value."""


def space_plot(space: Space) -> Json:
    """Return a panel in space."""
    plot = Plot([], [], {})
    for mark in space.marks:
        _add_solid(plot, mark, {})
    ranges = MILLI * space_box(space)
    sizes = np.ptp(ranges, axis=1)
    ticks = np.maximum(1 + np.rint(TICKS * sizes / sizes.max()), 2).astype(int)
    axes = {
        f"{name}axis": {"title": {"text": f"{name} [mm]"}, "range": ends, "autorange": False, "nticks": most}
        for name, ends, most in zip("xyz", ranges.tolist(), ticks.tolist(), strict=True)
    }
    aspect = SIZE * sizes / float(np.linalg.norm(sizes))
    eye = dict(zip("xyz", space.view, strict=True))
    up = {"x": 0, "y": 0, "z": 1} if abs(space.view[0]) + abs(space.view[1]) > 0.1 else {"x": 0, "y": 1, "z": 0}
    plot.layout |= {
        "scene": {
            **{
                name: axis | {"backgroundcolor": role(PANE_COLOUR), "showbackground": True}
                for name, axis in axes.items()
            },
            "aspectmode": "manual",
            "aspectratio": dict(zip("xyz", aspect.tolist(), strict=True)),
            "camera": {"eye": eye, "up": up, "projection": {"type": "orthographic"}},
        },
        "title": typed(space.title),
        "height": space.height,
    }
    return {"kind": "space", "data": plot.traces, "extras": plot.extras, "layout": plot.layout, "zoomedWith": ""}


def _add_solid(plot: Plot, mark: Solid, extra: Json) -> None:
    match mark:
        case Surface():
            trace = _mesh(mark.vertices, mark.triangles, mark.colour, mark.opacity)
            trace |= named(mark.name)
            if not mark.shown:
                trace["visible"] = "legendonly"
            if mark.colourings:
                trace["unknown"] = role(MAP_COLOUR)
            plot.add(trace, **extra, **_choices(mark.colourings))
        case Polyline():
            trace = _lined(mark.points, "lines", mark.name, shown=mark.shown) | {"hoverinfo": "skip"}
            del trace["hovertemplate"]
            trace["line"] = {"color": role(mark.colour), "width": mark.width}
            plot.add(trace, **extra, **_choices(mark.colourings))
        case Spots():
            marker = {"color": role(mark.colour), "size": mark.size, "symbol": _in_space(mark.symbol.value)}
            trace = _lined(mark.points, "markers", mark.name, shown=mark.shown) | {"marker": marker}
            if mark.size >= RIMMED:
                marker["line"] = {"color": role(CARD), "width": 1}
            if mark.texts:
                trace |= {"text": list(mark.texts), "hovertemplate": f"%{{text}}<br>{trace['hovertemplate']}"}
            plot.add(trace, **extra, **_choices(mark.colourings))
        case Arrows():
            steps = mark.starts if mark.starts.ndim == 3 else mark.starts[None]
            ways = mark.along if mark.along.ndim == 3 else mark.along[None]
            longest = float(np.linalg.norm(ways, axis=-1).max(initial=0.0))
            drawn = [arrow_triangles(*each, longest) for each in zip(steps, ways, strict=True)]
            trace = _mesh(*drawn[0], mark.colour, 1.0) | named(mark.name) | {"hoverinfo": "skip"}
            if mark.starts.ndim == 3:
                extra = extra | {"meshes": [_corners(*each) for each in drawn]}
            plot.add(trace, **extra)
        case Labels():
            trace = _lined(mark.points, "text", "")
            font = {"color": role(mark.colour), "size": 14}
            plot.add(trace | {"text": list(mark.texts), "textfont": font, "hoverinfo": "skip"}, **extra)
        case Placed():
            _add_solid(
                plot,
                mark.surface,
                {"places": packed(MILLI * mark.positions.ravel()), "turns": packed(mark.rotations.ravel())},
            )
        case Stepped():
            for step, marks in enumerate(mark.marks):
                for each in marks:
                    _add_solid(plot, each, {"step": step})


def _choices(colourings: tuple[Colouring, ...]) -> Json:
    return {"colourings": [colouring_of(each) for each in colourings]} if colourings else {}


def _in_space(symbol: str) -> str:
    """The symbol in space: plotly.js has few there."""
    return symbol if symbol in {"circle", "circle-open", "square", "diamond", "x", "cross"} else "diamond"


def _corners(vertices: FloatArray, triangles: npt.NDArray[np.integer]) -> Json:
    x, y, z = (packed(column) for column in (MILLI * vertices).T.reshape(3, -1))
    i, j, k = (packed(column) for column in np.asarray(triangles).T.reshape(3, -1))
    return {"x": x, "y": y, "z": z, "i": i, "j": j, "k": k}


def _mesh(vertices: FloatArray, triangles: npt.NDArray[np.integer], colour: Colour, opacity: float) -> Json:
    return {
        "type": "mesh3d",
        **_corners(vertices, triangles),
        "color": role(colour),
        "opacity": opacity,
        "lighting": dict(LIGHT),
        "lightposition": {"x": 2e3, "y": 3e3, "z": -6e3},  # above: plotly.js turns normals inwards
        "hovertemplate": "x %{x:.3f}<br>y %{y:.3f}<br>z %{z:.3f} mm",
    }


def _lined(points: FloatArray, mode: str, name: str, *, shown: bool = True) -> Json:
    x, y, z = (packed(column) for column in (MILLI * points).T.reshape(3, -1))
    out: Json = {"type": "scatter3d", "mode": mode, "x": x, "y": y, "z": z, **named(name)}
    out["hovertemplate"] = "x %{x:.3f}<br>y %{y:.3f}<br>z %{z:.3f} mm"
    return out if shown else out | {"visible": "legendonly"}
