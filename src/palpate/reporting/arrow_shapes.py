"""Arrows as triangles, which look the same wherever they are drawn."""

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray

SIDES = 10
"""Of the round parts."""

SHAFT, HEAD, HEAD_LENGTH = 0.022, 0.06, 0.22
"""Radii of shaft and head, and length of the head, over the longest arrow."""


def arrow_triangles(
    starts: FloatArray, along: FloatArray, longest: float
) -> tuple[FloatArray, npt.NDArray[np.int32]]:
    """Return vertices (k, 3) and triangles (m, 3) of arrows; those without length have none.

    Args:
        starts: Shape (n, 3).
        along: To the tips, shape (n, 3).
        longest: Length that thickness goes by, of all arrows beside one another.
    """
    vertices, triangles, first = [], [], 0
    for start, way in zip(starts, along, strict=True):
        length = float(np.linalg.norm(way))
        if not length > 0.0:
            continue
        vertices.append(start + _profile(way / length, length, longest))
        triangles.append(_TRIANGLES + first)
        first += len(vertices[-1])
    if not vertices:
        return np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int32)
    return np.concatenate(vertices), np.concatenate(triangles)


def _profile(axis: FloatArray, length: float, longest: float) -> FloatArray:
    """Three rings and the tip of an arrow from the origin, shape (3 * SIDES + 1, 3)."""
    aside = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = np.cross(axis, aside)
    first /= np.linalg.norm(first)
    angle = np.linspace(0.0, 2.0 * np.pi, SIDES, endpoint=False)[:, None]
    ring = np.cos(angle) * first + np.sin(angle) * np.cross(axis, first)
    neck = max(length - HEAD_LENGTH * longest, 0.4 * length)
    rings = ((0.0, SHAFT), (neck, SHAFT), (neck, HEAD))
    parts = [at * axis + radius * longest * ring for at, radius in rings]
    return np.asarray(np.concatenate([*parts, (length * axis)[None]]), dtype=np.float64)


def _indices() -> npt.NDArray[np.int32]:
    found = []
    for ring in (0, 1):
        for i in range(SIDES):
            a, b = ring * SIDES + i, ring * SIDES + (i + 1) % SIDES
            found += [(a, b, a + SIDES), (b, b + SIDES, a + SIDES)]
    found += [(2 * SIDES + i, 2 * SIDES + (i + 1) % SIDES, 3 * SIDES) for i in range(SIDES)]
    return np.array(found, dtype=np.int32)


_TRIANGLES = _indices()
