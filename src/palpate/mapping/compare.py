"""How far a map of a surface is from the surface: errors, coverage, Hausdorff distance, normals."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.mapping.compare_alignment import Alignment, align
from palpate.mapping.compare_surface import TriangleSurface

SAMPLES = 20_000
"""Points spread over each mesh: on 100 cm^2 one per 0.5 mm^2, so 0.7 mm apart."""

WRONG_UNIT = 30.0
"""Ratio of extents from which on units are in doubt: a touched patch is smaller than its object, but mm and m are
1000 apart."""


@dataclass(frozen=True, slots=True, eq=False)
class TouchedMap:
    """What is compared: points, and the triangles between them if there are any.

    Attributes:
        points: Shape (n, 3) [m].
        normals: Outward unit normals, shape (n, 3), if known.
        surface: The map as a mesh, if it is one; `points` and `normals` are then samples of it.
    """

    points: FloatArray
    normals: FloatArray | None = None
    surface: TriangleSurface | None = None

    @classmethod
    def of_mesh(cls, surface: TriangleSurface, samples: int = SAMPLES) -> "TouchedMap":
        """Return a mesh with `samples` points spread over it."""
        points, normals = surface.samples(samples)
        return cls(points, normals, surface)


@dataclass(frozen=True, slots=True)
class DistanceSpread:
    """Of absolute distances [m].

    Attributes:
        mean: Mean.
        rms: Root mean square.
        p50: Median.
        p95: 95th percentile.
        p99: 99th percentile.
        largest: Largest: the one-sided Hausdorff distance, as far as the samples can tell.
    """

    mean: float
    rms: float
    p50: float
    p95: float
    p99: float
    largest: float

    @classmethod
    def of(cls, distance: FloatArray) -> "DistanceSpread":
        """Return that of `distance` (n,), n at least 1."""
        size = np.abs(distance)
        p50, p95, p99 = np.percentile(size, [50.0, 95.0, 99.0]).tolist()
        return cls(float(size.mean()), float(np.sqrt((size**2).mean())), p50, p95, p99, float(size.max()))


@dataclass(frozen=True, slots=True, eq=False)
class Comparison:
    """A map against a reference.

    Attributes:
        distance: Of each map point from the reference surface, signed (positive outside) if it is watertight,
            shape (n,) [m].
        points: Map points, aligned if asked for, shape (n, 3) [m].
        normal_error: Angle between the map's and the reference's normal at each point, shape (n,) [rad], if the
            map has normals.
        map_to_reference: Of `distance`.
        reference_to_map: Of distances of samples of the reference (within the region) from the map.
        reference_points: Those samples, shape (k, 3) [m].
        reference_distance: Their distances from the map, shape (k,) [m].
        bias: Mean of the signed distance [m]; NaN if it has no sign.
        coverage: Share of the reference's area (within the region) that is no further than `within` from the map.
        within: [m].
        sample_spacing: Mean distance between neighbouring samples of the reference [m].
        alignment: How the map was moved first, if asked for.
    """

    distance: FloatArray
    points: FloatArray
    normal_error: FloatArray | None
    map_to_reference: DistanceSpread
    reference_to_map: DistanceSpread
    reference_points: FloatArray
    reference_distance: FloatArray
    bias: float
    coverage: float
    within: float
    sample_spacing: float
    alignment: Alignment | None

    @property
    def hausdorff(self) -> float:
        """The larger of both largest distances [m]."""
        return max(self.map_to_reference.largest, self.reference_to_map.largest)


def compare(
    touched: TouchedMap,
    reference: TriangleSurface,
    *,
    within: float = 1e-3,
    region: tuple[npt.ArrayLike, npt.ArrayLike] | None = None,
    aligned: bool = False,
    samples: int = SAMPLES,
) -> Comparison:
    """Compare a map with a reference mesh, by distance to the surface rather than to its vertices.

    The reference has a chord error of its own: an icosphere of radius 20 mm with 4, 5, 6 subdivisions lies up to
    0.023, 0.0057, 0.0014 mm inside the sphere.

    Args:
        touched: The map.
        reference: The true surface.
        within: Distance from the map up to which the reference counts as covered [m].
        region: Lower and upper corner (3,) [m] of the reachable part of the reference; all of it if not given.
        aligned: Whether to move the map onto the reference first, which hides errors of position.
        samples: Points spread over the whole reference.

    Raises:
        InvalidValueError: No points, a wrong value, a region without any reference, or extents that speak of
            different units.
    """
    within = positive("within", within, "m")
    if not len(touched.points):
        raise InvalidValueError("the map has no points: nothing to compare")
    if not np.isfinite(touched.points).all():
        at = int(np.flatnonzero(~np.isfinite(touched.points).all(axis=1))[0])
        raise InvalidValueError(f"point {at} of the map is {touched.points[at].tolist()}: must be finite [m]")
    refuse_other_unit(touched.points, reference.vertices)
    alignment = align(touched.points, reference) if aligned else None
    points, normals, surface = touched.points, touched.normals, touched.surface
    if alignment is not None:
        points = points @ alignment.rotation.T + alignment.shift
        normals = None if normals is None else normals @ alignment.rotation.T
        if surface is not None:
            moved = surface.vertices @ alignment.rotation.T + alignment.shift
            surface = TriangleSurface(moved, surface.triangles)
    near = reference.nearest(points)
    targets = reference.samples(samples)[0]
    if region is not None:
        targets = targets[_inside(targets, region)]
    back = _distance_to_map(targets, points, surface)
    error = None
    if normals is not None:
        cosine = (normals * near.normal).sum(axis=1)
        error = np.arctan2(np.linalg.norm(np.cross(normals, near.normal), axis=1), cosine)
    return Comparison(
        distance=near.distance,
        points=points,
        normal_error=error,
        map_to_reference=DistanceSpread.of(near.distance),
        reference_to_map=DistanceSpread.of(back),
        reference_points=targets,
        reference_distance=back,
        bias=float(near.distance.mean()) if reference.is_watertight else float("nan"),
        coverage=float((back <= within).mean()),
        within=within,
        sample_spacing=float(np.sqrt(reference.area / samples)),
        alignment=alignment,
    )


def refuse_other_unit(points: FloatArray, vertices: FloatArray) -> None:
    """Raise if the extents of map and reference are so different that one must be in another unit.

    Raises:
        InvalidValueError: With the likely remedy.
    """
    mine = float(np.linalg.norm(np.ptp(points, axis=0)))
    theirs = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if mine <= 0.0 or theirs <= 0.0 or 1.0 / WRONG_UNIT < mine / theirs < WRONG_UNIT:
        return
    larger, remedy = ("map", "--map-unit mm") if mine > theirs else ("reference", "--reference-unit mm")
    if mine < theirs and theirs < 10.0:  # an object of metres: the map is but a small part of it
        return
    raise InvalidValueError(
        f"the map is {mine:.3g} m across and the reference {theirs:.3g} m: the {larger} seems to be in "
        f"millimetres; add {remedy}"
    )


def _inside(points: FloatArray, region: tuple[npt.ArrayLike, npt.ArrayLike]) -> npt.NDArray[np.bool_]:
    low, high = (np.asarray(corner, dtype=np.float64) for corner in region)
    if low.shape != (3,) or high.shape != (3,) or not (low < high).all():
        raise InvalidValueError(f"region = {region!r}: must be lower and upper corner, three numbers each [m]")
    inside = ((points >= low) & (points <= high)).all(axis=1)
    if not inside.any():
        raise InvalidValueError(
            f"region from {low.tolist()} to {high.tolist()} m: the reference has nothing there; it is from "
            f"{points.min(axis=0).round(4).tolist()} to {points.max(axis=0).round(4).tolist()} m"
        )
    return np.asarray(inside)


def _distance_to_map(targets: FloatArray, points: FloatArray, surface: TriangleSurface | None) -> FloatArray:
    if surface is not None:
        return np.abs(surface.nearest(targets).distance)
    from scipy.spatial import KDTree  # only clouds need it

    return np.asarray(KDTree(points).query(targets)[0], dtype=np.float64)
