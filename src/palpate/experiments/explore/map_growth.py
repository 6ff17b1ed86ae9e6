"""Growth of the map over an exploration, computed afterwards, and its figures."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.experiments.explore.explored_map import ribbon_mesh
from palpate.experiments.explore.surface_figure import MICRO, MILLI, event_spots, places_by_event
from palpate.mapping import Knowledge, SurfaceMap, SurfaceMesh, TouchCloud, surface_mesh
from palpate.mapping.mesh_metrics import MeshMetrics, voxel_for
from palpate.reporting.figure import Axis, Figure, Panel, Space
from palpate.reporting.marks import Colouring, Dash, Line
from palpate.reporting.solids import Polyline, Spots, Stepped, Surface
from palpate.runtime.log import Record
from palpate.runtime.palette import COMMAND, FELT, INK_COLOUR, TRACK
from palpate.runtime.plan_track import PlanTrack
from palpate.runtime.shown_plan import PlanChange, ShownMark

PATH_SHARES = (0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Shares of the path length at which the map is made."""

_CM2_PER_M2 = 1e4


@dataclass(frozen=True, slots=True, eq=False)
class GrowthSnapshot:
    """The map at one moment.

    Attributes:
        mesh: Surface observed by then.
        done: Path of the tip by then, shape (n, 3) [m].
        to_go: Rest of the leg at that moment, shape (m, 3) [m]; empty if the contacts lead the way.
        marks: Marks by then.
    """

    mesh: SurfaceMesh
    done: FloatArray
    to_go: FloatArray
    marks: Sequence[ShownMark]


@dataclass(frozen=True, slots=True, eq=False)
class MapGrowth:
    """Observed area, its uncertainty, and the map at k moments.

    Attributes:
        time: Time since the beginning of the run, shape (k,) [s].
        contacts: Number of contacts so far, shape (k,).
        path_length: Path length of the tip so far, lifted or not, shape (k,) [m].
        area: Observed area, shape (k,) [m^2].
        middle: Standard deviation that half of that area stays below, shape (k,) [m]; NaN without area.
        tail: Standard deviation that 95 % of that area stays below, shape (k,) [m].
        snapshots: Map at each moment.
    """

    time: FloatArray
    contacts: FloatArray
    path_length: FloatArray
    area: FloatArray
    middle: FloatArray
    tail: FloatArray
    snapshots: tuple[GrowthSnapshot, ...]

    @property
    def largest_sd(self) -> float:
        """Standard deviation that 98 % of all vertices stay below [m]."""
        found = np.concatenate([np.zeros(0), *(each.mesh.sd for each in self.snapshots)])
        found = found[np.isfinite(found)]
        return float(np.percentile(found, 98.0)) if len(found) else 0.0


def map_growth(
    cloud: TouchCloud,
    record: Record,
    learned: SurfaceMap,
    plans: Sequence[PlanChange],
    *,
    line: bool = False,
    finest: float = 5e-4,
) -> MapGrowth | None:
    """Return the growth of the map, or None without contacts.

    All moments use one model of surface and noise, learned from the whole run, so that they can be compared.

    Args:
        cloud: Contacts of the scan.
        record: Record of the run.
        learned: Map of all contacts.
        plans: Plans of the run.
        line: Whether the contacts lie on one line; the meshes are ribbons along it then, which claim nothing.
        finest: Edge of the grid of the meshes, if the surface is small [m].
    """
    if not len(cloud):
        return None
    path = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(record.position, axis=0), axis=1))])
    until = record.time[np.minimum(np.searchsorted(path, np.array(PATH_SHARES) * path[-1]), len(path) - 1)]
    step = -(-len(cloud) // 20_000)  # the map averages over a millimetre, fifty times their distance
    thin = cloud if step == 1 else cloud.select(np.arange(len(cloud)) % step == 0)
    voxel = voxel_for(thin.position, finest, 3_000)  # some eight meshes are in one figure
    surface = SurfaceMap(learned.settings, learned.model)
    meshes: list[SurfaceMesh] = []
    index, taken = np.arange(len(thin)), 0
    for moment in until.tolist():
        end = int(np.searchsorted(thin.time, moment, side="right"))
        if end > taken:
            surface.add(thin.select((index >= taken) & (index < end)))
        if end > taken or not meshes:
            meshes.append(ribbon_mesh(surface, voxel) if line else surface_mesh(surface, voxel))
        else:
            meshes.append(meshes[-1])
        taken = max(taken, end)
    metrics = [MeshMetrics.of(mesh) for mesh in meshes]
    return MapGrowth(
        time=until - record.time[0],
        contacts=np.searchsorted(cloud.time, until, side="right").astype(np.float64),
        path_length=np.interp(until, record.time, path),
        area=np.array([each.area for each in metrics]),
        middle=np.array([each.middle for each in metrics]),
        tail=np.array([each.tail for each in metrics]),
        snapshots=_snapshots(record, until, meshes, plans),
    )


def _snapshots(
    record: Record, until: FloatArray, meshes: Sequence[SurfaceMesh], plans: Sequence[PlanChange]
) -> tuple[GrowthSnapshot, ...]:
    track, followed, moved = PlanTrack(), 0, 0
    marks: Sequence[ShownMark] = ()
    found = []
    for moment, mesh in zip(until.tolist(), meshes, strict=True):
        end = int(np.searchsorted(record.time, moment, side="right"))
        while followed < len(plans) and plans[followed].time <= moment:
            change = plans[followed]
            begins = int(np.searchsorted(record.time, change.time))
            track.move(record.position[moved:begins])
            track.follow(change.plan)
            moved, followed, marks = max(begins, moved), followed + 1, change.plan.marks
        track.move(record.position[moved:end])
        moved = max(end, moved)
        found.append(GrowthSnapshot(mesh, track.done, track.rest, marks))
    return tuple(found)


def growth_figure(growth: MapGrowth) -> Figure:
    """Return area and standard deviations over path length, time and contacts."""
    scales = (
        (Axis("path length", "mm", low=0.0), MILLI * growth.path_length),
        (Axis("time", "s", low=0.0), growth.time),
        (Axis("contacts", low=0.0), growth.contacts),
    )
    area, deviation = Axis("observed area", "cm²", low=0.0), Axis("sd", "µm", low=0.0)
    tail, middle = MICRO * growth.tail, MICRO * growth.middle
    areas = [
        Panel((Line(x, _CM2_PER_M2 * growth.area, colour=FELT, points=True),), axis, area, height=210)
        for axis, x in scales
    ]
    deviations = [
        Panel(
            (
                Line(x, tail, "95 % of the area", INK_COLOUR, dash=Dash.DOTTED, points=True),
                Line(x, middle, "median", INK_COLOUR, points=True),
            ),
            axis,
            deviation,
            height=210,
        )
        for axis, x in scales
    ]
    return Figure(
        title="Growth of the map",
        caption=(
            f"In the end {_CM2_PER_M2 * growth.area[-1]:.3g} cm² are observed, half of them to ±{middle[-1]:.3g} "
            f"µm, 95 % to ±{tail[-1]:.3g} µm or better (one standard deviation). All moments use the noise and "
            "surface model learned from the whole run. A growing area and falling deviations are good; where both "
            "are flat, the rest of the run added little."
        ),
        panels=(*areas, *deviations),
        columns=len(scales),
        wide=True,
    )


def snapshots_figure(growth: MapGrowth) -> Figure:
    """Return the map at each snapshot, all in one scale of colours and lengths."""
    last = len(growth.snapshots) - 1
    counts = "; ".join(
        f"{len(places)} x {event}" for event, places in places_by_event(growth.snapshots[last].marks).items()
    )
    known = (
        "At each moment the area observed and its median standard deviation. The colour is the standard deviation "
        "of the surface's position: dark, without holes, is good."
        if growth.area.any()
        else "Contacts are too far apart, or on one line: nothing of the surface counts as observed."
    )
    return Figure(
        title="The map while it grew",
        caption=f"{known} The tip's path is that of its middle; ahead of it is the rest of the leg at that moment."
        f"{f' Marks: {counts}.' if counts else ''}",
        panels=(Space((Stepped(tuple(_drawn(growth, each) for each in growth.snapshots)),), height=520),),
        steps=tuple(_heading(growth, moment) for moment in range(last + 1)),
        step=last,
        wide=True,
    )


def _heading(growth: MapGrowth, moment: int) -> str:
    whole = float(growth.path_length[-1])
    share = float(growth.path_length[moment]) / whole if whole > 0.0 else 1.0
    done = f"{100.0 * share:.0f} % of the path, {growth.time[moment]:.1f} s"
    if not growth.area.any():
        return done
    sd = growth.middle[moment]
    known = f", sd {MICRO * sd:.3g} µm" if np.isfinite(sd) else ""
    return f"{done}: {_CM2_PER_M2 * growth.area[moment]:.3g} cm²{known}"


def _drawn(growth: MapGrowth, each: GrowthSnapshot) -> tuple[Surface | Polyline | Spots, ...]:
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
    """Return at most 1500 points: more than pixels can resolve."""
    kept = np.unique(np.linspace(0, len(points) - 1, min(1500, len(points))).round().astype(np.intp))
    return points[kept]
