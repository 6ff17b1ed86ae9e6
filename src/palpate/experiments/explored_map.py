"""The map that an exploration makes: surface, mesh, budget of errors, friction, and which shape it is."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray
from palpate.experiments.explore_config import ExploreConfig
from palpate.experiments.map_budget import MapBudget
from palpate.experiments.named_shape import NamedShape, named_shape
from palpate.experiments.reachable_surface import ReachableSurface
from palpate.mapping import (
    MapSettings,
    SurfaceMap,
    SurfaceMesh,
    TouchCloud,
    surface_mesh,
)
from palpate.mapping.arc_bins import stretch_means, stretch_starts
from palpate.mapping.layers import VertexLayer, vertex_layer
from palpate.sim import SceneObject

MOST_VERTICES = 60_000
"""About so many vertices at most: some seconds, and more than a picture shows."""

MOST_VOXELS = 2e7
"""Of the box around a mesh: a third of what `surface_mesh` takes."""

SLIDES = 0.5
"""Of the usual speed of a scan: slower, around corners, friction may not be all there yet."""

WIDEST_ROWS = 2.0
"""Rows count as neighbours up to so many times the distance at which they were to be: a wider gap is a hole."""

WIDE_PERCENT = 95.0
"""Of the contacts have the next row nearer than what a map takes for the distance of rows."""

SAME_ROW = 3.0
"""Contacts up to so many distances of rows apart along the path are of one row."""

THIN = 4.0
"""Friction is averaged over stretches of the rows' distance over this."""

SHAPE_CONTACTS = 400
"""A shape is fitted to so many contacts, or, where rows are close, to one every distance of rows."""

LONGEST_PAUSE = 0.1
"""Between contacts of one stretch [s]."""

STEPS = ("fitting the map", "cutting the mesh", "friction", "which shape it is", "comparing with the truth")
"""What is done, in order, for whoever shows progress."""

Tell = Callable[[str], None]
"""Takes the name of a step, when it begins."""


@dataclass(frozen=True, slots=True, eq=False)
class ExploredMap:
    """What an exploration knows of the surface, and how well.

    Attributes:
        surface: The map itself, which answers questions.
        mesh: Its observed part as triangles.
        budget: Largest constant offset, by origin; the bias of the map's settings.
        friction: Tangential over normal force while sliding, at the vertices of the mesh.
        shape: Which shape it is; None where too little was felt to say.
        error: Signed distance of each vertex to the true surface, positive outside, shape (n,) [m].
        reachable: The part of the true surface that the tip could have felt on its way, as samples.
        found: Which of those are observed.
    """

    surface: SurfaceMap
    mesh: SurfaceMesh
    budget: MapBudget
    friction: VertexLayer
    shape: NamedShape | None
    error: FloatArray
    reachable: ReachableSurface
    found: npt.NDArray[np.bool_]

    @property
    def rms(self) -> float:
        """RMS distance of the vertices to the true surface [m]; NaN without any."""
        return float(np.sqrt(np.mean(np.square(self.error)))) if len(self.error) else math.nan

    @property
    def covered(self) -> float:
        """Share of true errors inside the 95 % band; NaN without vertices."""
        return float(np.mean(np.abs(self.error) <= self.mesh.band())) if len(self.error) else math.nan

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
    cloud: TouchCloud,
    speed: FloatArray,
    target: SceneObject,
    config: ExploreConfig,
    budget: MapBudget,
    tell: Tell = lambda step: None,
) -> ExploredMap:
    """Return the map of what was felt.

    Args:
        cloud: From the scan.
        speed: Of the tip at each contact, shape (n,) [m/s].
        target: What was touched, for the truth.
        config: What was asked for.
        budget: From `map_budget`.
        tell: Told of each step of `STEPS`.
    """
    tell(STEPS[0])
    surface = SurfaceMap.learned(
        cloud, MapSettings.for_rows(row_distance(cloud, config.spacing), bias=budget.total)
    )
    tell(STEPS[1])
    mesh = surface_mesh(surface, voxel_for(cloud, config.map_spacing))
    tell(STEPS[2])
    friction = friction_layer(cloud, speed, mesh, config.spacing)
    tell(STEPS[3])
    thin = shape_spacing(cloud, config.spacing)
    shape = named_shape(cloud.thinned(thin), config.width / thin, budget, surface.model)
    tell(STEPS[4])
    reachable = ReachableSurface.of(target, config)
    return ExploredMap(
        surface=surface,
        mesh=mesh,
        budget=budget,
        friction=friction,
        shape=shape,
        error=target.signed_distance(mesh.vertices) if len(mesh.vertices) else np.zeros(0),
        reachable=reachable,
        found=surface.query(reachable.position).observed,
    )


def voxel_for(cloud: TouchCloud, finest: float) -> float:
    """Return the edge of a grid on which the mesh stays small enough [m], at least `finest`."""
    if not len(cloud):
        return finest
    extent = np.ptp(cloud.position, axis=0) + 20.0 * finest
    area = float(np.sort(extent)[1:].prod())
    return max(finest, math.sqrt(area / MOST_VERTICES), math.cbrt(float(extent.prod()) / MOST_VOXELS))


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


def friction_layer(cloud: TouchCloud, speed: FloatArray, mesh: SurfaceMesh, rows: float) -> VertexLayer:
    """Return tangential over normal force at vertices, from contacts that slid, averaged over short stretches."""
    slid = cloud.select(speed > SLIDES * float(np.median(speed))) if len(cloud) else cloud
    ratio = np.linalg.norm(slid.tangential_force, axis=1) / slid.normal_force
    starts = stretch_starts(slid.time, slid.position, slid.normal, rows / THIN, LONGEST_PAUSE)
    position, value = (stretch_means(each, starts) for each in (slid.position, ratio))
    return vertex_layer("friction", mesh.vertices, position, value, rows)
