"""Whether a fingertip and its sensor's zero are what they are said to be, from sliding over any smooth surface.

The places that a tip slides over give the surface's normals by themselves; the wrench gives the normal of the tip
where it is touched. Both are one line. A tip that sits elsewhere by d in the sensor frame, or a zero that is off
by the moment d x f, turns the felt normals all alike; one of another size turns them by the direction of the
friction. To first order both follow from `palpate.sensing.tip_uncertainty`, so they are found by least squares.
Successive contacts err alike: covariances come from blocks of them (a sandwich, Liang & Zeger 1986, Biometrika
73).
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc  # scipy.stats takes a third of a second to import

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption
from palpate.sensing.contact import Contacts
from palpate.sensing.contact_jacobian import contact_jacobians
from palpate.sensing.solver import Surface
from palpate.sensing.surface_at_contacts import surface_at_contacts
from palpate.sensing.tip_uncertainty import POSITION, SIZE, TipUncertainty, model_derivatives

BLOCKS = 25
"""Of successive contacts, which count as independent of one another."""

FEWEST = 100
"""Contacts from which anything is told."""

SCALE = 1e-4
"""[m] by which places and sizes are scaled: a typical error."""

LARGEST = 2e-3
"""[m], standard deviation of what is possible at all: keeps what the contacts do not tell at zero."""

CHANCE = 3e-3
"""Probability that a tip as said fails the check, if what is said were standard deviations of normal laws: makers'
limits, of which they are made, are never exceeded."""

RESOLVED = 4e-5
"""[m] Less than that the check does not resolve: on bumps a paraboloid leaves as much."""


@dataclass(frozen=True, slots=True, eq=False)
class TipAgreement:
    """By how much contacts say that a tip is other than said.

    Attributes:
        shift: Of its place in the sensor frame, or, divided by the force, of the moments' zero, shape (3,) [m].
        size: By which it lies further out along its normals [m].
        covariance: Of both, shape (4, 4) [m^2].
    """

    shift: FloatArray
    size: float
    covariance: FloatArray

    @property
    def sd(self) -> FloatArray:
        """Standard deviations of shift and size, shape (4,) [m]."""
        return np.sqrt(np.diag(self.covariance))

    def broken(self, tip: TipUncertainty, place_sd: float) -> Iterator[BrokenAssumption]:
        """Return what does not agree.

        Args:
            tip: How well it is said to be known.
            place_sd: How far off the sensor's calibration may leave contacts, sideways [m].
        """
        said = np.diag(tip.covariance)
        known = np.array([*said[POSITION], said[SIZE]]) + place_sd**2 + RESOLVED**2
        found = np.array([*self.shift, self.size])
        together = self.covariance + np.diag(known)
        if chdtrc(len(found), found @ np.linalg.solve(together, found)) < CHANCE:
            i = int(np.argmax(np.abs(found) / np.sqrt(np.diag(together))))
            what = f"sits elsewhere along {'xyz'[i]} of the sensor" if i < 3 else "is larger"
            yield BrokenAssumption(
                Assumption.CONSISTENT,
                f"felt normals and the places felt agree for a tip that {what} by {1e3 * found[i]:+.2g} mm, +- "
                f"{1e3 * self.sd[i]:.1g}; said to be known to {1e3 * np.sqrt(known[i]):.1g} mm",
                "tare the sensor; if that does not help, calibrate the tip: palpate calibrate tip",
            )


def tip_agreement(
    surface: Surface, contacts: Contacts, normal: FloatArray, bend: FloatArray
) -> TipAgreement | None:
    """Return by how much contacts say that a tip is other than said; None if there are too few.

    Args:
        surface: The fingertip that the contacts were found on.
        contacts: n of them, all found, in the order of time.
        normal: Of the surface that was touched, from elsewhere, pointing into the object as a contact's does, in
            the sensor frame, shape (n, 3).
        bend: By how much that turns from place to place, dn/dx, shape (n, 3, 3) [1/m]. Places lie along the force
            from where they were touched, so a tip that is elsewhere makes another surface of them, too.
    """
    n = len(contacts)
    if n < FEWEST:
        return None
    smooth = _with_normals(surface, contacts, normal)
    jacobians = contact_jacobians(smooth, surface_at_contacts(surface, smooth))
    turned = (
        SCALE * model_derivatives(smooth, jacobians, np.zeros(3), np.zeros(n))["normal"][:, :, [0, 1, 2, SIZE]]
    )
    tangents = np.linalg.svd(smooth.normal[:, None, :])[2][:, 1:]
    off = np.einsum("nki,ni->nk", tangents, contacts.normal - normal)
    # what is found is how the true tip differs: the believed one errs the other way round
    columns = -np.asarray(tangents @ turned)
    columns[:, :, :3] -= SCALE * tangents @ bend
    sound = np.isfinite(columns).all(axis=(1, 2)) & np.isfinite(off).all(axis=1)
    off, columns = np.where(sound[:, None], off, 0.0), np.where(sound[:, None, None], columns, 0.0)
    variance = max(float(np.mean(off**2)), 1e-18)
    possible = variance * (SCALE / LARGEST) ** 2 * np.eye(4)
    inverse = np.linalg.inv(np.einsum("nki,nkj->ij", columns, columns) + possible)
    found = inverse @ np.einsum("nki,nk->i", columns, off)
    slopes = np.einsum("nki,nk->ni", columns, off - columns @ found)
    blocks = np.stack([each.sum(axis=0) for each in np.array_split(slopes, BLOCKS)])
    covariance = inverse @ (blocks.T @ blocks * BLOCKS / (BLOCKS - 4.0) + possible) @ inverse
    return TipAgreement(SCALE * found[:3], SCALE * float(found[3]), SCALE**2 * covariance)


def _with_normals(surface: Surface, contacts: Contacts, normal: FloatArray) -> Contacts:
    """Contacts where the tip has these normals (n, 3): without the noise of the moments, which moves felt ones.

    Derivatives at noisy contacts share that noise with what they are to explain: it would pass for a shift.
    """
    curved = surface_at_contacts(surface, contacts).shape_operator
    centroid = contacts.centroid + np.einsum("nij,nj->ni", np.linalg.pinv(curved), normal - contacts.normal)
    normal_force = -np.einsum("ni,ni->n", contacts.force, normal)
    tangential = contacts.force + normal_force[:, None] * normal
    return replace(
        contacts, centroid=centroid, normal=normal, normal_force=normal_force, tangential_force=tangential
    )
