"""Meshes of what is held, and of what holds it."""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.experiments.grasp.config import GraspConfig

ROUND = 36
"""Corners of what is round."""

Mesh = tuple[FloatArray, npt.NDArray[np.intp]]
"""Vertices (n, 3) [m] and triangles (m, 3)."""


def held_mesh(config: GraspConfig) -> Mesh:
    """Return what is held, in the object's frame; a cylinder's axis is x."""
    sizes = config.sizes
    if config.object == "sphere":
        return sphere_mesh(sizes[0])
    if config.object == "cylinder":
        half, radius = 0.5 * sizes[1], sizes[0]
        # each rim twice, so that it is an edge
        return _turned(half * np.array([-1, -1, -1, 1, 1, 1.0]), radius * np.array([0, 1, 1, 1, 1, 0.0]), ROUND)
    vertices, triangles = _turned(np.array([-1, -1, 1, 1.0]), np.array([0, 1, 1, 0.0]), 4)
    corners = vertices[triangles.ravel()] * np.array([0.5, np.sqrt(0.5), np.sqrt(0.5)]) * np.array(sizes)
    return corners, np.arange(len(corners)).reshape(-1, 3)


def sphere_mesh(radius: float) -> Mesh:
    """Return a sphere about the origin."""
    angle = np.linspace(0.0, np.pi, ROUND // 2 + 1)
    return _turned(-radius * np.cos(angle), radius * np.sin(angle), ROUND)


def _turned(x: FloatArray, radius: FloatArray, corners: int) -> Mesh:
    """A profile turned about the x axis; of four corners it has its sides across y and z."""
    angle = 2.0 * np.pi * (np.arange(corners) + 0.5) / corners
    ring = np.stack([np.ones(corners), np.cos(angle), np.sin(angle)], axis=1)
    vertices = np.stack([x, radius, radius], axis=1)[:, None] * ring
    i, j = np.meshgrid(np.arange(len(x) - 1), np.arange(corners), indexing="ij")
    a, b = (i * corners + j).ravel(), (i * corners + (j + 1) % corners).ravel()
    triangles = np.concatenate([np.stack([a, b, a + corners], 1), np.stack([b, b + corners, a + corners], 1)])
    return vertices.reshape(-1, 3), triangles
