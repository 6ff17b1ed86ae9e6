"""The map while it grew, to turn and to play: its uncertainty, the path done, the path ahead, marks."""

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore.growth_figure import MICRO, heading
from palpate.experiments.explore.map_growth import GrowthSnapshot, MapGrowth
from palpate.experiments.explore.mark_places import event_spots, places_by_event
from palpate.mapping import Knowledge
from palpate.reporting.figure import Figure, Space
from palpate.reporting.marks import Colouring
from palpate.reporting.solids import Polyline, Spots, Stepped, Surface
from palpate.runtime.palette import COMMAND, TRACK

DONE_POINTS = 1500
"""At most so many points of the path are drawn: more than pixels can resolve."""


def snapshots_figure(growth: MapGrowth) -> Figure:
    """Return the map at each snapshot, all in one scale of colours and lengths."""
    last = growth.snapshots[-1]
    counts = "; ".join(f"{len(places)} x {event}" for event, places in places_by_event(last.marks).items())
    return Figure(
        title="The map while it grew",
        caption=f"{_known(growth)} The tip's path is that of its middle; ahead of it is the rest of the leg at "
        f"that moment.{f' Marks: {counts}.' if counts else ''}",
        panels=(Space((Stepped(tuple(_shown(growth, each) for each in growth.snapshots)),), height=520),),
        steps=tuple(heading(growth, moment) for moment in range(len(growth.snapshots))),
        step=len(growth.snapshots) - 1,
        wide=True,
    )


def _known(growth: MapGrowth) -> str:
    """What is seen of the map, as text."""
    if not growth.curve.area.any():
        return "Contacts are too far apart, or on one line: nothing of the surface counts as observed."
    return (
        "At each moment the area observed and its median standard deviation. The colour is the standard deviation "
        "of the surface's position: dark, without holes, is good."
    )


def _shown(growth: MapGrowth, each: GrowthSnapshot) -> tuple[Surface | Polyline | Spots, ...]:
    mesh, shown = each.mesh, list[Surface | Polyline | Spots]()
    if len(mesh.triangles) and (mesh.knowledge == Knowledge.OBSERVED).any():
        most = MICRO * max(growth.largest_sd, 1e-9)
        deviation = Colouring("standard deviation", MICRO * mesh.sd, "µm", 0.0, most)
        shown.append(Surface(mesh.vertices, mesh.triangles, "map", (deviation,)))
    if len(each.done):
        shown.append(Polyline(_thinned(each.done), "path of the tip", width=2.0))
        shown.append(Spots(each.done[-1:], "tip", TRACK, 6.0))
    if len(each.to_go) > 1:
        shown.append(Polyline(_thinned(each.to_go), "still to go", COMMAND, 4.0))
    return (*shown, *event_spots(each.marks))


def _thinned(points: FloatArray) -> FloatArray:
    kept = np.unique(np.linspace(0, len(points) - 1, min(DONE_POINTS, len(points))).round().astype(np.intp))
    return points[kept]
