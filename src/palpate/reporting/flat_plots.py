"""Flat panels as plotly.js draws them."""

import numpy as np

from palpate.errors import FloatArray
from palpate.reporting.envelope import thinned
from palpate.reporting.figure import Axis, Panel
from palpate.reporting.marks import (
    FAINTEST,
    Band,
    Bars,
    Cells,
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
    finite_limits,
)
from palpate.reporting.traces import Json, Plot, named, packed, role, scale_of, typed

MOST_POINTS = 12_000
"""Of a line: enough to zoom in by ten on a wide screen."""

FEW_DECADES = 1e3
"""Ratio of the ends of a logarithmic axis up to which 2 and 5 are numbered, too."""


def flat_plot(panel: Panel, zoomed_with: str) -> Json:
    """Return a flat panel; `zoomed_with` says what its x axis is zoomed with: "run", "figure" or ""."""
    plot = Plot([], [], {"shapes": [], "annotations": []})
    for mark in panel.marks:
        _add(plot, panel, mark)
    plot.layout |= {
        "xaxis": _axis(panel.x, _extent(panel, 0)),
        "yaxis": _axis(panel.y, _extent(panel, 1)),
        "title": typed(panel.title),
        "height": panel.height,
        "barmode": "overlay",
        "bargap": 0.0,
    }
    if panel.ground is not None:
        plot.layout["plot_bgcolor"] = role(panel.ground)
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
    out: Json = {"title": {"text": typed(axis.label)}, "type": "linear"}
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
        out |= {"tickvals": [at for at, _ in axis.ticks], "ticktext": [typed(name) for _, name in axis.ticks]}
    return out


def _hover(panel: Panel) -> str:
    """What stands beside the pointer; over the time of a run it stands there for all lines together."""
    if panel.x.run_time:
        return f"%{{y:.5~g}} {panel.y.unit}".rstrip()
    axes = (("y", panel.y), ("x", panel.x))
    numbered = ((name, axis) for name, axis in axes if axis.quantity and not axis.ticks)
    return "<br>".join(f"{typed(axis.quantity)} %{{{name}:.5~g}} {axis.unit}".rstrip() for name, axis in numbered)


def _add(plot: Plot, panel: Panel, mark: Mark) -> None:
    match mark:
        case Line():
            x, y = thinned(mark.x, mark.y, MOST_POINTS)
            plot.add(
                {
                    "type": "scatter",
                    "mode": "lines+markers" if mark.points else "lines",
                    "x": packed(x),
                    "y": packed(y),
                    "line": {"color": role(mark.colour), "width": mark.width, "dash": mark.dash.value},
                    "marker": {"color": role(mark.colour), "size": 6},
                    "opacity": mark.opacity,
                    "hovertemplate": _hover(panel),
                    **named(mark.name),
                }
            )
        case Points():
            plot.add(_points(panel, mark))
        case Moving():
            trace = _points(panel, Points(mark.x[:1], mark.y[:1], mark.name, mark.colour, mark.size))
            trace["marker"] |= {"symbol": "circle-open", "line": {"width": 3, "color": role(mark.colour)}}
            plot.add(trace, moving={"x": packed(mark.x), "y": packed(mark.y)})
        case Band():
            _add(plot, panel, _outline(mark))
        case Polygon():
            plot.add(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": packed(mark.x),
                    "y": packed(mark.y),
                    "fill": "toself",
                    "fillcolor": role(mark.colour, mark.opacity),
                    "line": {"width": 0},
                    "hoverinfo": "skip",
                    **named(mark.name),
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
                    "marker": {"color": role(mark.colour)},
                    "hovertemplate": _hover(panel),
                    **named(mark.name),
                }
            )
        case Rule() | Span():
            plot.layout["shapes"].append(_shape(mark))
        case Text():
            across, upwards = (
                float(np.log10(at)) if axis.logarithmic else at
                for at, axis in ((mark.x, panel.x), (mark.y, panel.y))
            )
            font = {"color": role(mark.colour)}
            words = {"x": across, "y": upwards, "text": mark.text, "showarrow": False, "font": font}
            plot.layout["annotations"].append(words)
        case Cells():
            plot.add(_cells(mark))
        case Density():
            plot.add(_density(mark))


def _outline(band: Band) -> Polygon:
    known = np.isfinite(band.low) & np.isfinite(band.high)
    x, low, high = band.x[known], band.low[known], band.high[known]
    return Polygon(
        np.concatenate([x, x[::-1]]), np.concatenate([high, low[::-1]]), band.name, band.colour, band.opacity
    )


def _points(panel: Panel, mark: Points) -> Json:
    marker: Json = {"color": role(mark.colour), "size": mark.size, "symbol": mark.symbol.value}
    if mark.symbol is Symbol.STROKE:
        marker["line"] = {"color": role(mark.colour), "width": 2.5}
    colouring = mark.colouring
    if colouring is not None:
        low, high = finite_limits(colouring)
        marker |= {
            "color": packed(colouring.values),
            "cmin": low,
            "cmax": high,
            "colorscale": scale_of(colouring.scale),
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
        **named(mark.name),
    }
    if mark.texts:
        trace |= {"text": list(mark.texts), "hovertemplate": "%{text}<br>" + trace["hovertemplate"]}
    for name, error in (("error_x", mark.x_error), ("error_y", mark.y_error)):
        if error is not None:
            bars = {"arrayminus": packed(error[0]), "array": packed(error[1]), "symmetric": False}
            trace[name] = {"type": "data", **bars, "color": role(mark.colour), "thickness": 1.4, "width": 4}
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
        **named(mark.name),
    }
    if isinstance(mark, Rule):
        return shape | {"line": {"color": role(mark.colour), "width": mark.width, "dash": mark.dash.value}}
    return shape | {"layer": "below", "line": {"width": 0}, "fillcolor": role(mark.colour, mark.opacity)}


def _cells(mark: Cells) -> Json:
    colouring, shape = mark.colouring, (len(mark.rows), len(mark.columns))
    low, high = finite_limits(colouring)
    trace: Json = {
        "type": "heatmap",
        "x": list(map(typed, mark.columns)),
        "y": list(map(typed, mark.rows)),
        "z": [[each if np.isfinite(each) else None for each in row] for row in _rows(colouring.values, shape)],
        "zmin": low,
        "zmax": high,
        "colorscale": scale_of(colouring.scale),
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
    faint, full = role(mark.colour, FAINTEST), role(mark.colour)
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
        **named(mark.name),
    }


def _rows(values: FloatArray, shape: tuple[int, int]) -> list[list[float]]:
    rows: list[list[float]] = np.asarray(values, dtype=np.float64).reshape(shape).tolist()
    return rows
