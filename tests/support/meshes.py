"""Meshes for tests, as triangles."""

import numpy as np

from palpate.sim import Triangles


def joined(*meshes):
    """Return the triangles of several trimesh meshes as those of one solid."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [np.array(mesh.faces) + k for mesh, k in zip(meshes, first, strict=False)]
    return Triangles(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))
