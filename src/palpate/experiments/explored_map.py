"""The map that an exploration makes: surface, mesh, budget of errors, friction, and which shape it is."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

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
from palpate.mapping.layers import VertexLayer, vertex_layer
from palpate.sim import SceneObject

MOST_VERTICES = 60_000
"""About so many vertices at most: some seconds, and more than a picture shows."""

MOST_VOXELS = 2e7
"""Of the box around a mesh: a third of what `surface_mesh` takes."""

SLIDES = 0.25
"""Of the usual speed of a scan: slower, around corners, friction may not be all there yet."""

THIN = 4.0
"""Friction is averaged over stretches of the rows' distance over this."""

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
    surface = SurfaceMap.learned(cloud, MapSettings.for_rows(config.spacing, bias=budget.total))
    tell(STEPS[1])
    mesh = surface_mesh(surface, voxel_for(cloud, config.map_spacing))
    tell(STEPS[2])
    friction = friction_layer(cloud, speed, mesh, config.spacing)
    tell(STEPS[3])
    shape = named_shape(cloud.thinned(config.spacing), config.width / config.spacing, budget, surface.model)
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


def friction_layer(cloud: TouchCloud, speed: FloatArray, mesh: SurfaceMesh, rows: float) -> VertexLayer:
    """Return tangential over normal force at the vertices, from contacts that slid.

    Forces are averaged over short stretches first: the length of a noisy force is too large on the average.
    """
    if not len(cloud):
        return vertex_layer("friction", mesh.vertices, np.zeros((0, 3)), np.zeros(0), rows)
    thin = cloud.select(speed > SLIDES * float(np.median(speed))).thinned(rows / THIN)
    ratio = np.linalg.norm(thin.tangential_force, axis=1) / thin.normal_force
    return vertex_layer("friction", mesh.vertices, thin.position, ratio, rows)
