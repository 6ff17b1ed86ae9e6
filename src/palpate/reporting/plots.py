"""Figures as plotly.js draws them: one plot per panel.

Colours stay roles, "role:felt" or "role:felt:0.2" with its opacity: the page inserts the reader's theme. Arrays
are base64 of little-endian numbers in single precision, finer than a screen. `page.js` switches colourings, plays
steps and zooms the times of a run together.
"""

import base64
from collections.abc import Iterator
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import (
    MIN_OPACITY,
    Band,
    Bars,
    Cells,
    Colouring,
    ColourScale,
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
)
from palpate.runtime.palette import CARD, MAP_COLOUR, PANE_COLOUR, Colour

Json = dict[str, Any]
"""A JSON object for plotly.js."""

_MAX_POINTS = 12_000
"""Maximum points of a line: enough to zoom in by ten on a wide screen."""

_FEW_DECADES = 1e3
"""Maximum ratio of the ends of a logarithmic axis with numbers at 2 and 5."""

_MILLI = 1e3

_MAX_TICKS = 5
"""Maximum ticks along the longest axis of a space."""

_DIAGONAL = 1.95
"""Diagonal of a space in plotly.js's unit: it fits into its panel in every orientation."""

_RIMMED_SIZE = 6.0
"""Minimum size of spots with a rim [px], which makes them visible on every colour of a surface."""

_LIGHT = {"ambient": 0.65, "diffuse": 0.4, "specular": 0.06, "roughness": 0.9}
"""Dull surfaces: readers would mistake a highlight for a value."""

_SPACE_SYMBOLS = {"circle", "circle-open", "square", "diamond", "x", "cross"}
"""Symbols that plotly.js has in space."""

_HOVER = "x %{x:.3f}<br>y %{y:.3f}<br>z %{z:.3f} mm"


def plots(figure: Figure) -> list[Json]:
    """Return the input of `page.js` for a figure, panel by panel."""
    return [
        _space_plot(each) if isinstance(each, Space) else _flat_plot(each, _zoomed_with(each, figure))
        for each in figure.panels
    ]


def _zoomed_with(panel: Panel, figure: Figure) -> str:
    """The group of x axes that are zoomed together: "run", "figure" or "" for none."""
    if panel.x.run_time:
        return "run"
    alike = [each for each in figure.panels if isinstance(each, Panel) and each.x == panel.x]
    return "figure" if len(alike) > 1 and figure.columns == 1 else ""


# ---------------------------------------------------------------- shared by both kinds of panels


def _packed(values: npt.ArrayLike) -> Json:
    """An array as plotly.js and `page.js` read it."""
    array = np.asarray(values)
    kind, name = ("<i4", "i4") if np.issubdtype(array.dtype, np.integer) else ("<f4", "f4")
    return {"dtype": name, "bdata": base64.b64encode(np.ascontiguousarray(array, dtype=kind).tobytes()).decode()}


def _role(colour: Colour, opacity: float = 1.0) -> str:
    return f"role:{colour.name}" if opacity >= 1.0 else f"role:{colour.name}:{opacity:g}"


def _scale(scale: ColourScale) -> list[list[object]]:
    return [[i / (len(scale.value) - 1), colour] for i, colour in enumerate(scale.value)]


def _colour_axis(colouring: Colouring, ends: str = "c") -> Json:
    """Colour scale and bar of a trace; `ends` begins the names of the scale's ends: "c" or "z"."""
    low, high = colouring.limits
    bar = {"title": {"text": colouring.label}}
    return {f"{ends}min": low, f"{ends}max": high, "colorscale": _scale(colouring.scale), "colorbar": bar}


def _plain(text: str) -> str:
    """A text in which plotly.js finds no markup."""
    return escape(text, quote=False)


def _named(name: str) -> Json:
    return {"name": _plain(name), "showlegend": bool(name)}


# ---------------------------------------------------------------- flat panels


def _flat_plot(panel: Panel, zoomed_with: str) -> Json:
    x, y = (_axis(axis, _extent(panel, i)) for i, axis in enumerate((panel.x, panel.y)))
    if panel.equal:
        y |= {"scaleanchor": "x", "scaleratio": 1.0, "constrain": "domain"}
        x |= {"constrain": "domain"}
    if any(isinstance(mark, Cells) for mark in panel.marks):
        x |= {"type": "category"}
        y |= {"type": "category", "autorange": "reversed"}
    ground = {} if panel.ground is None else {"plot_bgcolor": _role(panel.ground)}
    traced = [mark for mark in panel.marks if not isinstance(mark, Rule | Span | Text)]
    return {
        "kind": "flat",
        "data": [_trace(panel, mark) for mark in traced],
        "extras": [_moving(mark) if isinstance(mark, Moving) else {} for mark in traced],
        "layout": {
            "xaxis": x,
            "yaxis": y,
            "title": _plain(panel.title),
            "height": panel.height,
            "barmode": "overlay",
            "bargap": 0.0,
            "shapes": [_shape(mark) for mark in panel.marks if isinstance(mark, Rule | Span)],
            "annotations": [_annotation(panel, mark) for mark in panel.marks if isinstance(mark, Text)],
            **ground,
        },
        "zoomedWith": zoomed_with,
    }


def _extent(panel: Panel, axis: int) -> tuple[float, float]:
    """Smallest and largest finite number of the lines and points of a panel along an axis."""
    drawn = [(mark.x, mark.y)[axis] for mark in panel.marks if isinstance(mark, Line | Points)]
    values = np.concatenate([np.zeros(0), *(np.asarray(each, dtype=np.float64) for each in drawn)])
    known = values[np.isfinite(values)]
    return float(known.min(initial=np.inf)), float(known.max(initial=-np.inf))


def _axis(axis: Axis, extent: tuple[float, float]) -> Json:
    low, high = axis.low, axis.high
    if low is None and high is None and axis.span > 0.0 and extent[1] - extent[0] < axis.span:
        middle = 0.5 * (extent[0] + extent[1]) if np.isfinite(extent[0]) else 0.0
        low, high = middle - 0.55 * axis.span, middle + 0.55 * axis.span
    ends = [each if each is None or not axis.logarithmic else float(np.log10(each)) for each in (low, high)]
    out: Json = {"title": {"text": _plain(axis.label)}, "type": "linear"}
    if axis.logarithmic:
        least, largest = (end if known is None else known for known, end in zip((low, high), extent, strict=True))
        few = least > 0.0 and largest < _FEW_DECADES * least
        out |= {"type": "log", "nticks": 4} | ({"tickformat": "~g"} if few else {"exponentformat": "power"})
    if None not in ends:
        out |= {"range": ends, "autorange": False}
    elif ends != [None, None] and axis.logarithmic:
        out |= {"range": ends, "autorange": "max" if ends[1] is None else "min"}
    elif ends != [None, None]:  # plotly.js forgets the open end of a range when it draws again
        end, side = (low, "min") if high is None else (high, "max")
        out["autorangeoptions"] = {f"{side}allowed": end, "include": [end]}
    if axis.ticks:
        out |= {"tickvals": [at for at, _ in axis.ticks], "ticktext": [_plain(name) for _, name in axis.ticks]}
    return out


def _hover(panel: Panel) -> str:
    """Text beside the pointer; over the time of a run it lists all lines together."""
    if panel.x.run_time:
        return f"%{{y:.5~g}} {panel.y.unit}".rstrip()
    axes = (("y", panel.y), ("x", panel.x))
    numbered = ((name, axis) for name, axis in axes if axis.quantity and not axis.ticks)
    return "<br>".join(f"{_plain(axis.quantity)} %{{{name}:.5~g}} {axis.unit}".rstrip() for name, axis in numbered)


def _scatter(mode: str, x: FloatArray, y: FloatArray, name: str) -> Json:
    return {"type": "scatter", "mode": mode, "x": _packed(x), "y": _packed(y), **_named(name)}


def _trace(panel: Panel, mark: Mark) -> Json:
    """The trace of a mark that is no shape and no text."""
    match mark:
        case Line():
            colour = {"color": _role(mark.colour)}
            line = colour | {"width": mark.width, "dash": mark.dash.value}
            style = {"line": line, "marker": colour | {"size": 6}, "opacity": mark.opacity}
            mode = "lines+markers" if mark.points else "lines"
            trace = _scatter(mode, *thinned(mark, _MAX_POINTS), mark.name) | style
            return trace | {"hovertemplate": _hover(panel)}
        case Points():
            return _points(panel, mark)
        case Moving():
            trace = _points(panel, Points(mark.x[:1], mark.y[:1], mark.name, mark.colour, mark.size, Symbol.RING))
            trace["marker"]["line"] = {"width": 3, "color": _role(mark.colour)}
            return trace
        case Band():
            known = np.isfinite(mark.low) & np.isfinite(mark.high)
            x, low, high = mark.x[known], mark.low[known], mark.high[known]
            corners = np.concatenate([x, x[::-1]]), np.concatenate([high, low[::-1]])
            return _trace(panel, Polygon(*corners, mark.name, mark.colour, mark.opacity))
        case Polygon():
            fill = {"fill": "toself", "fillcolor": _role(mark.colour, mark.opacity), "line": {"width": 0}}
            return _scatter("lines", mark.x, mark.y, mark.name) | fill | {"hoverinfo": "skip"}
        case Bars():
            ends = (mark.length, mark.at) if mark.lying else (mark.at, mark.length)
            bars = {"type": "bar", "x": _packed(ends[0]), "y": _packed(ends[1]), "width": _packed(mark.width)}
            style = {"marker": {"color": _role(mark.colour)}, "hovertemplate": _hover(panel), **_named(mark.name)}
            return bars | style | ({"orientation": "h"} if mark.lying else {})
        case Cells():
            return _cells(mark)
        case Density():
            return _density(mark)
        case _:
            raise TypeError(f"{type(mark).__name__}: has no trace")


def _moving(mark: Moving) -> Json:
    return {"moving": {"x": _packed(mark.x), "y": _packed(mark.y)}}


def _annotation(panel: Panel, mark: Text) -> Json:
    places = ((mark.x, panel.x), (mark.y, panel.y))
    x, y = (float(np.log10(at)) if axis.logarithmic else at for at, axis in places)
    return {"x": x, "y": y, "text": mark.text, "showarrow": False, "font": {"color": _role(mark.colour)}}


def _points(panel: Panel, mark: Points) -> Json:
    marker: Json = {"color": _role(mark.colour), "size": mark.size, "symbol": mark.symbol.value}
    if mark.symbol is Symbol.STROKE:
        marker["line"] = {"color": _role(mark.colour), "width": 2.5}
    if mark.colouring is not None:
        marker |= _colour_axis(mark.colouring) | {"color": _packed(mark.colouring.values), "showscale": True}
    trace = _scatter("markers", mark.x, mark.y, mark.name) | {"marker": marker, "hovertemplate": _hover(panel)}
    if mark.texts:
        trace |= {"text": list(mark.texts), "hovertemplate": "%{text}<br>" + trace["hovertemplate"]}
    for name, error in (("error_x", mark.x_error), ("error_y", mark.y_error)):
        if error is not None:
            bars = {"arrayminus": _packed(error[0]), "array": _packed(error[1]), "symmetric": False}
            trace[name] = {"type": "data", **bars, "color": _role(mark.colour), "thickness": 1.4, "width": 4}
    return trace


def _shape(mark: Rule | Span) -> Json:
    across, along = ("x", "y") if mark.upright else ("y", "x")
    first, last = (mark.at, mark.at) if isinstance(mark, Rule) else (mark.low, mark.high)
    shape = {f"{across}0": first, f"{across}1": last, f"{across}ref": across, **_named(mark.name)}
    shape |= {f"{along}0": 0, f"{along}1": 1, f"{along}ref": f"{along} domain"}
    if isinstance(mark, Rule):
        line = {"color": _role(mark.colour), "width": mark.width, "dash": mark.dash.value}
        return shape | {"type": "line", "line": line}
    fill = {"line": {"width": 0}, "fillcolor": _role(mark.colour, mark.opacity)}
    return shape | {"type": "rect", "layer": "below", **fill}


def _cells(mark: Cells) -> Json:
    columns = len(mark.columns)
    values = np.asarray(mark.colouring.values, dtype=np.float64).reshape(-1, columns)
    trace: Json = {
        "type": "heatmap",
        "x": list(map(_plain, mark.columns)),
        "y": list(map(_plain, mark.rows)),
        "z": _json_rows(values),
        "hovertemplate": f"%{{y}}<br>%{{x}}<br>%{{z:.4~g}} {mark.colouring.unit}<extra></extra>",
        "xgap": 1,
        "ygap": 1,
        **_colour_axis(mark.colouring, "z"),
    }
    if mark.texts:
        rows = [list(mark.texts[i : i + columns]) for i in range(0, len(mark.texts), columns)]
        trace |= {"text": rows, "texttemplate": "%{text}"}
    return trace


def _json_rows(values: FloatArray) -> list[list[float | None]]:
    """Rows of a table, with None for NaN."""
    return [[each if np.isfinite(each) else None for each in row] for row in values.tolist()]


def _density(mark: Density) -> Json:
    return {
        "type": "heatmap",
        "x": _packed(0.5 * (mark.x[1:] + mark.x[:-1])),
        "y": _packed(0.5 * (mark.y[1:] + mark.y[:-1])),
        "z": _json_rows(mark.depth),
        "customdata": (100.0 * mark.shares).tolist(),
        "zmin": 0.0,
        "zmax": 1.0,
        "colorscale": [[0.0, _role(mark.colour, MIN_OPACITY)], [1.0, _role(mark.colour)]],
        "showscale": False,
        "hovertemplate": "%{customdata:.2~g} % of the time<extra></extra>",
        **_named(mark.name),
    }


# ---------------------------------------------------------------- panels in space


def _space_plot(space: Space) -> Json:
    ranges = _MILLI * bounding_box(space.marks)
    sizes = np.ptp(ranges, axis=1)
    ticks = np.maximum(1 + np.rint(_MAX_TICKS * sizes / sizes.max()), 2).astype(int)
    aspect = (_DIAGONAL * sizes / float(np.linalg.norm(sizes))).tolist()
    pane = {"autorange": False, "backgroundcolor": _role(PANE_COLOUR), "showbackground": True}
    axes = {
        f"{name}axis": {"title": {"text": f"{name} [mm]"}, "range": ends, "nticks": most, **pane}
        for name, ends, most in zip("xyz", ranges.tolist(), ticks.tolist(), strict=True)
    }
    from_above = abs(space.view[0]) + abs(space.view[1]) <= 0.1
    camera = {
        "eye": dict(zip("xyz", space.view, strict=True)),
        "up": dict(zip("xyz", (0, 1, 0) if from_above else (0, 0, 1), strict=True)),
        "projection": {"type": "orthographic"},
    }
    scene = {"aspectmode": "manual", "aspectratio": dict(zip("xyz", aspect, strict=True)), "camera": camera}
    drawn = list(_flattened(space.marks))
    return {
        "kind": "space",
        "data": [_solid_trace(mark) for mark, _ in drawn],
        "extras": [extra | _choices(mark) for mark, extra in drawn],
        "layout": {"scene": axes | scene, "title": _plain(space.title), "height": space.height},
        "zoomedWith": "",
    }


def _flattened(marks: tuple[Solid, ...]) -> "Iterator[tuple[Surface | Polyline | Spots | Arrows | Labels, Json]]":
    """Marks with a trace each, and how `page.js` moves them from step to step."""
    for mark in marks:
        if isinstance(mark, Stepped):
            yield from ((each, {"step": step}) for step, shown in enumerate(mark.marks) for each in shown)
        elif isinstance(mark, Placed):
            places, turns = _packed(_MILLI * mark.positions.ravel()), _packed(mark.rotations.ravel())
            yield mark.surface, {"places": places, "turns": turns}
        elif isinstance(mark, Arrows) and mark.starts.ndim == 3:
            yield mark, {"meshes": [_corners(*each) for each in _arrow_meshes(mark)]}
        else:
            yield mark, {}


def _choices(mark: Surface | Polyline | Spots | Arrows | Labels) -> Json:
    """Colourings as `page.js` reads them."""
    if not isinstance(mark, Surface | Polyline | Spots) or not mark.colourings:
        return {}
    return {
        "colourings": [
            {
                "quantity": each.quantity,
                "label": each.label,
                "unit": each.unit,
                "values": _packed(each.values),
                "low": each.limits[0],
                "high": each.limits[1],
                "scale": _scale(each.scale),
            }
            for each in mark.colourings
        ]
    }


def _arrow_meshes(mark: Arrows) -> list[tuple[FloatArray, npt.NDArray[np.int32]]]:
    """Vertices and triangles of the arrows in each step."""
    starts, along = (each.reshape(-1, *each.shape[-2:]) for each in (mark.starts, mark.along))
    longest = float(np.linalg.norm(along, axis=-1).max(initial=0.0))
    return [arrow_triangles(*each, longest) for each in zip(starts, along, strict=True)]


def _solid_trace(mark: Surface | Polyline | Spots | Arrows | Labels) -> Json:
    colour = {"color": _role(mark.colour)}
    hidden = {} if getattr(mark, "shown", True) else {"visible": "legendonly"}
    match mark:
        case Arrows():
            mesh = _mesh(*_arrow_meshes(mark)[0], mark.colour, 1.0)
            return mesh | _named(mark.name) | {"hoverinfo": "skip"}
        case Labels():
            words = {"text": list(mark.texts), "textfont": colour | {"size": 14}, "hoverinfo": "skip"}
            return _lined(mark.points, "text", "") | words | {"hovertemplate": _HOVER}
        case Surface():
            unknown = {"unknown": _role(MAP_COLOUR)} if mark.colourings else {}
            mesh = _mesh(mark.vertices, mark.triangles, mark.colour, mark.opacity)
            return mesh | _named(mark.name) | unknown | hidden
        case Polyline():
            line = {"line": colour | {"width": mark.width}, "hoverinfo": "skip"}
            return _lined(mark.points, "lines", mark.name) | line | hidden
        case Spots():
            symbol = mark.symbol.value if mark.symbol.value in _SPACE_SYMBOLS else "diamond"
            rim = {"line": {"color": _role(CARD), "width": 1}} if mark.size >= _RIMMED_SIZE else {}
            marker = {"marker": colour | {"size": mark.size, "symbol": symbol} | rim, "hovertemplate": _HOVER}
            texts = {"text": list(mark.texts), "hovertemplate": f"%{{text}}<br>{_HOVER}"} if mark.texts else {}
            return _lined(mark.points, "markers", mark.name) | marker | texts | hidden


def _corners(vertices: FloatArray, triangles: npt.NDArray[np.integer]) -> Json:
    columns = (*(_MILLI * vertices).T.reshape(3, -1), *np.asarray(triangles).T.reshape(3, -1))
    return dict(zip("xyzijk", map(_packed, columns), strict=True))


def _mesh(vertices: FloatArray, triangles: npt.NDArray[np.integer], colour: Colour, opacity: float) -> Json:
    return {
        "type": "mesh3d",
        **_corners(vertices, triangles),
        "color": _role(colour),
        "opacity": opacity,
        "lighting": dict(_LIGHT),
        "lightposition": {"x": 2e3, "y": 3e3, "z": -6e3},  # above: plotly.js turns normals inwards
        "hovertemplate": _HOVER,
    }


def _lined(points: FloatArray, mode: str, name: str) -> Json:
    columns = map(_packed, (_MILLI * points).T.reshape(3, -1))
    places = dict(zip("xyz", columns, strict=True))
    return {"type": "scatter3d", "mode": mode, **places, **_named(name)}
