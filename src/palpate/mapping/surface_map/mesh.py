"""The observed surface as triangles, each corner with how well it is known."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.compiling import njit
from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.mapping.surface_map.estimate import Knowledge, half_widths
from palpate.mapping.surface_map.surface_map import SurfaceMap
from palpate.mapping.surface_map.surface_nets import IndexArray, surface_nets

BAND = 1.75
"""Half the thickness of the shell in which the surface is looked for, in voxels: no corner of a voxel that the
surface cuts is farther from it than the diagonal, sqrt(3)."""

BENT = 0.5
"""A contact's plane misses the surface at distance d by d^2 / (2 R): d / 2 at a radius of d. Corners farther from
the nearest contact's plane than that and the shell are not asked for."""

MAX_VOXELS = 60_000_000
"""More voxels than this in the box around what was felt are refused: half a gigabyte, a voxel in a wrong unit."""


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceMesh:
    """Triangles over what was felt. Holes are where nothing was: they are open edges, never closed over.

    Attributes:
        vertices: Shape (n, 3) [m], in the base frame.
        triangles: Indices of vertices, counterclockwise seen from outside, shape (m, 3).
        normals: Outward unit normals at vertices, shape (n, 3).
        sd: Standard deviation of each vertex along its normal from random errors, shape (n,) [m].
        bias: Largest constant offset beyond that [m].
        knowledge: Values of `Knowledge` at vertices, shape (n,).
        voxel: Edge of the grid that it was made on [m].
    """

    vertices: FloatArray
    triangles: IndexArray
    normals: FloatArray
    sd: FloatArray
    bias: float
    knowledge: npt.NDArray[np.int8]
    voxel: float

    def band(self, probability: float = 0.95) -> FloatArray:
        """Return half-widths that hold the true surface, as `SurfaceEstimate.band`, shape (n,) [m]."""
        return half_widths(self.sd, self.bias, probability)

    @property
    def open_edges(self) -> IndexArray:
        """Edges with a triangle on one side only, around holes and the rim, shape (k, 2)."""
        corners = self.triangles
        edges = np.sort(np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]), axis=1)
        unique, counts = np.unique(edges, axis=0, return_counts=True)
        return np.asarray(unique[counts == 1])

    @property
    def watertight(self) -> bool:
        """Whether the mesh has no open edge: everything was felt."""
        return len(self.triangles) > 0 and not len(self.open_edges)


def surface_mesh(surface: SurfaceMap, voxel: float = 0.5e-3, worst: Knowledge = Knowledge.OBSERVED) -> SurfaceMesh:
    """Return the zero level of the map's distance by surface nets, where it was felt.

    Args:
        surface: A map.
        voxel: Edge of the grid [m]. Vertices lie on the surface; a triangle misses it by 0.3 voxel^2 / R at most.
        worst: `OBSERVED` keeps what is claimed, `EXTRAPOLATED` also the rim within reach.

    Raises:
        InvalidValueError: `voxel` is not positive or so small that the grid does not fit.
    """
    h = positive("voxel", voxel, "m")
    if not len(surface.stretches):
        return _empty(surface.settings.bias, h)
    nearest, low = _nearest_on_grid(surface.stretches.position, surface.settings.reach + (BAND + 1.0) * h, h)
    index = np.argwhere(nearest >= 0)
    distance, known = _near_surface(surface, (low + index) * h, nearest[tuple(index.T)], h)
    if not known.any():
        return _empty(surface.settings.bias, h)
    index = index[known]
    values, given = np.ones(nearest.shape), np.zeros(nearest.shape, np.bool_)
    values[tuple(index.T)], given[tuple(index.T)] = distance, True
    raw, triangles = surface_nets(values, given)
    return _dressed(surface, (low + raw) * h, triangles, h, worst)


def _near_surface(
    surface: SurfaceMap, points: FloatArray, nearest: IndexArray, h: float
) -> tuple[FloatArray, npt.NDArray[np.bool_]]:
    """Return distances of those points that are within `BAND` of the surface, and which those are.

    Edges of voxels that the surface cuts have their ends within a voxel of it: distances of other points are those
    from the nearest contact's plane, for their sign.
    """
    normal = surface.stretches.normal[nearest]
    offset = points - surface.stretches.position[nearest]
    distance = (offset * normal).sum(axis=1)
    aside = np.sqrt(np.maximum((offset * offset).sum(axis=1) - distance * distance, 0.0))
    beyond = np.abs(distance) - BENT * aside
    asked = np.flatnonzero(beyond <= h)
    distance[asked] = surface.blend_at(points[asked], normal[asked]).distance
    beyond[asked] = np.abs(distance[asked])  # NaN where no patch reaches
    near = np.asarray(beyond <= BAND * h)
    return distance[near], near


def _dressed(
    surface: SurfaceMap, raw: FloatArray, triangles: IndexArray, h: float, worst: Knowledge
) -> SurfaceMesh:
    """Bring vertices onto the surface, drop what was not felt, and add what is known of the rest."""
    blend = surface.blend_at(raw, with_sd=True)
    vertices = raw - blend.distance[:, None] * blend.normal  # micrometres: normal and sd are the same there
    fine = np.isfinite(vertices).all(axis=1)
    knowledge = np.full(len(raw), Knowledge.UNOBSERVED, np.int8)
    knowledge[fine] = surface.knowledge_at(vertices[fine], blend.normal[fine])[0]
    kept = triangles[(knowledge[triangles] <= worst).all(axis=1)]
    used, numbered = np.unique(kept, return_inverse=True)
    return SurfaceMesh(
        vertices=vertices[used],
        triangles=numbered.reshape(-1, 3),
        normals=blend.normal[used],
        sd=blend.sd[used],
        bias=surface.settings.bias,
        knowledge=knowledge[used],
        voxel=h,
    )


def _empty(bias: float, h: float) -> SurfaceMesh:
    nowhere = np.zeros((0, 3))
    return SurfaceMesh(nowhere, np.zeros((0, 3), np.int64), nowhere, np.zeros(0), bias, np.zeros(0, np.int8), h)


def _nearest_on_grid(contacts: FloatArray, reach: float, h: float) -> tuple[IndexArray, FloatArray]:
    """Return which contact (m, 3) is nearest to each point of a grid, -1: none within `reach`; and its lowest."""
    cells = np.floor(contacts / h).astype(np.int64)
    pad = int(np.ceil(reach / h)) + 1
    low = cells.min(axis=0) - pad
    size = cells.max(axis=0) + pad + 1 - low + 1
    shape = (int(size[0]), int(size[1]), int(size[2]))
    if shape[0] * shape[1] * shape[2] > MAX_VOXELS:
        raise InvalidValueError(
            f"voxel = {h} m makes a grid of {shape}, more than {MAX_VOXELS} points: is it in metres?"
        )
    nearest = np.full(shape, -1, np.int64)
    _mark_nearest(nearest, contacts / h - low, reach / h)
    return nearest, low.astype(np.float64)


@njit(cache=True)
def _mark_nearest(nearest: IndexArray, contacts: FloatArray, reach: float) -> None:
    """Write the contact (m, 3) nearest to each point of a grid where it is within `reach`, both in its steps."""
    for each in range(len(contacts)):
        x, y, z = contacts[each]
        for i in range(math.ceil(x - reach), math.floor(x + reach) + 1):
            for j in range(math.ceil(y - reach), math.floor(y + reach) + 1):
                left = reach * reach - (i - x) ** 2 - (j - y) ** 2
                if left < 0.0:
                    continue
                half = math.sqrt(left)
                for k in range(math.ceil(z - half), math.floor(z + half) + 1):
                    other = nearest[i, j, k]
                    if other >= 0:
                        u, v, w = contacts[other]
                        if (i - u) ** 2 + (j - v) ** 2 + (k - w) ** 2 <= (i - x) ** 2 + (j - y) ** 2 + (
                            k - z
                        ) ** 2:
                            continue
                    nearest[i, j, k] = each
