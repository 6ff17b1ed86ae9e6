"""What first order misses of a contact within the noise of its wrench, by cubature with the solver itself.

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

QUANTITIES = {"centroid": 3, "normal": 3, "normal_force": 1, "tangential_force": 3, "spin_torque": 1}
"""Fields of a contact, and their dimensions."""

BLOCK = 2048
"""Contacts at a time: keeps the scratch arrays at a few megabytes."""


@dataclass(frozen=True, slots=True, eq=False)
class Departure:
    """How contacts depart from the straight line within the noise: second moments, mean shift included.

    Attributes:
        centroid: Shape (n, 3, 3) [m^2]; like the others of the nodes that have a contact.
        normal: Shape (n, 3, 3).
        normal_force: Shape (n, 1, 1) [N^2].
        tangential_force: Shape (n, 3, 3) [N^2].
        spin_torque: Shape (n, 1, 1) [(N m)^2].
        share: Root mean square departure over linear standard deviation, the largest over quantities, shape (n,);
            centroid and tangential force count in the tangent plane, along its worst direction. Infinite where a
            node has no contact, NaN where there is none.
    """

    centroid: FloatArray
    normal: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    spin_torque: FloatArray
    share: FloatArray


def departure(
    surface: Surface, contacts: Contacts, jacobians: ContactJacobians, wrench_covariance: FloatArray
) -> Departure:
    """Return how n contacts depart from first order within the noise of their wrenches.

    Args:
        surface: The fingertip.
        contacts: Found on it.
        jacobians: Theirs.
        wrench_covariance: Shape (6, 6), or (n, 6, 6).
    """
    # its symmetric root, in units of the mean force and moment noise: it turns with the sensor's frame
    n = len(contacts)
    variances = np.diagonal(wrench_covariance, axis1=-2, axis2=-1)
    units = np.sqrt(variances.reshape(*variances.shape[:-1], 2, 3).mean(axis=-1)).repeat(3, axis=-1)
    units[units == 0.0] = 1.0
    values, vectors = np.linalg.eigh(wrench_covariance / (units[..., :, None] * units[..., None, :]))
    root = units[..., :, None] * (vectors * np.sqrt(np.maximum(values, 0.0))[..., None, :])
    roots = np.broadcast_to(root @ np.swapaxes(vectors, -1, -2), (n, 6, 6))
    moments = {name: np.full((n, d, d), np.nan) for name, d in QUANTITIES.items()}
    share = np.full(n, np.nan)
    rows = np.flatnonzero(contacts.status == ContactStatus.OK)
    for start in range(0, len(rows), BLOCK):
        block = rows[start : start + BLOCK]
        # numbers that leave float64 become infinite shares, which say so
        with np.errstate(all="ignore"):
            share[block] = _block_departure(surface, contacts, jacobians, block, roots[block], moments)
    return Departure(**moments, share=share)


def _block_departure(
    surface: Surface,
    contacts: Contacts,
    jacobians: ContactJacobians,
    rows: np.ndarray,
    roots: FloatArray,
    moments: dict[str, FloatArray],
) -> FloatArray:
    c, n, f = contacts.centroid[rows], contacts.normal[rows], contacts.force[rows]
    moment = contacts.spin_torque[rows, None] * n + np.cross(c, f)
    axes = np.concatenate((_tangents(n, contacts.tangential_force[rows]), n[:, None]), axis=1)
    # conference matrix along these axes, of force and moment: it turns with the contact
    turned = np.einsum("nbk,iak->inba", CONFERENCE.reshape(6, 2, 3), axes.transpose(0, 2, 1)).reshape(-1, 6, 6)
    nodes = np.sqrt(6.0 / 5.0) * turned @ roots.transpose(0, 2, 1)
    nodes = np.concatenate((nodes, -nodes), axis=1)
    wrenches = np.concatenate((f, moment), axis=1)[:, None, :] + nodes
    solved = contacts_from_wrenches(surface, wrenches.reshape(-1, 6))
    shape = nodes.shape[:2]
    reached = solved.status.reshape(shape) == ContactStatus.OK
    tangents = axes[:, :2]
    force_size = np.linalg.norm(f, axis=1)
    lever = np.linalg.norm(moment, axis=1) / force_size + np.linalg.norm(c, axis=1)
    sizes = {
        "centroid": lever,
        "normal": np.ones(len(rows)),
        "tangential_force": force_size,
        "normal_force": force_size,
        "spin_torque": force_size * lever,
    }
    worst = np.zeros(len(rows))
    for name, dimension in QUANTITIES.items():
        linear = np.einsum("iak,ilk->ila", getattr(jacobians, name)[rows].reshape(len(rows), dimension, 6), nodes)
        moved = getattr(solved, name).reshape(*shape, dimension) - getattr(contacts, name)[rows].reshape(
            -1, 1, dimension
        )
        residual = np.where(reached[:, :, None], moved - linear, 0.0)
        residual[(np.abs(residual) <= ROUNDING * sizes[name][:, None, None]).all(axis=(1, 2))] = 0.0
        moments[name][rows] = residual.transpose(0, 2, 1) @ residual / nodes.shape[1]
        if name != "normal":
            if dimension == 3:
                residual, linear = (each @ tangents.transpose(0, 2, 1) for each in (residual, linear))
            worst = np.maximum(worst, _share(residual, linear))
    return np.where(reached.all(axis=1) & np.isfinite(worst), worst, np.inf)


def _share(residual: FloatArray, linear: FloatArray) -> FloatArray:
    """Return residual over linear, root mean squares, along the worst principal axis of the linear spread."""
    spread = linear.transpose(0, 2, 1) @ linear / linear.shape[1]
    finite = np.isfinite(spread).all(axis=(1, 2))
    variances, axes = np.linalg.eigh(np.where(finite[:, None, None], spread, 0.0))
    root = np.sqrt(np.mean(np.square(residual @ axes), axis=1))
    deviation = np.sqrt(np.maximum(variances, SMALLER_AXIS**2 * variances[:, -1:]))
    share = np.divide(root, deviation, out=np.where(root > 0.0, np.inf, 0.0), where=deviation > 0.0)
    return np.where(finite, share.max(axis=1), np.inf)


def _tangents(normal: FloatArray, tangential: FloatArray) -> FloatArray:
    """Return two unit vectors across each normal, along and across a tangential force, shape (n, 2, 3).

    Without one: Duff et al., Building an orthonormal basis, revisited, JCGT 2017.
    """
    x, y, z = normal.T
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack((1.0 + sign * x * x * a, sign * b, -sign * x), axis=1)
    size = np.abs(tangential).max(axis=1, keepdims=True)
    along = tangential / np.where(size > 0.0, size, 1.0)
    along -= np.sum(along * normal, axis=1, keepdims=True) * normal
    length = np.linalg.norm(along, axis=1, keepdims=True)
    first = np.where(length > 0.1, along / np.where(length > 0.1, length, 1.0), first)
    return np.stack((first, np.cross(normal, first)), axis=1)
