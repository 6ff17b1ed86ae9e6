"""The surface that was felt, to turn: what is known of it, the path, marks, what was missed, the truth."""

from collections.abc import Sequence

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore.exploration import ExplorationResult
from palpate.experiments.explore.explored_map import ExploredMap
from palpate.experiments.explore.felt_path import FeltPath, felt_path
from palpate.experiments.explore.mark_places import event_spots
from palpate.experiments.explore.scans import TapScan
from palpate.experiments.explore.surface_colours import (
    ERROR_OF_POINTS,
    MICRO,
    SHOWN_PERCENT,
    error_colouring,
    height_colouring,
    map_colourings,
)
from palpate.mapping import HeightMap, height_map_triangles
from palpate.reporting.figure import Figure, Space
from palpate.reporting.marks import Colouring, Symbol
from palpate.reporting.solids import Polyline, Solid, Spots, Surface
from palpate.runtime.palette import TRACK, TRUTH

MISSED_DRAWN = 2000
"""Spots of what was not observed: more cover each other."""

MISSED = "could be felt, is not observed"

GRID = 81
"""Grid lines of the true surface along each side."""

BEYOND = 0.05
"""How far it is drawn beyond what was touched, of its extent."""


def surface_figure(exploration: ExplorationResult) -> Figure | None:
    """Return the map with all that is known at its vertices; without a map, the points alone; None without any."""
    if not len(exploration.cloud):
        return None
    found = exploration.claimed_map
    known, tapped = exploration.truth.known, isinstance(exploration.plan.scan, TapScan)
    path = felt_path(exploration.cloud, exploration.point_error, dots=found is None or tapped)
    errors = (error_colouring(ERROR_OF_POINTS, path.error),) if known else ()
    marks: tuple[Solid, ...] = (
        *(_map(found) if found is not None else ()),
        _alone(path, errors) if found is None else _felt(path, errors, tapped=tapped),
        *event_spots(exploration.marks),
        *((_true_surface(exploration),) if known else ()),
    )
    return Figure(
        title="Touched surface",
        caption=_points_caption(errors) if found is None else _map_caption(found),
        panels=(Space(marks, height=620),),
        wide=True,
    )


def missed(found: ExploredMap | None) -> FloatArray:
    """Return about `MISSED_DRAWN` places at most that could be felt and are not observed, shape (n, 3) [m]."""
    return np.zeros((0, 3)) if found is None else found.missed[:: -(-len(found.missed) // MISSED_DRAWN) or 1]


def _map(found: ExploredMap) -> tuple[Solid, ...]:
    surface = Surface(found.mesh.vertices, found.mesh.triangles, "map", map_colourings(found))
    places = missed(found)
    return (surface, Spots(places, MISSED, TRUTH, 2.5, Symbol.DIAMOND)) if len(places) else (surface,)


def _felt(path: FeltPath, errors: tuple[Colouring, ...], *, tapped: bool) -> Solid:
    """What was felt on a map: where the finger went, or where it tapped."""
    if tapped:
        return Spots(path.points, "contacts", TRACK, 3.0, colourings=errors)
    return Polyline(path.points, "path of the finger", width=2.5, colourings=errors)


def _alone(path: FeltPath, errors: tuple[Colouring, ...]) -> Spots:
    return Spots(path.points, "contacts", size=3.0, colourings=(height_colouring(path.points), *errors))


def _true_surface(exploration: ExplorationResult) -> Surface:
    """The true upper surface over the touched region and a little beyond."""
    touched = exploration.cloud.position
    room = max(BEYOND * float(np.ptp(touched, axis=0).max()), 1e-4)
    low, high = touched.min(axis=0) - room, touched.max(axis=0) + room
    x, y = (np.linspace(low[i], high[i], GRID) for i in (0, 1))
    z: FloatArray = exploration.plan.target.height(*np.meshgrid(x, y))
    vertices, triangles = height_map_triangles(HeightMap(x, y, z, np.zeros_like(z), 0.0))
    height = vertices[triangles, 2].mean(axis=1)
    inside = (height >= low[2]) & (height <= high[2])
    return Surface(vertices, triangles[inside], "true surface", colour=TRUTH, opacity=0.6, shown=False)


def _map_caption(found: ExploredMap) -> str:
    inside = f" {100.0 * found.covered:.1f} % of its true errors are inside it." if found.truth_known else ""
    truth = " The legend shows the true surface over it." if found.truth_known else ""
    return (
        "What is claimed, and where it was felt; holes and what is beyond the rim were not felt, grey is not "
        f"known. Standard deviations are of random errors; together with what may be off everywhere, "
        f"{MICRO * found.mesh.bias:.3g} µm, they make a 95 % band of ±{MICRO * found.band:.3g} µm (median)."
        f"{inside}{truth} Colours span {SHOWN_PERCENT:.0f} % of the values. Good is a surface without "
        "holes that looks as the object does, is off by no more than its band, and shows no pattern in its errors."
    )


def _points_caption(errors: Sequence[Colouring]) -> str:
    size = f" They are off by {np.nanmax(np.abs(errors[0].values)):.3g} µm at most." if errors else ""
    return f"Touched points: there are too few, or too far apart, for a surface.{size}"
