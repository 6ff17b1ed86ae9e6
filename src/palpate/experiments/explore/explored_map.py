"""The map that an exploration makes: surface, mesh, budget of errors, friction, and which shape it is."""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray
from palpate.estimation import Assumption, Verdict
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.explored_contacts import ScanContacts
from palpate.experiments.explore.explored_layers import friction_on, stiffness_on, unknown_layer
from palpate.experiments.explore.map_budget import MapBudget
from palpate.experiments.explore.named_shape import NamedShape, named_shape
from palpate.experiments.explore.reachable_surface import ReachableSurface
from palpate.experiments.explore.scans import ActiveScan, ContourScan, Scan, TapScan
from palpate.experiments.kit.recorded_run import ProgressCallback, no_progress
from palpate.mapping import (
    Knowledge,
    MapSettings,
    SurfaceMap,
    SurfaceMesh,
    SurfaceModel,
    TouchCloud,
    surface_mesh,
)
from palpate.mapping.curvature_layers import curvature_layers
from palpate.mapping.layers import VertexDirection, VertexLayer
from palpate.mapping.mesh_metrics import voxel_for
from palpate.sim import SceneObject

MOST_VERTICES = 60_000
"""About so many vertices at most: some seconds, and more than a figure shows."""

WIDEST_ROWS = 2.0
"""Rows count as neighbours up to so many times the distance at which they were to be: a wider gap is a hole."""

WIDE_PERCENT = 95.0
"""Percentage of the contacts whose next row is nearer than the distance of rows that the map assumes."""

SAME_ROW = 3.0
"""Contacts up to so many distances of rows apart along the path are of one row."""

THIN = 4.0
"""To distinguish rows, contacts are thinned to the rows' distance over this."""

SHAPE_CONTACTS = 400
"""A shape is fitted to so many contacts, or, where rows are close, to one every distance of rows."""

LITTLE = 0.25
"""Least observed share of the reachable area that rules out a shape: less is a run that was cut short."""


@dataclass(frozen=True, slots=True, eq=False)
class ExploredMap:
    """What an exploration knows of the surface, and how well.

    Attributes:
        surface: The map itself, which can be queried.
        mesh: Its observed part as triangles; of a contour, a single line, the ribbon along it, which is
            extrapolated and not claimed; see `SurfaceMesh.knowledge`.
        budget: Largest constant offset, by origin; the bias of the map's settings.
        friction: Tangential over normal force while sliding, at the vertices of the mesh.
        stiffness: Of the object alone [N/m], likewise; known where the force varied.
        curvature: How it is bent there; see `palpate.mapping.curvature_layers`. Nothing of a line: it was
            felt along it alone.
        shape: Which shape it is; None where too little was felt to decide.
        error: Signed distance of each vertex to the true surface, positive outside, shape (n,) [m].
        reachable: The part of the true surface that the tip could have felt along its path, as samples.
        found: Which of those are observed.
        truth_known: Whether anybody knows the true surface; else `error` is NaN and `reachable` empty.
    """

    surface: SurfaceMap
    mesh: SurfaceMesh
    budget: MapBudget
    friction: VertexLayer
    stiffness: VertexLayer
    curvature: tuple[VertexLayer | VertexDirection, ...]
    shape: NamedShape | None
    error: FloatArray
    reachable: ReachableSurface
    found: npt.NDArray[np.bool_]
    truth_known: bool = True

    @property
    def layers(self) -> tuple[VertexLayer | VertexDirection, ...]:
        """All that is known at the vertices besides their place, for a file."""
        return (self.friction, self.stiffness, *self.curvature)

    @property
    def verdict(self) -> Verdict:
        """Which assumptions of the map what was felt contradicts; of a line, which claims no surface, outliers."""
        broken = self.surface.verdict.broken
        return Verdict(tuple(b for b in broken if not self.is_line or b.assumption is Assumption.NO_OUTLIERS))

    @property
    def usable(self) -> bool:
        """Whether its band holds: it is widened for fine detail, but not for a model at a limit of its search."""
        return not self.verdict.breaks(Assumption.WITHIN_BOUNDS)

    @property
    def worst(self) -> Knowledge:
        """What the mesh shows."""
        known = self.mesh.knowledge
        return Knowledge(int(known.max())) if len(known) else Knowledge.OBSERVED

    @property
    def claimed(self) -> npt.NDArray[np.bool_]:
        """Which vertices are observed, shape (n,)."""
        return np.asarray(self.mesh.knowledge == Knowledge.OBSERVED)

    @property
    def is_line(self) -> bool:
        """Whether the mesh is only a ribbon along a line, of which nothing is claimed."""
        return bool(len(self.mesh.knowledge)) and not bool(self.claimed.any())

    @property
    def felt_little(self) -> bool:
        """Whether less was felt than would rule out a shape: a line, or a small share of what could be reached."""
        return self.is_line or self.observed_share < LITTLE

    @property
    def rms(self) -> float:
        """RMS distance of the claimed vertices to the true surface [m]; NaN without any."""
        error = self.error[self.claimed]
        return float(np.sqrt(np.mean(np.square(error)))) if len(error) else math.nan

    @property
    def band(self) -> float:
        """Median half-width of the claimed vertices' 95 % band [m]; NaN without any."""
        band = self.mesh.band()[self.claimed]
        return float(np.median(band)) if len(band) else math.nan

    @property
    def covered(self) -> float:
        """Share of true errors of the claimed vertices inside the 95 % band; NaN without any."""
        inside = (np.abs(self.error) <= self.mesh.band())[self.claimed]
        return float(np.mean(inside)) if len(inside) else math.nan

    @property
    def observed_share(self) -> float:
        """Share of the reachable area that is observed; NaN if nothing could be reached."""
        area = self.reachable.area
        return float(area[self.found].sum() / area.sum()) if len(area) else math.nan

    @property
    def missed(self) -> FloatArray:
        """Reachable samples that are not observed, shape (k, 3) [m]."""
        return self.reachable.position[~self.found]


def explored_map(
    felt: ScanContacts,
    target: SceneObject | None,
    scan: Scan,
    config: ExploreConfig,
    budget: MapBudget,
    tip_size_sd: float = 0.0,
    progress: ProgressCallback = no_progress,
) -> ExploredMap:
    """Return the map of what was felt.

    Args:
        felt: In the scan.
        target: What was touched, for the truth; None if nobody knows.
        scan: Where it went.
        config: What was asked for.
        budget: From `map_budget`.
        tip_size_sd: Standard deviation of the tip's size [m].
        progress: Called with the name of each step.
    """
    progress("fitting the map")
    cloud = felt.cloud
    rows = neighbour_distance(cloud, scan, config.gap)
    usual = SurfaceModel()  # normals that the sensor's calibration tilts from row to row are no relief
    model = replace(usual, tilt=max(usual.tilt, budget.tilt))
    surface = SurfaceMap.learned(cloud, MapSettings.for_rows(rows, model=model, bias=budget.total))
    progress("cutting the mesh")
    voxel = voxel_for(cloud.position, config.map_spacing, MOST_VERTICES)
    mesh = ribbon_mesh(surface, voxel) if isinstance(scan, ContourScan) else surface_mesh(surface, voxel)
    progress("friction, stiffness and curvature")
    friction = friction_on(mesh, felt, config.gap)
    if config.force_swing:
        stiffness = stiffness_on(mesh, felt, surface.model, rows, config.force_period)
    else:  # force errors at edges are no deliberate press: they would give a wrong stiffness
        stiffness = unknown_layer("stiffness", mesh)
    curvature = () if isinstance(scan, ContourScan) else curvature_layers(surface, mesh)
    progress("which shape it is")
    apart = shape_spacing(cloud, config.gap)
    rows_of = points_per_row(cloud.thinned(apart), scan.row, apart)
    shape = named_shape(cloud, apart, rows_of, budget, surface.model, offset_sd=tip_size_sd)
    progress("comparing with the truth")
    reachable = ReachableSurface.unknown() if target is None else ReachableSurface.of(target, config, scan)
    return ExploredMap(
        surface=surface,
        mesh=mesh,
        budget=budget,
        friction=friction,
        stiffness=stiffness,
        curvature=curvature,
        shape=shape,
        error=np.full(len(mesh.vertices), math.nan) if target is None else _errors(target, mesh),
        reachable=reachable,
        found=np.zeros(0, np.bool_)
        if target is None
        else _felt(surface, cloud, scan, reachable.position, config.gap),
        truth_known=target is not None,
    )


def _errors(target: SceneObject, mesh: SurfaceMesh) -> FloatArray:
    return target.signed_distance(mesh.vertices) if len(mesh.vertices) else np.zeros(0)


def ribbon_mesh(surface: SurfaceMap, voxel: float) -> SurfaceMesh:
    """Return the mesh of a map of a single line: a ribbon, all of it extrapolated.

    Beside a line the curvature of the surface is unknown, and on an edge its slope, too.
    """
    mesh = surface_mesh(surface, voxel, Knowledge.EXTRAPOLATED)
    return replace(mesh, knowledge=np.full(len(mesh.vertices), Knowledge.EXTRAPOLATED, np.int8))


def _felt(
    surface: SurfaceMap, cloud: TouchCloud, scan: Scan, reachable: FloatArray, gap: float
) -> npt.NDArray[np.bool_]:
    """Return which points of the true surface were felt, shape (n,): of a line, those with a contact nearby."""
    if not isinstance(scan, ContourScan):
        return surface.observes(reachable)
    near = np.asarray(KDTree(cloud.thinned(gap / THIN).position).query(reachable)[0])
    return np.asarray(near <= gap)


def neighbour_distance(cloud: TouchCloud, scan: Scan, gap: float) -> float:
    """Return how far apart on the surface lies what a map is to be made of, rows or taps [m].

    A contour is one line: its map is a ribbon, as wide as that of one row of many.
    """
    match scan:
        case ContourScan():
            return gap
        case TapScan():
            return tap_distance(cloud, gap)
        case ActiveScan():
            return row_distance(cloud, scan.prior)
        case _:
            return row_distance(cloud, gap)


def tap_distance(cloud: TouchCloud, spacing: float) -> float:
    """Return how far taps `spacing` apart are apart on the surface, to their nearest neighbours [m]."""
    taps = cloud.thinned(spacing / THIN)
    if len(taps) < 2:
        return spacing
    nearest = np.asarray(KDTree(taps.position).query(taps.position, 2)[0])[:, 1]
    nearest = nearest[nearest <= WIDEST_ROWS * spacing]
    return max(spacing, float(np.percentile(nearest, WIDE_PERCENT))) if len(nearest) else spacing


def points_per_row(thin: TouchCloud, row: float, spacing: float) -> float:
    """Return how many contacts, thinned to `spacing`, share one error, that of a length `row` [m]; at least 1.

    No more than half of them: at least two independent observations are needed.
    """
    return max(1.0, min(row / spacing, 0.5 * len(thin)))


def row_distance(cloud: TouchCloud, spacing: float) -> float:
    """Return how far rows that the tip's centre followed `spacing` apart are apart on the surface [m].

    In a hollow of radius R they spread by R / (R - r), r the tip's: a map that did not know would see holes there.
    """
    path = cloud.thinned(spacing / THIN)
    near = min(len(path), int(np.ceil(4.0 * SAME_ROW * THIN)))
    if near < 2:
        return spacing
    found = KDTree(path.position).query(path.position, near, distance_upper_bound=WIDEST_ROWS * spacing)
    distance, index = np.asarray(found[0]), np.asarray(found[1])
    own = np.arange(len(path))[:, None]
    nearest = np.where(np.abs(index - own) <= SAME_ROW * THIN, np.inf, distance).min(axis=1)
    nearest = nearest[np.isfinite(nearest)]
    return max(spacing, float(np.percentile(nearest, WIDE_PERCENT))) if len(nearest) else spacing


def shape_spacing(cloud: TouchCloud, spacing: float) -> float:
    """Return how far apart contacts are that a shape is fitted to [m]: so that there are enough of them."""
    length = len(cloud.thinned(spacing)) * spacing
    return min(spacing, max(length / SHAPE_CONTACTS, 1e-4))
