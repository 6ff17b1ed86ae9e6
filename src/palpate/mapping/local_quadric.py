"""Heights between contacts, from quadratic surfaces fitted to heights and slopes nearby."""

import itertools
from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.spatial import KDTree

from palpate.errors import FloatArray
from palpate.mapping.cloud import TouchCloud

RIDGE = 1e-3
"""Weight that holds curvatures at zero, relative to the weight of the data. Contacts on one straight row
leave the curvature across the row open: it is then zero and the surface runs on as the tangent plane. Where
the data have a say, curvatures come out too small by a fraction of about RIDGE."""

PAIRS_AT_ONCE = 200_000
"""Pairs of grid point and contact handled at once: some 100 MB."""


@dataclass(frozen=True, slots=True, eq=False)
class LocalContacts:
    """Contacts as heights and slopes over the x-y plane.

    Attributes:
        xy: Shape (n, 2) [m].
        z: Heights, shape (n,) [m].
        slope: dz/dx and dz/dy, shape (n, 2).
        up: z component of the unit normal, shape (n,).
    """

    xy: FloatArray
    z: FloatArray
    slope: FloatArray
    up: FloatArray

    @classmethod
    def of(cls, cloud: TouchCloud) -> Self:
        """Return the contacts of `cloud`, whose normals must all point up."""
        up = cloud.normal[:, 2]
        return cls(
            xy=cloud.position[:, :2],
            z=cloud.position[:, 2],
            slope=-cloud.normal[:, :2] / up[:, np.newaxis],
            up=up,
        )


def heights_at(nodes: FloatArray, contacts: LocalContacts, tree: KDTree, support: float) -> FloatArray:
    """Return the height of the surface at each node.

    With (u, v) = (x, y) relative to the node over `support`, the surface is a + b u + c v + d u^2 + e u v + f
    v^2, fitted to heights and slopes by least squares with Wendland's weight (1 - r)^4 (4 r + 1) of compact
    support. Residuals are weighed as distances along the normal (factor n_z) and as angles (factor n_z^2), so
    a steep contact, whose height and slope are uncertain, counts less. In units of `support` an angle of 0.5
    degrees at 3 mm is 0.026 mm, like the noise of the heights, so both have the same weight.

    Args:
        nodes: Shape (k, 2) [m], each with a contact within `support`.
        contacts: What was felt.
        tree: Search tree over `contacts.xy`.
        support: Radius of influence of a contact [m].

    Returns:
        Shape (k,) [m].
    """
    counts = np.asarray(tree.query_ball_point(nodes, support, return_length=True), dtype=np.intp)
    ends = np.cumsum(counts)
    chunk_of_node = (ends - counts) // PAIRS_AT_ONCE
    first_nodes = np.append(np.flatnonzero(np.diff(chunk_of_node, prepend=-1)), len(nodes))
    parts = [_heights(nodes[i:j], contacts, tree, support) for i, j in itertools.pairwise(first_nodes)]
    return np.concatenate(parts) if parts else np.zeros(0)


def _heights(nodes: FloatArray, contacts: LocalContacts, tree: KDTree, support: float) -> FloatArray:
    neighbours: list[list[int]] = np.asarray(tree.query_ball_point(nodes, support), dtype=object).tolist()
    counts = np.array([len(near) for near in neighbours], dtype=np.intp)
    starts = np.cumsum(counts) - counts
    contact = np.fromiter(itertools.chain.from_iterable(neighbours), dtype=np.intp)
    node = np.repeat(np.arange(len(nodes)), counts)
    uv = (contacts.xy[contact] - nodes[node]) / support
    # Heights relative to a contact near the node: z far from the origin keeps its digits.
    base = contacts.z[contact[starts]]
    height = (contacts.z[contact] - base[node]) / support
    rows, right = _equations(uv, height, contacts.slope[contact], contacts.up[contact])
    A = np.add.reduceat(np.einsum("kei,kej->kij", rows, rows), starts, axis=0)
    b = np.add.reduceat(np.einsum("kei,ke->ki", rows, right), starts, axis=0)
    curvature = np.arange(3, 6)
    A[:, curvature, curvature] += RIDGE * A[:, :1, 0]
    return np.asarray(base + support * np.linalg.solve(A, b[..., np.newaxis])[:, 0, 0], dtype=np.float64)


def _equations(
    uv: FloatArray, height: FloatArray, slope: FloatArray, up: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return each pair's weighted equations for height and slopes: rows (k, 3, 6), right sides (k, 3)."""
    u, v = uv.T
    zero, one = np.zeros_like(u), np.ones_like(u)
    r = np.minimum(np.hypot(u, v), 1.0)
    # Never exactly zero, so that a node whose only contact lies on the rim still gets its tangent plane.
    root_weight = np.sqrt((1.0 - r) ** 4 * (4.0 * r + 1.0) + np.finfo(float).eps)
    rows = np.stack(
        [
            np.stack([one, u, v, u * u, u * v, v * v], axis=-1),
            np.stack([zero, one, zero, 2.0 * u, v, zero], axis=-1),
            np.stack([zero, zero, one, zero, u, 2.0 * v], axis=-1),
        ],
        axis=1,
    )
    factor = root_weight[:, np.newaxis] * np.stack([up, up**2, up**2], axis=-1)
    right = np.column_stack([height, slope])
    return rows * factor[..., np.newaxis], right * factor
