"""Which side of a mesh a point lies on, told by what is nearest to it: a facet, an edge or a vertex.

A facet's plane tells it only where the facet itself is nearest: beside an edge, the planes of the two facets that
meet there may disagree, and a point above the edge of a box lies in the plane of its side. The sum of the
adjoining facets' normals weighted by their angles there tells it everywhere (Baerentzen & Aanaes, Signed distance
computation using the angle weighted pseudonormal, IEEE TVCG 11, 2005, theorem 1); at an edge both angles are pi.
"""

import numpy as np

from palpate.errors import FloatArray


def pseudonormals(corners: FloatArray) -> FloatArray:
    """Return the unit pseudonormals of every triangle: of itself, its edges ab, bc, ca, its vertices a, b, c.

    What has the same corners, to the bit, belongs together, whichever piece of the mesh it is of. What has no
    direction, like a sliver, has zeros.

    Args:
        corners: Shape (m, 3, 3) [m], outward normals by the right hand.

    Returns:
        Shape (m, 7, 3).
    """
    facets = _unit(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
    _, vertex = np.unique(corners.reshape(-1, 3) + 0.0, axis=0, return_inverse=True)  # -0.0 is 0.0
    faces = vertex.reshape(-1, 3)
    count = int(faces.max()) + 1
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=2)
    _, edge = np.unique(ends.min(axis=2) * count + ends.max(axis=2), return_inverse=True)
    edges = edge.reshape(-1, 3)
    to_next = _unit(np.roll(corners, -1, axis=1) - corners)
    to_last = _unit(np.roll(corners, 1, axis=1) - corners)
    angles = np.arccos(np.clip(np.sum(to_next * to_last, axis=2), -1.0, 1.0))
    at_vertices = np.zeros((count, 3))
    at_edges = np.zeros((int(edges.max()) + 1, 3))
    for k in range(3):
        np.add.at(at_vertices, faces[:, k], angles[:, k, None] * facets)
        np.add.at(at_edges, edges[:, k], facets)
    return np.concatenate([facets[:, None], _unit(at_edges)[edges], _unit(at_vertices)[faces]], axis=1)


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(np.where(length > 0.0, vectors / np.where(length > 0.0, length, 1.0), 0.0))
