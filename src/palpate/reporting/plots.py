"""Pictures as plotly.js draws them: one plot per panel.

Colours stay roles, "role:felt" or "role:felt:0.2" with its opacity: the page puts the reader's theme in, and does
what plotly.js cannot (`page.js`): switching colourings, playing steps, zooming the times of a run together.
Arrays are base64 of little-endian numbers; single precision is finer than a screen.
"""

import base64
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.reporting.arrow_shapes import arrow_triangles
from palpate.reporting.colour_scales import ANCHORS
from palpate.reporting.envelope import thinned
from palpate.reporting.marks import (
    FAINTEST,
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
    Region,
    Rule,
    Span,
    Text,
    finite_limits,
)
from palpate.reporting.picture import Axis, Panel, Picture, Space
from palpate.reporting.solids import Arrows, Labels, Path, Placed, Solid, Spots, Stepped, Surface
from palpate.reporting.space_box import space_box
from palpate.runtime.palette import CARD, MAP_COLOUR, PANE_COLOUR, Colour

MOST_POINTS = 12_000
"""Of a line: enough to zoom in by ten on a wide screen."""

FEW_DECADES = 1e3
"""Ratio of the ends of a logarithmic axis up to which 2 and 5 are numbered, too."""

MILLI = 1e3

TICKS = 6
"""At most so many along the longest axis of a space."""

SIZE = 2.1
"""Of the diagonal of a space, in plotly.js's unit: it fits into its panel, however it is turned."""

RIMMED = 6.0
"""Spots from this size on have a rim [px]: they stand out on every colour of a surface."""

LIGHT: Mapping[str, float] = {"ambient": 0.65, "diffuse": 0.4, "specular": 0.06, "roughness": 0.9}
"""Dull surfaces: a highlight would be taken for a value."""

Json = dict[str, Any]
"""What plotly.js takes."""


@dataclass(slots=True)
class _Plot:
    """A plot while it is put together; `extras` has for each trace what `page.js` does with it."""

    traces: list[Json]
    extras: list[Json]
    layout: Json

    def add(self, trace: Json, **extra: object) -> None:
        self.traces.append(trace)
        self.extras.append(extra)


def plots(picture: Picture) -> list[Json]:
    """Return what `page.js` draws of a picture, panel by panel."""
    return [
        _space(each) if isinstance(each, Space) else _flat(each, _zoomed_with(each, picture))
        for each in picture.panels
    ]


def _zoomed_with(panel: Panel, picture: Picture) -> str:
    """What the x axis is zoomed with: all of the "run", its likes in the "picture", or nothing ("")."""
    if panel.x.run_time:
        return "run"
    alike = [each for each in picture.panels if isinstance(each, Panel) and each.x == panel.x]
    return "picture" if len(alike) > 1 and picture.columns == 1 else ""


def packed(values: npt.ArrayLike) -> Json:
    """Return an array as plotly.js and `page.js` read it: numbers as 4 bytes each, whole ones signed."""
    array = np.asarray(values)
    kind, name = ("<i4", "i4") if np.issubdtype(array.dtype, np.integer) else ("<f4", "f4")
    return {"dtype": name, "bdata": base64.b64encode(np.ascontiguousarray(array, dtype=kind).tobytes()).decode()}


def _role(colour: Colour, opacity: float = 1.0) -> str:
    return f"role:{colour.name}" if opacity >= 1.0 else f"role:{colour.name}:{opacity:g}"


def _scale(scale: ColourScale) -> list[list[object]]:
    colours = ANCHORS[scale]
    return [[i / (len(colours) - 1), colour] for i, colour in enumerate(colours)]


def _colouring(colouring: Colouring) -> Json:
    low, high = finite_limits(colouring)
    return {
        "quantity": colouring.quantity,
        "label": colouring.label,
        "unit": colouring.unit,
        "values": packed(colouring.values),
        "low": low,
        "high": high,
        "scale": _scale(colouring.scale),
    }


def _typed(text: str) -> str:
    """Text that people may have typed: plotly.js takes some markup for such."""
    return escape(text, quote=False)


def _named(name: str) -> Json:
    return {"name": _typed(name), "showlegend": bool(name)}


def _flat(panel: Panel, zoomed_with: str) -> Json:
    plot = _Plot([], [], {"shapes": [], "annotations": []})
    for mark in panel.marks:
        _add(plot, panel, mark)
    plot.layout |= {
        "xaxis": _axis(panel.x, _extent(panel, 0)),
        "yaxis": _axis(panel.y, _extent(panel, 1)),
        "title": _typed(panel.title),
        "height": panel.height,
        "barmode": "overlay",
        "bargap": 0.0,
    }
    if panel.ground is not None:
        plot.layout["plot_bgcolor"] = _role(panel.ground)
    if panel.equal:
        plot.layout["yaxis"] |= {"scaleanchor": "x", "scaleratio": 1.0, "constrain": "domain"}
        plot.layout["xaxis"] |= {"constrain": "domain"}
    if any(isinstance(mark, Cells) for mark in panel.marks):
        plot.layout["xaxis"] |= {"type": "category"}
        plot.layout["yaxis"] |= {"type": "category", "autorange": "reversed"}
    return {
        "kind": "flat",
        "data": plot.traces,
        "extras": plot.extras,
        "layout": plot.layout,
        "zoomedWith": zoomed_with,
    }


def _extent(panel: Panel, axis: int) -> tuple[float, float]:
    """Least and largest finite number of the lines and points of a panel along an axis."""
    low, high = np.inf, -np.inf
    for mark in panel.marks:
        if isinstance(mark, Line | Points):
            values = np.asarray((mark.x, mark.y)[axis], dtype=np.float64)
            known = values[np.isfinite(values)]
            low, high = min(low, known.min(initial=np.inf)), max(high, known.max(initial=-np.inf))
    return float(low), float(high)


def _axis(axis: Axis, extent: tuple[float, float]) -> Json:
    low, high = axis.low, axis.high
    if low is None and high is None and axis.span > 0.0 and extent[1] - extent[0] < axis.span:
        middle = 0.5 * (extent[0] + extent[1]) if np.isfinite(extent[0]) else 0.0
        low, high = middle - 0.55 * axis.span, middle + 0.55 * axis.span
    ends = [each if each is None or not axis.logarithmic else float(np.log10(each)) for each in (low, high)]
    out: Json = {"title": {"text": _typed(axis.label)}, "type": "linear"}
    if axis.logarithmic:
        least, largest = (end if known is None else known for known, end in zip((low, high), extent, strict=True))
        few = least > 0.0 and largest < FEW_DECADES * least
        out |= {"type": "log", "nticks": 4} | ({"tickformat": "~g"} if few else {"exponentformat": "power"})
    if None not in ends:
        out |= {"range": ends, "autorange": False}
    elif ends != [None, None] and axis.logarithmic:
        out |= {"range": ends, "autorange": "max" if ends[1] is None else "min"}
    elif ends != [None, None]:  # of a range without an end plotly.js forgets the other one when it draws again
        end, side = (low, "min") if high is None else (high, "max")
        out["autorangeoptions"] = {f"{side}allowed": end, "include": [end]}
    if axis.ticks:
        out |= {"tickvals": [at for at, _ in axis.ticks], "ticktext": [_typed(name) for _, name in axis.ticks]}
    return out


def _hover(panel: Panel) -> str:
    """What stands beside the pointer; over the time of a run it stands there for all lines together."""
    if panel.x.run_time:
        return f"%{{y:.5~g}} {panel.y.unit}".rstrip()
    numbered = (
        (name, axis) for name, axis in (("y", panel.y), ("x", panel.x)) if axis.quantity and not axis.ticks
    )
    return "<br>".join(f"{_typed(axis.quantity)} %{{{name}:.5~g}} {axis.unit}".rstrip() for name, axis in numbered)


def _add(plot: _Plot, panel: Panel, mark: Mark) -> None:
    match mark:
        case Line():
            x, y = thinned(mark.x, mark.y, MOST_POINTS)
            plot.add(
                {
                    "type": "scatter",
                    "mode": "lines+markers" if mark.points else "lines",
                    "x": packed(x),
                    "y": packed(y),
                    "line": {"color": _role(mark.colour), "width": mark.width, "dash": mark.dash.value},
                    "marker": {"color": _role(mark.colour), "size": 6},
                    "opacity": mark.opacity,
                    "hovertemplate": _hover(panel),
                    **_named(mark.name),
                }
            )
        case Points():
            plot.add(_points(panel, mark))
        case Moving():
            trace = _points(panel, Points(mark.x[:1], mark.y[:1], mark.name, mark.colour, mark.size))
            trace["marker"] |= {"symbol": "circle-open", "line": {"width": 3, "color": _role(mark.colour)}}
            plot.add(trace, moving={"x": packed(mark.x), "y": packed(mark.y)})
        case Band():
            _add(plot, panel, _outline(mark))
        case Region():
            plot.add(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": packed(mark.x),
                    "y": packed(mark.y),
                    "fill": "toself",
                    "fillcolor": _role(mark.colour, mark.opacity),
                    "line": {"width": 0},
                    "hoverinfo": "skip",
                    **_named(mark.name),
                }
            )
        case Bars():
            along = {"x": packed(mark.length), "y": packed(mark.at), "orientation": "h"}
            upright = {"x": packed(mark.at), "y": packed(mark.length)}
            plot.add(
                {
                    "type": "bar",
                    **(along if mark.lying else upright),
                    "width": packed(mark.width),
                    "marker": {"color": _role(mark.colour)},
                    "hovertemplate": _hover(panel),
                    **_named(mark.name),
                }
            )
        case Rule() | Span():
            plot.layout["shapes"].append(_shape(mark))
        case Text():
            across, up = (
                float(np.log10(at)) if axis.logarithmic else at
                for at, axis in ((mark.x, panel.x), (mark.y, panel.y))
            )
            said = {"text": mark.text, "showarrow": False, "font": {"color": _role(mark.colour)}}
            plot.layout["annotations"].append({"x": across, "y": up, **said})
        case Cells():
            plot.add(_cells(mark))
        case Density():
            plot.add(_density(mark))


def _outline(band: Band) -> Region:
    known = np.isfinite(band.low) & np.isfinite(band.high)
    x, low, high = band.x[known], band.low[known], band.high[known]
    return Region(
        np.concatenate([x, x[::-1]]), np.concatenate([high, low[::-1]]), band.name, band.colour, band.opacity
    )


def _points(panel: Panel, mark: Points) -> Json:
    marker: Json = {"color": _role(mark.colour), "size": mark.size, "symbol": mark.symbol.value}
    colouring = mark.colouring
    if colouring is not None:
        low, high = finite_limits(colouring)
        marker |= {
            "color": packed(colouring.values),
            "cmin": low,
            "cmax": high,
            "colorscale": _scale(colouring.scale),
            "colorbar": {"title": {"text": colouring.label}},
            "showscale": True,
        }
    trace: Json = {
        "type": "scatter",
        "mode": "markers",
        "x": packed(mark.x),
        "y": packed(mark.y),
        "marker": marker,
        "hovertemplate": _hover(panel),
        **_named(mark.name),
    }
    if mark.texts:
        trace |= {"text": list(mark.texts), "hovertemplate": "%{text}<br>" + trace["hovertemplate"]}
    for name, error in (("error_x", mark.x_error), ("error_y", mark.y_error)):
        if error is not None:
            bars = {"arrayminus": packed(error[0]), "array": packed(error[1]), "symmetric": False}
            trace[name] = {"type": "data", **bars, "color": _role(mark.colour), "thickness": 1.4, "width": 4}
    return trace


def _shape(mark: Rule | Span) -> Json:
    across, along = ("x", "y") if mark.upright else ("y", "x")
    ends = (mark.at, mark.at) if isinstance(mark, Rule) else (mark.low, mark.high)
    shape: Json = {
        "type": "line" if isinstance(mark, Rule) else "rect",
        f"{across}0": ends[0],
        f"{across}1": ends[1],
        f"{across}ref": across,
        f"{along}0": 0,
        f"{along}1": 1,
        f"{along}ref": f"{along} domain",
        **_named(mark.name),
    }
    if isinstance(mark, Rule):
        return shape | {"line": {"color": _role(mark.colour), "width": mark.width, "dash": mark.dash.value}}
    return shape | {"layer": "below", "line": {"width": 0}, "fillcolor": _role(mark.colour, mark.opacity)}


def _cells(mark: Cells) -> Json:
    colouring, shape = mark.colouring, (len(mark.rows), len(mark.columns))
    low, high = finite_limits(colouring)
    trace: Json = {
        "type": "heatmap",
        "x": list(map(_typed, mark.columns)),
        "y": list(map(_typed, mark.rows)),
        "z": [[each if np.isfinite(each) else None for each in row] for row in _rows(colouring.values, shape)],
        "zmin": low,
        "zmax": high,
        "colorscale": _scale(colouring.scale),
        "colorbar": {"title": {"text": colouring.label}},
        "hovertemplate": f"%{{y}}<br>%{{x}}<br>%{{z:.4~g}} {colouring.unit}<extra></extra>",
        "xgap": 1,
        "ygap": 1,
    }
    if mark.texts:
        columns = shape[1]
        rows = [list(mark.texts[i : i + columns]) for i in range(0, len(mark.texts), columns)]
        trace |= {"text": rows, "texttemplate": "%{text}"}
    return trace


def _density(mark: Density) -> Json:
    depth = np.where(np.isfinite(mark.depth), mark.depth, -1.0)
    faint, full = _role(mark.colour, FAINTEST), _role(mark.colour)
    return {
        "type": "heatmap",
        "x": packed(0.5 * (mark.x[1:] + mark.x[:-1])),
        "y": packed(0.5 * (mark.y[1:] + mark.y[:-1])),
        "z": [[each if each >= 0.0 else None for each in row] for row in _rows(depth, depth.shape)],
        "customdata": [[100.0 * each for each in row] for row in _rows(mark.shares, depth.shape)],
        "zmin": 0.0,
        "zmax": 1.0,
        "colorscale": [[0.0, faint], [1.0, full]],
        "showscale": False,
        "hovertemplate": "%{customdata:.2~g} % of the time<extra></extra>",
        **_named(mark.name),
    }


def _rows(values: FloatArray, shape: tuple[int, int]) -> list[list[float]]:
    rows: list[list[float]] = np.asarray(values, dtype=np.float64).reshape(shape).tolist()
    return rows


def _space(space: Space) -> Json:
    plot = _Plot([], [], {})
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
                name: axis | {"backgroundcolor": _role(PANE_COLOUR), "showbackground": True}
                for name, axis in axes.items()
            },
            "aspectmode": "manual",
            "aspectratio": dict(zip("xyz", aspect.tolist(), strict=True)),
            "camera": {"eye": eye, "up": up, "projection": {"type": "orthographic"}},
        },
        "title": _typed(space.title),
        "height": space.height,
    }
    return {"kind": "space", "data": plot.traces, "extras": plot.extras, "layout": plot.layout, "zoomedWith": ""}


def _add_solid(plot: _Plot, mark: Solid, extra: Json) -> None:
    match mark:
        case Surface():
            trace = _mesh(mark.vertices, mark.triangles, mark.colour, mark.opacity)
            trace |= _named(mark.name)
            if not mark.shown:
                trace["visible"] = "legendonly"
            if mark.colourings:
                trace["unknown"] = _role(MAP_COLOUR)
            plot.add(trace, **extra, **_choices(mark.colourings))
        case Path():
            trace = _lined(mark.points, "lines", mark.name, shown=mark.shown) | {"hoverinfo": "skip"}
            del trace["hovertemplate"]
            trace["line"] = {"color": _role(mark.colour), "width": mark.width}
            plot.add(trace, **extra, **_choices(mark.colourings))
        case Spots():
            marker = {"color": _role(mark.colour), "size": mark.size, "symbol": _in_space(mark.symbol.value)}
            trace = _lined(mark.points, "markers", mark.name, shown=mark.shown) | {"marker": marker}
            if mark.size >= RIMMED:
                marker["line"] = {"color": _role(CARD), "width": 1}
            if mark.texts:
                trace |= {"text": list(mark.texts), "hovertemplate": "%{text}<br>" + trace["hovertemplate"]}
            plot.add(trace, **extra, **_choices(mark.colourings))
        case Arrows():
            steps = mark.starts if mark.starts.ndim == 3 else mark.starts[None]
            ways = mark.along if mark.along.ndim == 3 else mark.along[None]
            longest = float(np.linalg.norm(ways, axis=-1).max(initial=0.0))
            drawn = [arrow_triangles(*each, longest) for each in zip(steps, ways, strict=True)]
            trace = _mesh(*drawn[0], mark.colour, 1.0) | _named(mark.name) | {"hoverinfo": "skip"}
            if mark.starts.ndim == 3:
                extra = extra | {"meshes": [_corners(*each) for each in drawn]}
            plot.add(trace, **extra)
        case Labels():
            trace = _lined(mark.points, "text", "")
            font = {"color": _role(mark.colour), "size": 14}
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
    return {"colourings": [_colouring(each) for each in colourings]} if colourings else {}


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
        "color": _role(colour),
        "opacity": opacity,
        "lighting": dict(LIGHT),
        "lightposition": {"x": 2e3, "y": 3e3, "z": -6e3},  # above: plotly.js turns normals inwards
        "hovertemplate": "x %{x:.3f}<br>y %{y:.3f}<br>z %{z:.3f} mm",
    }


def _lined(points: FloatArray, mode: str, name: str, *, shown: bool = True) -> Json:
    x, y, z = (packed(column) for column in (MILLI * points).T.reshape(3, -1))
    out: Json = {"type": "scatter3d", "mode": mode, "x": x, "y": y, "z": z, **_named(name)}
    out["hovertemplate"] = "x %{x:.3f}<br>y %{y:.3f}<br>z %{z:.3f} mm"
    return out if shown else out | {"visible": "legendonly"}
