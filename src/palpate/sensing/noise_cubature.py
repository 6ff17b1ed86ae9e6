"""Nonlinearity of a contact within the noise of its wrench, by cubature with the solver itself.

Twelve wrenches stand for the noise: w +- the columns of sqrt(6) L C / sqrt(5), where L L' is the covariance and
C a conference matrix (entries 0 and +-1, C C' = 5). As in the spherical-radial rule of Arasaratnam & Haykin
(Cubature Kalman filters, IEEE Trans. Automatic Control 2009) they have the noise's mean and covariance, and lie
as far from w as noise in six dimensions typically does. Turned by C, each moves five components at once, so
that products of two components count as well as squares. Whatever makes the closed form wrong is found
so: turning normals, changing curvature, a small normal force, edges, a grazing wrench axis.
"""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.sensing.contact import Contacts, ContactStatus
from palpate.sensing.contact_jacobian import ContactJacobians
from palpate.sensing.solver import Surface, contacts_from_wrenches

CONFERENCE = np.array(
    [
        [0, 1, 1, 1, 1, 1],
        [1, 0, 1, -1, -1, 1],
        [1, 1, 0, 1, -1, -1],
        [1, -1, 1, 0, 1, -1],
        [1, -1, -1, 1, 0, 1],
        [1, 1, -1, -1, 1, 0],
    ],
    dtype=np.float64,
)
"""Paley's conference matrix of order 6."""

SMALLER_AXIS = 0.1
"""In the plane, a residual counts against the linear standard deviation along it, or this share of the largest one
if that is more: otherwise noise along one line, whose image curves a little, would never count as linear."""

ROUNDING = 1e-9
"""Residuals below this share of a quantity's own size are not noise: the solver's rounding at condition 1e6."""

BLOCK = 2048
"""Contacts at a time: keeps the scratch arrays at a few megabytes."""


@dataclass(frozen=True, slots=True, eq=False)
class _Quantity:
    """A contact quantity at the nodes: what the solver says, and what the straight line says."""

    residual: FloatArray
    """Solver minus straight line, shape (n, nodes, dimension)."""
    linear: FloatArray
    """Change on the straight line, shape (n, nodes, dimension)."""
    size: FloatArray
    """Of the quantity, shape (n,)."""


def nonlinearity(
    surface: Surface, contacts: Contacts, jacobians: ContactJacobians, wrench_covariance: FloatArray
) -> FloatArray:
    """Return root mean square residual over linear standard deviation, the largest over quantities, shape (n,).

    Centroid and tangential force count in the tangent plane, along its worst direction. Infinite where a node has
    no contact, NaN where `contacts` has none.
    """
    values, vectors = np.linalg.eigh(wrench_covariance)
    steps = np.sqrt(6.0 / 5.0) * CONFERENCE @ (vectors * np.sqrt(np.maximum(values, 0.0))).T
    nodes = np.concatenate((steps, -steps))
    result = np.full(len(contacts), np.nan)
    rows = np.flatnonzero(contacts.status == ContactStatus.OK)
    for start in range(0, len(rows), BLOCK):
        block = rows[start : start + BLOCK]
        # numbers that leave float64 become infinite shares, which say so
        with np.errstate(all="ignore"):
            result[block] = _block_nonlinearity(surface, contacts, jacobians, block, nodes)
    return result


def _block_nonlinearity(
    surface: Surface, contacts: Contacts, jacobians: ContactJacobians, rows: np.ndarray, nodes: FloatArray
) -> FloatArray:
    c, n, f = contacts.centroid[rows], contacts.normal[rows], contacts.force[rows]
    Q = contacts.spin_torque[rows]
    moment = Q[:, None] * n + np.cross(c, f)
    wrenches = np.concatenate((f, moment), axis=1)[:, None, :] + nodes
    solved = contacts_from_wrenches(surface, wrenches.reshape(-1, 6))
    shape = (len(rows), len(nodes))
    reached = (solved.status.reshape(shape) == ContactStatus.OK).all(axis=1)

    tangents = _tangents(n)
    force_size = np.linalg.norm(f, axis=1)
    lever = np.linalg.norm(moment, axis=1) / force_size + np.linalg.norm(c, axis=1)

    def in_plane(found: FloatArray, at: FloatArray, jacobian: FloatArray, size: FloatArray) -> _Quantity:
        linear = np.einsum("ijk,lk->ilj", tangents @ jacobian[rows], nodes)
        moved = np.einsum("ijk,ilk->ilj", tangents, found.reshape(*shape, 3) - at[rows][:, None, :])
        return _Quantity(moved - linear, linear, size)

    def along(found: FloatArray, at: FloatArray, jacobian: FloatArray, size: FloatArray) -> _Quantity:
        linear = jacobian[rows] @ nodes.T
        moved = found.reshape(shape) - at[rows][:, None]
        return _Quantity((moved - linear)[:, :, None], linear[:, :, None], size)

    quantities = (
        in_plane(solved.centroid, contacts.centroid, jacobians.centroid, lever),
        in_plane(solved.tangential_force, contacts.tangential_force, jacobians.tangential_force, force_size),
        along(solved.normal_force, contacts.normal_force, jacobians.normal_force, force_size),
        along(solved.spin_torque, contacts.spin_torque, jacobians.spin_torque, force_size * lever),
    )
    worst = np.max([_share(each) for each in quantities], axis=0)
    return np.where(reached & np.isfinite(worst), worst, np.inf)


def _share(quantity: _Quantity) -> FloatArray:
    """Return residual over linear, root mean squares, along the worst principal axis of the linear spread."""
    count = quantity.linear.shape[1]
    spread = quantity.linear.transpose(0, 2, 1) @ quantity.linear / count
    finite = np.isfinite(spread).all(axis=(1, 2))
    variances, axes = np.linalg.eigh(np.where(finite[:, None, None], spread, 0.0))
    residual = np.sqrt(np.mean(np.square(quantity.residual @ axes), axis=1))
    linear = np.sqrt(np.maximum(variances, SMALLER_AXIS**2 * variances[:, -1:]))
    residual[residual <= ROUNDING * quantity.size[:, None]] = 0.0
    share = np.divide(residual, linear, out=np.where(residual > 0.0, np.inf, 0.0), where=linear > 0.0)
    return np.where(finite, share.max(axis=1), np.inf)


def _tangents(normal: FloatArray) -> FloatArray:
    """Return two unit vectors across each normal, shape (n, 2, 3).

    Duff et al., Building an orthonormal basis, revisited, JCGT 2017.
    """
    x, y, z = normal.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack((1.0 + sign * x * x * a, sign * b, -sign * x), axis=1)
    return np.stack((first, np.stack((b, sign + y * y * a, -y), axis=1)), axis=1)
