"""Heights between contacts, from quadratic surfaces fitted to heights and slopes nearby."""

import itertools
import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import numpy.typing as npt
from scipy.spatial import KDTree

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.mapping.cloud import TouchCloud

RIDGE = 1e-3
"""Weight that holds curvatures at zero, relative to the weight of the data. Contacts on one straight row
leave the curvature across the row open: it is then zero and the surface runs on as the tangent plane. Where
the data have a say, curvatures come out too small by a fraction of about RIDGE."""

PAIRS_AT_ONCE = 200_000
"""Pairs of grid point and contact handled at once: some 100 MB."""


EPSILON = float(np.finfo(float).eps)


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
    # Heights relative to a contact near the node: z far from the origin keeps its digits.
    base = contacts.z[contact[starts]]
    felt = np.column_stack([contacts.xy, contacts.z, contacts.slope, contacts.up])
    A, b = _normal_equations(nodes, base, np.append(starts, len(contact)), contact, felt, support)
    curvature = np.arange(3, 6)
    A[:, curvature, curvature] += RIDGE * A[:, :1, 0]
    return np.asarray(base + support * np.linalg.solve(A, b[..., np.newaxis])[:, 0, 0], dtype=np.float64)


@njit(cache=True, error_model="numpy")
def _normal_equations(
    nodes: FloatArray,
    base: FloatArray,
    starts: npt.NDArray[np.intp],
    contact: npt.NDArray[np.intp],
    felt: FloatArray,
    support: float,
) -> tuple[FloatArray, FloatArray]:
    """Return each node's weighted normal equations of heights and slopes: (k, 6, 6) and right sides (k, 6).

    Contacts are rows of x, y, z, slopes and up; those of node i are `contact[starts[i] : starts[i + 1]]`.
    """
    A, b = np.zeros((len(nodes), 6, 6)), np.zeros((len(nodes), 6))
    row = np.zeros((3, 6))
    row[0, 0] = row[1, 1] = row[2, 2] = 1.0
    for i in range(len(nodes)):
        for at in range(starts[i], starts[i + 1]):
            x, y, z, slope_x, slope_y, up = felt[contact[at]]
            u, v = (x - nodes[i, 0]) / support, (y - nodes[i, 1]) / support
            r = min(math.sqrt(u * u + v * v), 1.0)
            # Never exactly zero, so that a node whose only contact lies on the rim still gets its tangent plane.
            weight = up * up * ((1.0 - r) ** 4 * (4.0 * r + 1.0) + EPSILON)
            row[0, 1], row[0, 2], row[0, 3], row[0, 4], row[0, 5] = u, v, u * u, u * v, v * v
            row[1, 3], row[1, 4] = 2.0 * u, v
            row[2, 4], row[2, 5] = u, 2.0 * v
            for e, right in enumerate(((z - base[i]) / support, slope_x, slope_y)):
                scale = weight if e == 0 else weight * up * up
                for k in range(6):
                    b[i, k] += scale * row[e, k] * right
                    for q in range(k + 1):
                        A[i, k, q] += scale * row[e, k] * row[e, q]
        for k in range(6):
            A[i, :k, k] = A[i, k, :k]
    return A, b
