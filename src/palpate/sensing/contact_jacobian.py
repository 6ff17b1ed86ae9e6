"""How a contact changes with the wrench that it is computed from, in closed form, on any smooth surface.

The soft finger balance (Bicchi 1990, equations 1 to 4) is m = Q n(c) + c x f, with spin torque Q and n(c) the
outward normal. Along the surface dn = W dc, with W the shape operator. With mu = dm - c x df, phi = f.n, the
tangent projector P = 1 - n n' and [a] the matrix of a x, differentiation gives

    mu = dQ n + (Q W - [f]) dc.

Along n this is dQ = n.mu - (f x n).dc. In the tangent plane, where P [f] P = phi [n], it is a 2x2 system with the
matrix M = Q W - phi [n] of determinant phi^2 + Q^2 kG (kG: Gaussian curvature), whose inverse is

    dc = S mu,  S = (tr(M) P - M) P / det M = (Q (tr(W) P - W) + phi [n]) P / (phi^2 + Q^2 kG).

The rest follows: dn = W dc, d(normal force) = -d(f.n) = -n.df - (W f).dc, and
d(tangential force) = df - d(phi n) = P df - n (W f).dc - phi W dc.

A compliant tip yields along n by delta(normal force), so the centroid also moves by -n delta' d(normal force).
With dc the part along the surface, that adds delta' (n x f)((W f).dc + n.df) to the balance: M gains
delta' (n x f)(W f)', mu loses delta' (n x f)(n.df). dQ stays, since n x f is across n.
"""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.sensing.contact import Contacts
from palpate.sensing.surface_at_contacts import SurfaceAtContacts


@dataclass(frozen=True, slots=True, eq=False)
class ContactJacobians:
    """Derivatives of n soft contacts with respect to the wrench (f, m); the last axis is the wrench's.

    Attributes:
        centroid: Shape (n, 3, 6) [m/N, m/(N m)].
        normal: Shape (n, 3, 6) [1/N, 1/(N m)].
        normal_force: Shape (n, 6) [1, 1/m].
        tangential_force: Shape (n, 3, 6) [1, 1/m].
        spin_torque: Shape (n, 6) [m, 1].
    """

    centroid: FloatArray
    normal: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    spin_torque: FloatArray


def contact_jacobians(contacts: Contacts, surface: SurfaceAtContacts) -> ContactJacobians:
    """Return the derivatives of contacts found with the "soft" model.

    Args:
        contacts: n contacts; rows whose status is not OK give NaN.
        surface: What the fingertip is like at each of them.
    """
    c, n, f = contacts.centroid, contacts.normal, contacts.force
    W, phi, Q = surface.shape_operator, -contacts.normal_force, contacts.spin_torque
    P = np.eye(3) - n[:, :, None] * n[:, None, :]
    n_cross_f, Wf = np.cross(n, f), np.einsum("ijk,ik->ij", W, f)
    df = np.broadcast_to(np.eye(3, 6), (len(c), 3, 6))
    n_df = np.einsum("ij,ijk->ik", n, df)
    dmu = np.concatenate((-cross_matrices(c), np.broadcast_to(np.eye(3), P.shape)), axis=2)
    yielding = surface.yielding[:, None, None] * n_cross_f[:, :, None]

    # in units of the force, whose square may leave float64 where S does not
    size = np.hypot(np.hypot(f[:, 0], f[:, 1]), f[:, 2])
    M = (Q / size)[:, None, None] * W - (phi / size)[:, None, None] * cross_matrices(n)
    M += yielding / size[:, None, None] * Wf[:, None, :]
    trace = np.trace(M, axis1=1, axis2=2)
    determinant = 0.5 * (trace**2 - np.einsum("ijk,ikj->i", M, M))
    S = (trace[:, None, None] * P - M) @ P / (determinant * size)[:, None, None]

    along = S @ (dmu - yielding * n_df[:, None, :])
    dn = W @ along
    f_dn = np.einsum("ij,ijk->ik", f, dn)
    normal_force = -n_df - f_dn
    sinking = surface.yielding[:, None, None] * n[:, :, None] * normal_force[:, None, :]
    return ContactJacobians(
        centroid=along - sinking,
        normal=dn,
        normal_force=normal_force,
        tangential_force=P @ df - n[:, :, None] * f_dn[:, None, :] - phi[:, None, None] * dn,
        spin_torque=np.einsum("ij,ijk->ik", n, dmu) + np.einsum("ij,ijk->ik", n_cross_f, along),
    )


def cross_matrices(a: FloatArray) -> FloatArray:
    """Return [a] with [a] b = a x b for each row, shape (n, 3, 3)."""
    matrices = np.zeros((len(a), 3, 3))
    matrices[:, 0, 1], matrices[:, 0, 2] = -a[:, 2], a[:, 1]
    matrices[:, 1, 0], matrices[:, 1, 2] = a[:, 2], -a[:, 0]
    matrices[:, 2, 0], matrices[:, 2, 1] = -a[:, 1], a[:, 0]
    return matrices
