"""The observed part of a height map as triangles."""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.mapping.height_map import HeightMap

IndexArray = npt.NDArray[np.int32]


def height_map_triangles(height_map: HeightMap) -> tuple[FloatArray, IndexArray]:
    """Return the observed grid points and the triangles between them.

    A grid cell gives two triangles if all four corners are observed, one if three are, otherwise none.

    Returns:
        Vertices, shape (n, 3) [m], and triangles as indices of vertices, shape (m, 3), counterclockwise seen
        from above (outward normals point up).
    """
    observed = height_map.observed
    x, y = np.meshgrid(height_map.x, height_map.y)
    vertices = np.column_stack([x[observed], y[observed], height_map.z[observed]])
    index = np.full(observed.shape, -1, dtype=np.int32)
    index[observed] = np.arange(len(vertices), dtype=np.int32)
    # Corners counterclockwise from the lower left; a triangle leaves out one of them.
    corners = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
    missing = (corners < 0).sum(axis=1)
    whole = corners[missing == 0]
    parts = [whole[:, [0, 1, 2]], whole[:, [0, 2, 3]]]
    three = corners[missing == 1]
    parts.extend(np.delete(three[three[:, gone] < 0], gone, axis=1) for gone in range(4))
    return vertices, np.concatenate(parts)
