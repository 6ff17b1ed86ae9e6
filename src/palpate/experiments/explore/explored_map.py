"""The map of an exploration: contacts, surface, mesh, friction, stiffness, curvature and shape."""

import math
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.errors import FloatArray
from palpate.estimation import Assumption, Verdict
from palpate.experiments.explore.error_budget import MapBudget
from palpate.experiments.explore.named_shape import NamedShape, named_shape
from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.explore.reachable_surface import ReachableSurface
from palpate.experiments.explore.scan import Scan
from palpate.experiments.kit.recorded_run import ProgressCallback
from palpate.mapping import (
    Knowledge,
    MapSettings,
    SurfaceMap,
    SurfaceMesh,
    SurfaceModel,
    TouchCloud,
    surface_mesh,
)
from palpate.mapping.arc_bins import stretch_means, stretch_starts
from palpate.mapping.curvature_layers import curvature_layers
from palpate.mapping.layers import VertexDirection, VertexLayer, vertex_layer
from palpate.mapping.mesh_metrics import voxel_for
from palpate.mapping.stiffness import local_stiffness, stiffness_layer
from palpate.runtime import Phase, Record, SensorFinger
from palpate.runtime.log.standard.cloud import Cloud
from palpate.sim import SceneObject

MAX_VERTICES = 60_000
"""About the largest number of vertices of a mesh: some seconds, and more than a figure shows."""

_MAX_ROW_RATIO = 2.0
"""Largest distance of neighbouring rows, relative to the planned one: a wider gap is a hole."""

_ROW_PERCENT = 95.0
"""Percentage of the contacts whose next row is nearer than the distance of rows that the map assumes."""

_SAME_ROW_RATIO = 3.0
"""Path length between contacts of one row, relative to the distance of rows."""

_THINNING_RATIO = 4.0
"""Distance of rows over the distance to which contacts are thinned."""

_MIN_SHAPE_SHARE = 0.25
"""Least observed share of the reachable area that rules out a shape: less is a run that was cut short."""

_MAX_RELATIVE_ACCELERATION = 1.0
"""Largest change of speed per second in a friction measurement, relative to the speed: while a tip speeds up or
brakes, simulated friction is not Coulomb's (MuJoCo counts the acceleration as slip)."""

_SPEED_WINDOW_S = 0.04
"""Time over which a change of speed is computed [s]: 1 % of noise in a velocity is 0.35 per second in it."""

_MIN_SLIDING_SPEED = 5e-4
"""Least speed of a sliding tip [m/s]: half the slowest scan; a tap does not measure friction."""

_MIN_STIFFNESS_WINDOW = 4e-3
"""Shortest path length over which stiffness is estimated [m]."""

_MAX_PAUSE_S = 0.1
"""Longest pause between contacts of one stretch [s]."""


@dataclass(frozen=True, slots=True)
class LayerSummary:
    """Distribution of a layer over the part of the map where it is known.

    Attributes:
        median: Median, rounded to the second digit of its deviation.
        low: 5th percentile, rounded alike.
        high: 95th percentile, rounded alike.
        sd: Median standard deviation; NaN if unknown.
        share: Share of the vertices where the layer is known.
    """

    median: float
    low: float
    high: float
    sd: float
    share: float


def rounded_to(value: float, sd: float) -> float:
    """Return a value rounded to the second digit of its deviation: 8e-6 with a deviation of 0.1 is 0."""
    return round(value, 1 - math.floor(math.log10(sd))) + 0.0 if 0.0 < sd < math.inf else value


def felt_in_scan(record: Record) -> npt.NDArray[np.bool_]:
    """Return the periods that give a point of the map as a mask, shape (n,)."""
    return np.asarray((record.phase == Phase.SCAN.value) & record.touching & (record.status == 0))


def touch_cloud(plan: ExplorationPlan, record: Record) -> TouchCloud:
    """Return the points of the object's surface that a scan touched.

    The centroid lies in the middle of the overlap of the undeformed tip and object. The object's own half of the
    compression is subtracted along the normal; so is the tip's compression beyond that of its sensed surface,
    which is described at the requested force.
    """
    kept = felt_in_scan(record)
    normal, force = -record.normal[kept], record.normal_force[kept]
    offset = plan.half_compliance * (2.0 * force - plan.config.force)
    return TouchCloud(
        time=record.time[kept],
        position=record.centroid[kept] + offset[:, None] * normal,
        normal=normal,
        normal_force=force,
        tangential_force=record.tangential_force[kept],
        spin_torque=record.spin_torque[kept],
    )


@dataclass(frozen=True, slots=True, eq=False)
class ExploredMap:
    """Surface by an exploration, with its uncertainty.

    Attributes:
        surface: Map that can be queried.
        mesh: Observed part as triangles. The mesh of a contour, a single line, is the ribbon along it, which is
            extrapolated and not claimed; see `SurfaceMesh.knowledge`.
        budget: Largest constant offset, by origin; the bias of the map's settings.
        friction: Tangential over normal force while sliding, at the vertices of the mesh.
        stiffness: Stiffness of the object alone at the vertices [N/m]; known where the force varied.
        curvature: Curvatures at the vertices; see `palpate.mapping.curvature_layers`. Empty for a line, which was
            felt along its own direction only.
        shape: Geometric primitive; None where contacts are too few to decide.
        error: Signed distance of each vertex to the true surface, positive outside, shape (n,) [m].
        reachable: Samples of the true surface that the tip could have felt along its path.
        found: Mask of the observed samples.
        truth_known: Whether the true surface is known; else `error` is NaN and `reachable` empty.
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
        """Quantities at the vertices, for a file."""
        return (self.friction, self.stiffness, *self.curvature)

    @property
    def verdict(self) -> Verdict:
        """Assumptions of the map that the contacts contradict; a line claims no surface, only outliers count."""
        broken = self.surface.verdict.broken
        return Verdict(tuple(b for b in broken if not self.is_line or b.assumption is Assumption.NO_OUTLIERS))

    @property
    def claimed(self) -> npt.NDArray[np.bool_]:
        """Mask of the observed vertices, shape (n,)."""
        return np.asarray(self.mesh.knowledge == Knowledge.OBSERVED)

    @property
    def is_line(self) -> bool:
        """Whether the mesh is only a ribbon along a line, which claims no surface."""
        return bool(len(self.mesh.knowledge)) and not bool(self.claimed.any())

    @property
    def felt_little(self) -> bool:
        """Whether too little was felt to rule out a shape: a line, or a small share of the reachable area."""
        return self.is_line or self.observed_share < _MIN_SHAPE_SHARE

    @property
    def rms(self) -> float:
        """RMS distance of the claimed vertices to the true surface [m]; NaN without any."""
        error = self.error[self.claimed]
        return float(np.sqrt(np.mean(np.square(error)))) if len(error) else math.nan

    @property
    def largest_error(self) -> float:
        """Largest distance of the claimed vertices to the true surface [m]; NaN without any."""
        error = np.abs(self.error[self.claimed])
        return float(error.max()) if len(error) else math.nan

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
        """Observed share of the reachable area; NaN if nothing could be reached."""
        area = self.reachable.area
        return float(area[self.found].sum() / area.sum()) if len(area) else math.nan

    @property
    def shape_name(self) -> str | None:
        """Name of the shape, or that it is unclear; None where contacts are too few to decide."""
        shape = self.shape
        if shape is None:
            return None
        if shape.kind is not None:
            return shape.kind.value
        if shape.possible and not self.felt_little:
            return f"unclear: {' or '.join(kind.value for kind in shape.possible)}"
        return "unclear" if self.felt_little else "none of these"

    def layer(self, name: str) -> LayerSummary | None:
        """Return the distribution of a layer, by its name; None if it is unknown everywhere."""
        layer = next((each for each in self.layers if each.name == name and isinstance(each, VertexLayer)), None)
        if layer is None or not np.isfinite(layer.mean).any():
            return None
        known, sds = np.isfinite(layer.mean), layer.sd[np.isfinite(layer.sd)]
        sd = float(np.median(sds)) if len(sds) else math.nan
        spread = np.percentile(layer.mean[known], [50.0, 5.0, 95.0]).tolist()
        median, low, high = (rounded_to(each, sd) for each in spread)
        return LayerSummary(median, low, high, sd, float(known.mean()))

    @property
    def cloud(self) -> Cloud | None:
        """Vertices with normals, band [m] and layers as points for viewers; None if the mesh is empty."""
        mesh = self.mesh
        if not len(mesh.vertices):
            return None
        values = {f"normal_{axis}": mesh.normals[:, i] for i, axis in enumerate("xyz")} | {"band": mesh.band()}
        values |= {layer.name: layer.mean for layer in self.layers if isinstance(layer, VertexLayer)}
        return Cloud(mesh.vertices, values)


def explored_map(
    plan: ExplorationPlan,
    record: Record,
    cloud: TouchCloud,
    target: SceneObject | None,
    budget: MapBudget,
    progress: ProgressCallback,
) -> ExploredMap:
    """Return the map of a scan's contacts.

    Args:
        plan: Plan of the run.
        record: Record of the run.
        cloud: Contacts of the scan, at least one; from `touch_cloud`.
        target: True object; None if unknown.
        budget: Error budget from `map_budget`.
        progress: Called with the name of each step.
    """
    progress("fitting the map")
    config, scan, line = plan.config, plan.scan, plan.scan.kind == "contour"
    rows = _neighbour_distance(cloud, scan)
    usual = SurfaceModel()  # normals that the sensor's calibration tilts from row to row are no relief
    model = replace(usual, tilt=max(usual.tilt, budget.tilt))
    surface = SurfaceMap.learned(cloud, MapSettings.for_rows(rows, model=model, bias=budget.total))
    progress("cutting the mesh")
    voxel = voxel_for(cloud.position, config.map_spacing, MAX_VERTICES)
    mesh = ribbon_mesh(surface, voxel) if line else surface_mesh(surface, voxel)
    progress("friction, stiffness and curvature")
    speed = np.linalg.norm(record.velocity[felt_in_scan(record)], axis=1)
    friction = _friction(mesh, cloud, speed, config.gap)
    if config.force_swing:
        stiffness = _stiffness(mesh, plan, record, surface.model, rows)
    else:  # force errors at edges are no deliberate press: they would give a wrong stiffness
        unknown = np.full(len(mesh.vertices), math.nan)
        stiffness = VertexLayer("stiffness", unknown, unknown)
    curvature = () if line else curvature_layers(surface, mesh)
    progress("which shape it is")
    # 400 contacts, or, where rows are close, one every distance of rows
    apart = min(config.gap, max(len(cloud.thinned(config.gap)) * config.gap / 400, 1e-4))
    per_row = points_per_row(cloud.thinned(apart), scan.row, apart)
    shape = named_shape(cloud, apart, per_row, budget, surface.model, offset_sd=plan.tip_uncertainty.size_sd)
    progress("comparing with the truth")
    error, reachable = np.full(len(mesh.vertices), math.nan), ReachableSurface.unknown()
    found = np.zeros(0, np.bool_)
    if target is not None:
        error = target.signed_distance(mesh.vertices) if len(mesh.vertices) else error
        reachable = ReachableSurface.of(target, config, scan)
        if line:  # beside the line nothing is observed: samples with a contact nearby count
            near = KDTree(cloud.thinned(config.gap / _THINNING_RATIO).position).query(reachable.position)[0]
            found = np.asarray(near) <= config.gap
        else:
            found = surface.observes(reachable.position)
    return ExploredMap(
        surface,
        mesh,
        budget,
        friction,
        stiffness,
        curvature,
        shape,
        error,
        reachable,
        found,
        truth_known=target is not None,
    )


def ribbon_mesh(surface: SurfaceMap, voxel: float) -> SurfaceMesh:
    """Return the mesh of a map of a single line: a ribbon, all of it extrapolated.

    Beside a line the curvature of the surface is unknown, and on an edge its slope, too.
    """
    mesh = surface_mesh(surface, voxel, Knowledge.EXTRAPOLATED)
    return replace(mesh, knowledge=np.full(len(mesh.vertices), Knowledge.EXTRAPOLATED, np.int8))


def _friction(mesh: SurfaceMesh, slid: TouchCloud, speed: FloatArray, rows: float) -> VertexLayer:
    """Return tangential over normal force from sliding contacts, averaged over short stretches.

    Args:
        mesh: Mesh of the map.
        slid: Contacts of the scan.
        speed: Speed of the tip at each contact, shape (n,) [m/s].
        rows: Distance of rows [m].
    """
    # slower, around corners, friction may not be fully developed
    fast = ~(speed <= max(0.5 * float(np.median(speed)), _MIN_SLIDING_SPEED))
    half = 0.5 * _SPEED_WINDOW_S
    before, after = (np.interp(slid.time + shift, slid.time, speed) for shift in (-half, half))
    change = np.abs(after - before) / (_SPEED_WINDOW_S * np.maximum(speed, _MIN_SLIDING_SPEED))
    steady = fast & (change <= _MAX_RELATIVE_ACCELERATION)
    slid = slid.select(steady if steady.any() else fast)
    ratio = np.linalg.norm(slid.tangential_force, axis=1) / slid.normal_force
    starts = stretch_starts(slid.time, slid.position, slid.normal, rows / _THINNING_RATIO, _MAX_PAUSE_S)
    position, value = (stretch_means(each, starts) for each in (slid.position, ratio))
    return vertex_layer("friction", mesh.vertices, position, value, rows)


def _stiffness(
    mesh: SurfaceMesh, plan: ExplorationPlan, record: Record, model: SurfaceModel, rows: float
) -> VertexLayer:
    """Return the stiffness of the object alone [N/m]; unknown where the force did not vary.

    Args:
        mesh: Mesh of the map.
        plan: Plan of the run.
        record: Record of the run.
        model: Noise of contacts by the map.
        rows: Distance of rows, or of taps, on the surface [m].
    """
    kept, finger = felt_in_scan(record), plan.fingers[0]
    speed = np.linalg.norm(record.velocity[kept], axis=1)
    # over a whole swing: drift, such as normals tilted by a sensor's cross-talk, is not mistaken for compression
    window = max(_MIN_STIFFNESS_WINDOW, plan.config.force_period * float(np.median(speed)))
    found = local_stiffness(
        record.time[kept],
        record.centroid[kept],
        -record.normal[kept],
        record.normal_force[kept],
        noise=model,
        window=window,
        force_noise=max(finger.sensor.noise[:3]) if isinstance(finger, SensorFinger) else plan.config.noise[0],
        known_compliance=plan.half_compliance,
    )
    # windows overlap by halves: along the path the nearest is a quarter of one away at most
    return stiffness_layer(found, mesh.vertices, math.hypot(0.25 * window, rows))


def _neighbour_distance(cloud: TouchCloud, scan: Scan) -> float:
    """Return the distance on the surface of the rows or taps that make a map [m].

    A contour is one line: its map is a ribbon, as wide as that of one row of many.
    """
    if scan.kind == "contour":
        return scan.row_gap
    return (tap_distance if scan.kind == "taps" else row_distance)(cloud, scan.row_gap)


def tap_distance(cloud: TouchCloud, spacing: float) -> float:
    """Return the distance on the surface of taps that are planned `spacing` apart, to their neighbours [m]."""
    taps = cloud.thinned(spacing / _THINNING_RATIO)
    if len(taps) < 2:
        return spacing
    nearest = np.asarray(KDTree(taps.position).query(taps.position, 2)[0])[:, 1]
    return _wide(nearest[nearest <= _MAX_ROW_RATIO * spacing], spacing)


def row_distance(cloud: TouchCloud, spacing: float) -> float:
    """Return the distance on the surface of rows that the tip's centre followed `spacing` apart [m].

    In a hollow of radius R they spread by R / (R - r), with the tip's radius r: a map that ignored this would see
    holes there.
    """
    path = cloud.thinned(spacing / _THINNING_RATIO)
    near = min(len(path), int(np.ceil(4.0 * _SAME_ROW_RATIO * _THINNING_RATIO)))
    if near < 2:
        return spacing
    found = KDTree(path.position).query(path.position, near, distance_upper_bound=_MAX_ROW_RATIO * spacing)
    distance, index = np.asarray(found[0]), np.asarray(found[1])
    own = np.arange(len(path))[:, None]
    nearest = np.where(np.abs(index - own) <= _SAME_ROW_RATIO * _THINNING_RATIO, np.inf, distance).min(axis=1)
    return _wide(nearest[np.isfinite(nearest)], spacing)


def _wide(nearest: FloatArray, spacing: float) -> float:
    return max(spacing, float(np.percentile(nearest, _ROW_PERCENT))) if len(nearest) else spacing


def points_per_row(thin: TouchCloud, row: float, spacing: float) -> float:
    """Return the number of contacts, thinned to `spacing`, that share one error over `row` [m]; at least 1.

    No more than half of them: at least two independent observations are needed.
    """
    return max(1.0, min(row / spacing, 0.5 * len(thin)))
