"""How far noise of the force/torque sensor, and a wrong model of the tip, move a contact: covariances.

For a wrench of covariance E, a contact quantity y with Jacobian J = dy/d(f, m) has, to first order, the covariance
J E J' (`palpate.sensing.contact_jacobian`). First order is good while noise is a small share of the normal force
and moves the contact by a small share of the radii. What it misses comes from the solver, called at the twelve
wrenches of `palpate.sensing.noise_cubature`: the mean square by which its results stray from the straight line is
added to the covariance, and its root relative to the linear standard deviation is the `nonlinearity`. A tip that
is not known exactly adds its own part (`palpate.sensing.tip_uncertainty`).

A limit on the nonlinearity selects contacts by their noise: those that look straighter than they are, because
noise made the force look larger. With a limit of 0.1, and first order alone, regions of 95 % held 30 to 80 % of
the few contacts that passed at 7 to 10 % noise. So the limit is where the covariances cease to hold, far beyond:
`python benchmarks/trust contact`.
"""

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError, not_negative
from palpate.estimation.covariance import covariance_matrix
from palpate.sensing.contact import Contact, Contacts, ContactStatus
from palpate.sensing.contact_jacobian import ContactJacobians, contact_jacobians
from palpate.sensing.noise_cubature import QUANTITIES, departure
from palpate.sensing.solver import Surface
from palpate.sensing.surface_at_contacts import surface_at_contacts
from palpate.sensing.tip_uncertainty import EXACT, TipUncertainty, model_derivatives
from palpate.surfaces.composite import Composite

NONLINEARITY_LIMIT = 1.0
"""Departure from first order as large as that itself. Below it regions of 95 % held 92.6 to 97.8 % of random
contacts on spheres, ellipsoids, cylinders and planes at noise of 1 to 50 % of the normal force, 40 000 at each."""

STEEP_LIMIT = 0.5
"""Relative standard deviation of the normal force, times tangential over normal force. The more tangential a
force, the less noise it takes until its normal part looks several times as large as it is, and the contact
straight: with tangential forces of up to 100 times the normal one and noise of 1 %, 52 of 150 contacts were
silently wrong without this limit, none with it."""


class UncertaintyStatus(IntEnum):
    """Whether the covariances may be used, and if not, why not."""

    VALID = 0
    """Regions of 95 % by these covariances hold 93 to 98 % of true contacts."""
    NONLINEAR = 1
    """Noise is too large for this contact: the covariances are of second order, and true ones differ."""
    DEGENERATE = 2
    """Noise reaches wrenches that explain no contact (a grazing wrench axis, the edge of a bounded tip, no force):
    the covariances say what happens near this wrench only."""
    NO_CONTACT = 3
    """There is no contact: the covariances are NaN."""


@dataclass(frozen=True, slots=True, eq=False)
class ContactUncertainty:
    """What sensor noise does to one contact, in the sensor frame.

    Attributes:
        centroid: Covariance of the centroid, shape (3, 3) [m^2]; of second order in the noise across the surface
            of a rigid tip that is known.
        normal: Covariance of the normal, shape (3, 3); zero where the surface is flat.
        normal_force: Variance of the normal force [N^2].
        tangential_force: Covariance of the tangential force, shape (3, 3) [N^2].
        spin_torque: Variance of the spin torque [(N m)^2].
        nonlinearity: What first order misses over its standard deviation, largest over the quantities;
            infinite where noise reaches wrenches without contact.
        status: See `UncertaintyStatus`.
    """

    centroid: FloatArray
    normal: FloatArray
    normal_force: float
    tangential_force: FloatArray
    spin_torque: float
    nonlinearity: float
    status: UncertaintyStatus


@dataclass(frozen=True, slots=True, eq=False)
class ContactUncertainties:
    """What sensor noise does to n contacts: the fields of `ContactUncertainty` with a leading n.

    Attributes:
        centroid: Shape (n, 3, 3) [m^2].
        normal: Shape (n, 3, 3).
        normal_force: Shape (n,) [N^2].
        tangential_force: Shape (n, 3, 3) [N^2].
        spin_torque: Shape (n,) [(N m)^2].
        nonlinearity: Shape (n,).
        status: Shape (n,), values of `UncertaintyStatus`.
        jacobians: The derivatives that these come from, for covariances between quantities.
    """

    centroid: FloatArray
    normal: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    spin_torque: FloatArray
    nonlinearity: FloatArray
    status: npt.NDArray[np.int8]
    jacobians: ContactJacobians

    def __len__(self) -> int:
        """Number of contacts."""
        return len(self.status)


def white_noise(force_noise: float, moment_noise: float) -> FloatArray:
    """Return the wrench covariance of independent noise, the same on every axis, shape (6, 6).

    Args:
        force_noise: Standard deviation of each force component [N].
        moment_noise: Standard deviation of each moment component [N m].
    """
    force = not_negative("force_noise", force_noise, "N")
    moment = not_negative("moment_noise", moment_noise, "N m")
    return np.diag([force * force] * 3 + [moment * moment] * 3)


def contact_uncertainty(
    surface: Surface, contact: Contact, wrench_covariance: npt.ArrayLike, tip: TipUncertainty = EXACT
) -> ContactUncertainty:
    """Return what sensor noise does to one contact, as a row of `contacts_uncertainties`.

    Takes about a millisecond, a batch about 20 us for each: not for every period of a control loop.

    Args:
        surface: The fingertip that the contact was found on.
        contact: Found with the "soft" model.
        wrench_covariance: As in `contacts_uncertainties`.
        tip: As in `contacts_uncertainties`.

    Raises:
        InvalidValueError: As in `contacts_uncertainties`.
    """
    one = contacts_uncertainties(
        surface,
        Contacts(
            centroid=contact.centroid[None],
            normal=contact.normal[None],
            force=contact.force[None],
            normal_force=np.array([contact.normal_force]),
            tangential_force=contact.tangential_force[None],
            spin_torque=np.array([contact.spin_torque]),
            condition=np.array([contact.condition]),
            status=np.array([contact.status], np.int8),
        ),
        wrench_covariance,
        tip,
    )
    return ContactUncertainty(
        one.centroid[0],
        one.normal[0],
        one.normal_force.item(),
        one.tangential_force[0],
        one.spin_torque.item(),
        one.nonlinearity.item(),
        UncertaintyStatus(one.status.item()),
    )


def contacts_uncertainties(
    surface: Surface, contacts: Contacts, wrench_covariance: npt.ArrayLike, tip: TipUncertainty = EXACT
) -> ContactUncertainties:
    """Return what sensor noise does to many contacts.

    Args:
        surface: The fingertip that the contacts were found on.
        contacts: Found with the "soft" model: the wrench-axis method has other derivatives.
        wrench_covariance: Of the noise of (f, m) about the sensor frame's origin, in N^2, N^2 m and (N m)^2, of
            shape (6, 6), or (n, 6, 6) where it differs from contact to contact; `white_noise` makes one.
        tip: How uncertain the fingertip's model is; its errors are the same for every contact.

    Raises:
        InvalidValueError: The covariance is none, or the curvature of this kind of surface is not registered.
    """
    E = covariance_matrix("wrench_covariance", wrench_covariance, 6, remedy="np.cov of wrenches at rest is one")
    if E.ndim > 2 and E.shape[:-2] != (len(contacts),):
        raise InvalidValueError(
            f"wrench_covariance has shape {E.shape}: must be (6, 6), or ({len(contacts)}, 6, 6)"
        )
    found = contacts.status == ContactStatus.OK
    with np.errstate(all="ignore"):  # overflow of float64 is reported by the status
        at = surface_at_contacts(surface, contacts)
        J = contact_jacobians(contacts, at)
        missed = departure(surface, contacts, J, E)
        covariances = {
            name: _spread(getattr(J, name).reshape(-1, dimension, 6), E) + getattr(missed, name)
            for name, dimension in QUANTITIES.items()
        }
        if not tip.exact:
            for name, each in model_derivatives(contacts, J, center_of(surface), at.yielding).items():
                covariances[name] += _spread(each, tip.covariance)
        total = np.sum([each.sum(axis=(1, 2)) for each in covariances.values()], axis=0)

    status = np.full(len(found), UncertaintyStatus.VALID, np.int8)
    status[missed.share > NONLINEARITY_LIMIT] = UncertaintyStatus.NONLINEAR
    with np.errstate(all="ignore"):
        slope = np.linalg.norm(contacts.tangential_force, axis=1) / contacts.normal_force
        steep = slope * np.sqrt(covariances["normal_force"][:, 0, 0]) / contacts.normal_force
    status[steep > STEEP_LIMIT] = UncertaintyStatus.NONLINEAR
    status[~np.isfinite(missed.share) | ~np.isfinite(total)] = UncertaintyStatus.DEGENERATE
    status[~found] = UncertaintyStatus.NO_CONTACT
    return ContactUncertainties(
        covariances["centroid"],
        covariances["normal"],
        covariances["normal_force"][:, 0, 0],
        covariances["tangential_force"],
        covariances["spin_torque"][:, 0, 0],
        missed.share,
        status,
        jacobians=J,
    )


def center_of(surface: Surface) -> FloatArray:
    """Return the point that a fingertip is turned about, if its rotation is uncertain, shape (3,) [m]."""
    return np.asarray(surface.centers[-1] if isinstance(surface, Composite) else surface.center)


def wrench_axis_error(contact: Contact) -> float:
    """Return how far the wrench-axis method would miss this contact, in the contact plane [m] (eq. 10).

    The wrench-axis method neglects the spin torque q. Its point lies off the true centroid by e = e_t + e_p, with
    e_p along the force and e_t in the contact plane, across the friction, of length exactly |q| |p_t| / |p|^2:
    nothing without friction or without spin, growing with the product of both. The whole error |e| is at least
    that (up to 1.8 times it was seen), since the surface curves away. NaN where there is no contact.
    """
    size = float(np.hypot(contact.normal_force, np.linalg.norm(contact.tangential_force)))
    # one division at a time: the square of a force may leave float64
    return abs(contact.spin_torque) / size * (float(np.linalg.norm(contact.tangential_force)) / size)


def _spread(jacobian: FloatArray, covariance: FloatArray) -> FloatArray:
    return np.asarray(jacobian @ covariance @ jacobian.transpose(0, 2, 1))
