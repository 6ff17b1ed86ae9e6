"""Figures of the explored surface: the map and its colours, the outline of a contour, the path, and marks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from palpate.controllers.paths import Mark, PathEvent
from palpate.errors import FloatArray
from palpate.experiments.explore.explored_map import ExploredMap
from palpate.mapping import HeightMap, TouchCloud, height_map_triangles
from palpate.mapping.layers import VertexLayer
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import Colouring, ColourScale, Line, Points, Rule, Symbol
from palpate.reporting.solids import Polyline, Solid, Spots, Surface
from palpate.runtime.palette import FELT, QUIET_COLOUR, SIDE_BY_SIDE, TRACK, TRUTH, Colour
from palpate.runtime.shown_plan import ShownMark
from palpate.spatial import Vector

if TYPE_CHECKING:
    from palpate.experiments.explore.exploration import ExplorationResult

MILLI, MICRO = 1e3, 1e6

HEIGHT_QUANTITY = "height z"
_ERROR_OF_MAP = "error of the map, + is outside"
ERROR_OF_POINTS = "error of single points, + is outside"
"""Quantities, as the switch between them names them."""

_SHOWN_PERCENT = 99.0
"""Percentage of the values that colours span, so that a few outliers do not hide the rest."""

MIN_RELIEF = 0.05
"""Least span of the colours of heights, relative to the horizontal extent, so that a flat surface looks flat."""

_MIN_ERROR_SPAN = 1e-3
"""Least span of the colours of errors to either side [µm]: less is rounding."""

MAX_PATH_POINTS = 4000
"""Points of a path: more than pixels can resolve."""

_MISSED = "could be felt, is not observed"


@dataclass(frozen=True, slots=True)
class LayerLook:
    """Display of a layer in figures and tables.

    Attributes:
        quantity: Name of the quantity.
        unit: Unit of the display; empty for a ratio.
        scale: Factor from SI to that unit.
        least: Least span of the colours in that unit; they also span at least twice the deviation.
        signed: Whether colours show the sign; where both signs occur, zero is in their middle.
        note: Remark in the table.
        deviation: Sign or words before the standard deviation in the table.
    """

    quantity: str
    unit: str = ""
    scale: float = 1.0
    least: float = 0.0
    signed: bool = False
    note: str = ""
    deviation: str = "±"


def _curvature(quantity: str) -> LayerLook:
    # 5 / m to either side: a radius of 0.2 m, by which a row of 40 mm bends 1 mm
    return LayerLook(quantity, unit="1/m", least=10.0, signed=True)


LAYER_LOOKS: Mapping[str, LayerLook] = {
    "friction": LayerLook(
        "friction while sliding",
        least=0.02,
        note="measured where it slid steadily, not near turns, landings and accelerations",
        deviation="scatters by",
    ),
    "stiffness": LayerLook(
        "stiffness of the object",
        unit="kN/m",
        scale=1e-3,
        note="the object alone: half of the compression is attributed to the tip",
    ),
    "curvature_max": _curvature("largest curvature, + is convex"),
    "curvature_min": _curvature("smallest curvature, + is convex"),
    "curvature_mean": _curvature("mean curvature, + is convex"),
    "curvature_rolled": _curvature("mean curvature, from how normals turned"),
}
"""Displays of the layers that palpate makes, keyed as in `palpate.mapping.layers`."""


def map_colourings(found: ExploredMap) -> tuple[Colouring, ...]:
    """Return all quantities at the vertices of a map."""
    mesh = found.mesh
    layers = (layer_colouring(each) for each in found.layers if isinstance(each, VertexLayer))
    return (
        height_colouring(mesh.vertices),
        *([_error_colouring(_ERROR_OF_MAP, found.error)] if found.truth_known else []),
        _deviation("standard deviation", mesh.sd),
        _deviation("95 % band, half its width", mesh.band()),
        *(each for each in layers if each is not None),
    )


def _deviation(quantity: str, value: FloatArray) -> Colouring:
    largest = max(MICRO * float(np.nanpercentile(value, _SHOWN_PERCENT)), _MIN_ERROR_SPAN)
    return Colouring(quantity, MICRO * value, "µm", 0.0, largest)


def height_colouring(points: FloatArray) -> Colouring:
    """Return the heights of points (n, 3) [m], n at least 1."""
    low, high = points.min(axis=0), points.max(axis=0)
    width, depth, height = (high - low).tolist()
    middle, half = 0.5 * float(low[2] + high[2]), 0.5 * max(height, MIN_RELIEF * max(width, depth), 1e-6)
    return Colouring(HEIGHT_QUANTITY, MILLI * points[:, 2], "mm", MILLI * (middle - half), MILLI * (middle + half))


def _error_colouring(quantity: str, error: FloatArray) -> Colouring:
    """Return signed errors (n,) [m], white where there is none."""
    size = np.abs(error[np.isfinite(error)])
    largest = MICRO * float(np.percentile(size, _SHOWN_PERCENT)) if len(size) else 0.0
    limit = max(largest, _MIN_ERROR_SPAN)
    return Colouring(quantity, MICRO * error, "µm", -limit, limit, ColourScale.ERROR)


def layer_colouring(layer: VertexLayer) -> Colouring | None:
    """Return a layer; None if it is unknown everywhere.

    A layer that is not among `LAYER_LOOKS` is shown in SI units under its own name.
    """
    look = LAYER_LOOKS.get(layer.name, LayerLook(layer.name))
    value, sd = look.scale * layer.mean, look.scale * layer.sd
    known = np.isfinite(value)
    if not known.any():
        return None
    spread = float(np.median(sd[np.isfinite(sd)])) if np.isfinite(sd).any() else 0.0
    low, high = np.percentile(value[known], [100.0 - _SHOWN_PERCENT, _SHOWN_PERCENT]).tolist()
    room = max(0.5 * (max(look.least, 2.0 * spread) - (high - low)), 0.0)
    low, high = low - room, high + room
    if look.signed and low < 0.0 < high:
        # of one sign throughout, as on a ball, colours about zero would all be one
        high = max(-low, high)
        return Colouring(look.quantity, value, look.unit, -high, high, ColourScale.ERROR)
    return Colouring(look.quantity, value, look.unit, low, high)


def places_by_event(marks: Sequence[Mark | ShownMark]) -> Mapping[str, FloatArray]:
    """Return the places of each event, in the order of their first occurrence, shapes (n, 3) [m]."""
    found: dict[str, list[Vector]] = {}
    for mark in marks:
        found.setdefault(str(mark.event), []).append(mark.position)
    return {event: np.array(places) for event, places in found.items()}


def event_look(event: str) -> tuple[Colour, float, Symbol]:
    """Return colour, size [px] and symbol of an event, alike in all figures."""
    number = list(PathEvent).index(PathEvent(event))
    colours = SIDE_BY_SIDE[2:]  # neither that of the contacts nor that of the truth
    symbols = (Symbol.DOT, Symbol.SQUARE, Symbol.DIAMOND, Symbol.PLUS, Symbol.CROSS)  # those that exist in space
    return colours[number % len(colours)], 8.0, symbols[number % len(symbols)]


def event_spots(marks: Sequence[Mark | ShownMark]) -> tuple[Spots, ...]:
    """Return the marks in space, named by their events."""
    return tuple(
        Spots(places, event, *event_look(event), texts=(event,) * len(places))
        for event, places in places_by_event(marks).items()
    )


def felt_path(
    cloud: TouchCloud, error: FloatArray, *, lift: float = 0.003, dots: bool = False
) -> tuple[FloatArray, FloatArray]:
    """Return a path of at most `MAX_PATH_POINTS` contacts, and the largest error around each point.

    Args:
        cloud: At least one contact.
        error: Error of each contact, shape (n,) [m]; NaN where unknown.
        lift: Distance outside the surface, relative to the extent: without it either would cover the other.
        dots: Whether single points are drawn, which need no gaps.

    Returns:
        Points, shape (m, 3) [m], and errors, shape (m,) [m], with NaN in each gap.
    """
    starts = np.arange(0, len(cloud), -(-len(cloud) // MAX_PATH_POINTS))
    count = np.diff(starts, append=len(cloud))[:, np.newaxis]
    position, normal = (np.add.reduceat(each, starts) / count for each in (cloud.position, cloud.normal))
    low, high = np.minimum.reduceat(error, starts), np.maximum.reduceat(error, starts)
    largest = np.where(high > -low, high, low)
    extent = float(np.ptp(cloud.position, axis=0).max())
    points = position + lift * extent * normal
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    if dots or not len(steps):
        return points, largest
    gaps = np.flatnonzero(steps > max(4.0 * float(np.median(steps)), 0.02 * extent)) + 1
    return np.insert(points, gaps, np.nan, axis=0), np.insert(largest, gaps, np.nan)


def surface_figure(result: "ExplorationResult") -> Figure | None:
    """Return the map with all quantities at its vertices; without a map, the contacts; None without contacts."""
    if not len(result.cloud):
        return None
    found, known = result.claimed_map, result.truth.known
    tapped = result.plan.scan.kind == "taps"
    points, error = felt_path(result.cloud, result.point_error, dots=found is None or tapped)
    errors = (_error_colouring(ERROR_OF_POINTS, error),) if known else ()
    solids: list[Solid] = []
    if found is None:
        heights = height_colouring(points)
        solids.append(Spots(points, "contacts", size=3.0, colourings=(heights, *errors)))
        size = f" They are off by {np.nanmax(np.abs(errors[0].values)):.3g} µm at most." if errors else ""
        caption = f"Touched points: there are too few, or too far apart, for a surface.{size}"
    else:
        solids.append(Surface(found.mesh.vertices, found.mesh.triangles, "map", map_colourings(found)))
        missed = _missed(found)
        if len(missed):
            solids.append(Spots(missed, _MISSED, TRUTH, 2.5, Symbol.DIAMOND))
        if tapped:
            solids.append(Spots(points, "contacts", TRACK, 3.0, colourings=errors))
        else:
            solids.append(Polyline(points, "path of the finger", width=2.5, colourings=errors))
        caption = _map_caption(found)
    solids += [*event_spots(result.marks), *([_true_surface(result)] if known else [])]
    return Figure("Touched surface", caption, (Space(tuple(solids), height=620),), wide=True)


def _missed(found: ExploredMap | None) -> FloatArray:
    """Return about 2000 places at most that could be felt and are not observed, shape (n, 3) [m]."""
    if found is None:
        return np.zeros((0, 3))
    missed = found.reachable.position[~found.found]
    return missed[:: -(-len(missed) // 2000) or 1]


def _true_surface(result: "ExplorationResult") -> Surface:
    """Return the true upper surface over the touched region and its margin."""
    touched = result.cloud.position
    room = max(0.05 * float(np.ptp(touched, axis=0).max()), 1e-4)
    low, high = touched.min(axis=0) - room, touched.max(axis=0) + room
    x, y = (np.linspace(low[i], high[i], 81) for i in (0, 1))
    z: FloatArray = result.plan.target.height(*np.meshgrid(x, y))
    vertices, triangles = height_map_triangles(HeightMap(x, y, z, np.zeros_like(z), 0.0))
    height = vertices[triangles, 2].mean(axis=1)
    inside = (height >= low[2]) & (height <= high[2])
    return Surface(vertices, triangles[inside], "true surface", colour=TRUTH, opacity=0.6, shown=False)


def _map_caption(found: ExploredMap) -> str:
    inside = f" {100.0 * found.covered:.1f} % of its true errors are inside it." if found.truth_known else ""
    truth = " The legend shows the true surface over it." if found.truth_known else ""
    return (
        "The surface inside the measured region, and the path over it. Holes and the area beyond the rim were not "
        "touched; grey: unknown. Standard deviations are of random errors; together with the offset that may be "
        f"common to all points, {MICRO * found.mesh.bias:.3g} µm, they make a 95 % band of "
        f"±{MICRO * found.band:.3g} µm (median).{inside}{truth} Colours span {_SHOWN_PERCENT:.0f} % of the "
        "values. A good surface has no holes, looks like the object, is off by no more than its band, and shows "
        "no pattern in its errors."
    )


def contour_figure(result: "ExplorationResult") -> Figure | None:
    """Return the outline from above, and its error along the arc if the truth is known; None without contacts.

    Beside the line nothing was felt, and no surface is claimed.
    """
    if not len(result.cloud):
        return None
    points, path_error = felt_path(result.cloud, result.point_error, lift=0.0)
    steps = np.linalg.norm(np.diff(points, axis=0, prepend=points[:1]), axis=1)
    arc = np.where(np.isfinite(steps), np.nancumsum(steps), np.nan)
    outline = _outline(result, points)
    panels = [Panel(outline, Axis("x", "mm"), Axis("y", "mm"), equal=True, height=460)]
    size = ""
    if result.truth.known:
        error = Line(MILLI * arc, MICRO * path_error, colour=FELT, width=1.2)
        zero = Rule(0.0, colour=QUIET_COLOUR, upright=False)
        marks = []
        for event, places in places_by_event(result.marks).items():
            nearest = [int(np.nanargmin(np.linalg.norm(points - place, axis=1))) for place in places]
            x, y = MILLI * arc[nearest], MICRO * path_error[nearest]
            marks.append(Points(x, y, "", *event_look(event), texts=(event,) * len(places)))
        along = Axis("arc length along what was felt", "mm")
        panels.append(Panel((zero, error, *marks), along, Axis("error", "µm", span=0.5), height=460))
        largest = MICRO * float(np.abs(result.point_error).max())
        size = (
            " The error is the signed distance of the points from the true surface, + is outside; root mean "
            f"square {MICRO * result.point_rms:.3g} µm, {largest:.3g} µm at most."
        )
    return Figure(
        title="The outline",
        caption=(
            f"Seen from above, {MILLI * np.nanmax(arc):.4g} mm from where the finger landed.{size} Beside the "
            "line nothing was felt, and nothing is claimed. Good is the felt line on the true one, and an error "
            "without steps."
        ),
        panels=tuple(panels),
        columns=len(panels),
        wide=True,
    )


def _outline(result: "ExplorationResult", points: FloatArray) -> tuple[Line | Points, ...]:
    cloud, marks = result.cloud, list[Line | Points]()
    if result.truth.known:
        on_surface = replace(cloud, position=cloud.position - result.point_error[:, None] * cloud.normal)
        true, _ = felt_path(on_surface, result.point_error, lift=0.0)
        marks.append(Line(MILLI * true[:, 0], MILLI * true[:, 1], "true", TRUTH, width=5.0, opacity=0.55))
    marks.append(Line(MILLI * points[:, 0], MILLI * points[:, 1], "felt", FELT, width=1.6))
    left = MILLI * _missed(result.map)
    if len(left):
        marks.append(Points(left[:, 0], left[:, 1], _MISSED, TRUTH, 4.0, Symbol.CROSS))
    for event, places in places_by_event(result.marks).items():
        x, y, _ = MILLI * places.T
        marks.append(Points(x, y, event, *event_look(event), texts=(event,) * len(places)))
    return tuple(marks)
