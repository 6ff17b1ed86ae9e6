"""How the map of an exploration grew: the map at some moments, and its key numbers; computed afterwards."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.experiments.explore.explored_map import ribbon_mesh
from palpate.mapping import Knowledge, SurfaceMap, SurfaceMesh, TouchCloud, surface_mesh
from palpate.mapping.mesh_metrics import MeshMetrics, voxel_for
from palpate.runtime.log import Record
from palpate.runtime.plan_track import PlanTrack
from palpate.runtime.shown_plan import PlanChange, ShownMark

SHARES = (0.05, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Shares of the path length at which the map is made."""

MOST_VERTICES = 3_000
"""Of a mesh: some eight are in one figure."""

MOST_CONTACTS = 20_000
"""Contacts are decimated to at most so many: the map averages over a millimetre, fifty times their distance."""


@dataclass(frozen=True, slots=True, eq=False)
class GrowthCurve:
    """Observed area and its uncertainty at k moments.

    Attributes:
        time: From the beginning of the run, shape (k,) [s].
        contacts: So far, shape (k,).
        path_length: Of the tip so far, lifted or not, shape (k,) [m].
        area: Observed, shape (k,) [m^2].
        middle: Standard deviation that half of that area stays below, shape (k,) [m]; NaN without area.
        tail: Likewise for 95 % of it, shape (k,) [m].
    """

    time: FloatArray
    contacts: FloatArray
    path_length: FloatArray
    area: FloatArray
    middle: FloatArray
    tail: FloatArray

    def __len__(self) -> int:
        """Number of moments."""
        return len(self.time)


@dataclass(frozen=True, slots=True, eq=False)
class GrowthSnapshot:
    """The map at one moment.

    Attributes:
        mesh: What was observed by then.
        done: Where the tip was by then, shape (n, 3) [m].
        to_go: Of the leg of that moment, what the tip had still to go, shape (m, 3) [m]; empty if what is felt
            leads.
        marks: By then.
    """

    mesh: SurfaceMesh
    done: FloatArray
    to_go: FloatArray
    marks: Sequence[ShownMark]


@dataclass(frozen=True, slots=True, eq=False)
class MapGrowth:
    """How a map grew.

    Attributes:
        curve: Over all moments.
        snapshots: Of each of those.
    """

    curve: GrowthCurve
    snapshots: tuple[GrowthSnapshot, ...]

    @property
    def largest_sd(self) -> float:
        """Standard deviation that 98 % of all vertices stay below [m]: where a common scale of colours ends."""
        found = np.concatenate([np.zeros(0), *(each.mesh.sd for each in self.snapshots)])
        found = found[np.isfinite(found)]
        return float(np.percentile(found, 98.0)) if len(found) else 0.0


def map_growth(
    cloud: TouchCloud,
    record: Record,
    learned: SurfaceMap,
    plans: Sequence[PlanChange],
    *,
    worst: Knowledge = Knowledge.OBSERVED,
    finest: float = 5e-4,
) -> MapGrowth | None:
    """Return how the map grew, or None if nothing was touched.

    All moments use one model of surface and noise, learned from the whole run, so that they can be compared.

    Args:
        cloud: What was felt.
        record: Of every period.
        learned: The map of it all.
        plans: Of the run.
        worst: What of the map is shown; `EXTRAPOLATED` is the ribbon along a line, of which nothing is claimed.
        finest: Edge of the grid of the meshes, if the surface is small [m].
    """
    if not len(cloud):
        return None
    path = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(record.position, axis=0), axis=1))])
    until = record.time[np.minimum(np.searchsorted(path, np.array(SHARES) * path[-1]), len(path) - 1)]
    thin = _thinned(cloud)
    voxel = voxel_for(thin.position, finest, MOST_VERTICES)
    surface = SurfaceMap(learned.settings, learned.model)
    meshes: list[SurfaceMesh] = []
    taken = 0
    for moment in until.tolist():
        end = int(np.searchsorted(thin.time, moment, side="right"))
        if end > taken:
            surface.add(_part(thin, taken, end))
            taken = end
            meshes.append(_mesh(surface, voxel, worst))
        else:
            meshes.append(meshes[-1] if meshes else _mesh(surface, voxel, worst))
    metrics = [MeshMetrics.of(mesh) for mesh in meshes]
    curve = GrowthCurve(
        time=until - record.time[0],
        contacts=np.searchsorted(cloud.time, until, side="right").astype(np.float64),
        path_length=np.interp(until, record.time, path),
        area=np.array([each.area for each in metrics]),
        middle=np.array([each.middle for each in metrics]),
        tail=np.array([each.tail for each in metrics]),
    )
    return MapGrowth(curve, _snapshots(record, until, meshes, plans))


def _mesh(surface: SurfaceMap, voxel: float, worst: Knowledge) -> SurfaceMesh:
    return ribbon_mesh(surface, voxel) if worst is Knowledge.EXTRAPOLATED else surface_mesh(surface, voxel, worst)


def _snapshots(
    record: Record, until: FloatArray, meshes: Sequence[SurfaceMesh], plans: Sequence[PlanChange]
) -> tuple[GrowthSnapshot, ...]:
    """The maps, each with where the tip was, where it was going, and what was marked by then."""
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


def _thinned(cloud: TouchCloud) -> TouchCloud:
    step = -(-len(cloud) // MOST_CONTACTS)
    kept: npt.NDArray[np.bool_] = np.arange(len(cloud)) % step == 0
    return cloud if step == 1 else cloud.select(kept)


def _part(cloud: TouchCloud, begin: int, end: int) -> TouchCloud:
    index = np.arange(len(cloud))
    return cloud.select((index >= begin) & (index < end))
