"""A mesh in three numbers: how much was observed, and how well; and how fine a mesh may be to stay small."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.mapping.surface_map.estimate import Knowledge
from palpate.mapping.surface_map.mesh import SurfaceMesh

MAX_VOXELS = 2e7
"""Of the box around a mesh: a third of what `surface_mesh` takes."""

RIM = 10.0
"""Voxels on either side of what was felt, into which a mesh may reach."""

TAIL = 0.95
"""Share of the area whose standard deviation is below `MeshMetrics.tail`."""


@dataclass(frozen=True, slots=True)
class MeshMetrics:
    """What is known of a surface, by its observed area.

    Attributes:
        area: Observed [m^2].
        middle: Half of it has a smaller standard deviation [m]; NaN without any area.
        tail: 95 % of it have a smaller standard deviation [m]; NaN likewise.
    """

    area: float
    middle: float
    tail: float

    @classmethod
    def of(cls, mesh: SurfaceMesh, worst: Knowledge = Knowledge.OBSERVED) -> "MeshMetrics":
        """Return the metrics of a mesh, of those triangles alone that are known no worse than `worst`."""
        corners = mesh.triangles[known_triangles(mesh, worst)]
        area = triangle_areas(mesh.vertices, corners)
        if not area.sum() > 0.0:
            return cls(0.0, math.nan, math.nan)
        sd = mesh.sd[corners].mean(axis=1)
        order = np.argsort(sd)
        share = np.cumsum(area[order]) / area.sum()
        last = len(sd) - 1
        middle, tail = (float(sd[order[min(int(np.searchsorted(share, at)), last)]]) for at in (0.5, TAIL))
        return cls(float(area.sum()), middle, tail)


def known_triangles(mesh: SurfaceMesh, worst: Knowledge) -> npt.NDArray[np.bool_]:
    """Return which triangles have no corner that is known worse than `worst`, shape (m,)."""
    return np.asarray((mesh.knowledge[mesh.triangles] <= worst).all(axis=1))


def triangle_areas(vertices: FloatArray, triangles: npt.NDArray[np.int64]) -> FloatArray:
    """Return the areas of triangles (m, 3) between vertices (n, 3) [m], shape (m,) [m^2]."""
    a, b, c = (vertices[triangles[:, i]] for i in range(3))
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def voxel_for(points: FloatArray, finest: float, most_vertices: int) -> float:
    """Return the edge of a grid on which a mesh stays small enough [m], at least `finest`.

    Args:
        points: On the surface, shape (n, 3) [m].
        finest: What is wanted if there is room for it [m].
        most_vertices: About so many at most, of a surface that fills its box once.
    """
    if not len(points):
        return finest
    extent = np.ptp(points, axis=0) + 2.0 * RIM * finest
    area = float(np.sort(extent)[1:].prod())
    return max(finest, math.sqrt(area / most_vertices), math.cbrt(float(extent.prod()) / MAX_VOXELS))
