"""The zero level of values on a grid as triangles: surface nets (Gibson 1998).

One vertex a cube that the surface cuts, in the middle of where it cuts the cube's edges; around each edge that it
cuts, the four cubes there make a quadrilateral. So triangles are of about the same size, where marching cubes make
slivers, and with vertices on a sphere they miss it by 0.3 h^2 / R at most (marching cubes: 0.36).
"""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray

IndexArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


def surface_nets(values: FloatArray, given: BoolArray) -> tuple[FloatArray, IndexArray]:
    """Return the surface between values below zero and the others.

    Args:
        values: At the points of a grid, shape (k, l, m).
        given: Which of them are known, the same shape. Only cubes with eight known corners hold surface, so that
            it ends, with open edges, where they do.

    Returns:
        Vertices in steps of the grid, shape (n, 3), and triangles as indices of vertices, shape (t, 3),
        counterclockwise seen from where values are not below zero.
    """
    middles, edges, rising = _cut_edges(values, given)
    cubes, closed = _cubes_around(edges, _whole(given))
    names, vertex = np.unique(cubes[cubes >= 0], return_inverse=True)
    cuts = middles[np.nonzero(cubes >= 0)[0]]
    count = np.bincount(vertex, minlength=len(names))
    vertices = np.column_stack([np.bincount(vertex, cut, len(names)) / count for cut in cuts.T])
    around = np.where(rising[:, None], cubes, cubes[:, ::-1])[closed]
    return vertices, _halved(vertices, np.searchsorted(names, around))


def _whole(given: BoolArray) -> BoolArray:
    """Return which cubes, each named by its lowest corner, have all eight corners; shape of `given` less one."""
    for axis in range(3):
        lower, upper = _ends(axis)
        given = given[lower] & given[upper]
    return given


def _ends(axis: int) -> tuple[tuple[slice, ...], tuple[slice, ...]]:
    """Return the lower and the upper ends of all edges along an axis."""
    lower, upper = [slice(None)] * 3, [slice(None)] * 3
    lower[axis], upper[axis] = slice(None, -1), slice(1, None)
    return tuple(lower), tuple(upper)


def _cut_edges(values: FloatArray, given: BoolArray) -> tuple[FloatArray, IndexArray, BoolArray]:
    """Return where known edges are cut (n, 3), their lower ends and axes (n, 4), and whether values rise along."""
    inside = values < 0.0
    middles, edges, rising = [], [], []
    for axis in range(3):
        lower, upper = _ends(axis)
        at = np.argwhere(given[lower] & given[upper] & (inside[lower] != inside[upper]))
        low, high = values[lower][tuple(at.T)], values[upper][tuple(at.T)]
        middle = at.astype(np.float64)
        middle[:, axis] += low / (low - high)
        middles.append(middle)
        edges.append(np.column_stack([at, np.full(len(at), axis)]))
        rising.append(low < 0.0)
    return np.concatenate(middles), np.concatenate(edges), np.concatenate(rising)


def _cubes_around(edges: IndexArray, whole: BoolArray) -> tuple[IndexArray, BoolArray]:
    """Return the four cubes around each edge, counterclockwise (-1: not whole), and which have all."""
    at, axis = edges[:, :3], edges[:, 3]
    rows = np.arange(len(edges))
    cubes = np.full((len(edges), 4), -1, np.int64)
    for number, (second, third) in enumerate(((-1, -1), (0, -1), (0, 0), (-1, 0))):
        cube = at.copy()
        cube[rows, (axis + 1) % 3] += second
        cube[rows, (axis + 2) % 3] += third
        exists: BoolArray = np.all((cube >= 0) & (cube < whole.shape), axis=1)
        exists[exists] = whole[tuple(cube[exists].T)]
        cubes[exists, number] = np.ravel_multi_index(tuple(cube[exists].T), whole.shape)
    closed: BoolArray = np.all(cubes >= 0, axis=1)
    return cubes, closed


def _halved(vertices: FloatArray, quads: IndexArray) -> IndexArray:
    """Return quadrilaterals as two triangles each, halved along the shorter diagonal."""
    first, second, third, fourth = quads.T
    along = np.linalg.norm(vertices[first] - vertices[third], axis=1)
    across = np.linalg.norm(vertices[second] - vertices[fourth], axis=1)
    either = np.column_stack([first, second, third, first, third, fourth])
    other = np.column_stack([first, second, fourth, second, third, fourth])
    return np.where((along <= across)[:, None], either, other).reshape(-1, 3)
