"""Whether an exploration's own contacts bear out what is said of the fingertip and its sensor."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray
from palpate.estimation import BrokenAssumption
from palpate.mapping.point_normals import point_normals
from palpate.runtime import FingerDescription, Record
from palpate.sensing.solver import contacts_from_wrenches
from palpate.sensing.tip_agreement import TipAgreement, tip_agreement
from palpate.sensing.tip_uncertainty import TipUncertainty

AROUND = 2.5e-3
"""[m] Around a contact, for the normal of the places there: a paraboloid is good over a third of a tip."""

SPACING = 2e-4
"""[m] between the places that are kept for that."""

ASKED = 600
"""Contacts that are asked, evenly over the scan."""

LEAST_FRICTION = 1e-3
"""Of the force: below, friction does not tell how the sensor is turned about the normal."""


@dataclass(frozen=True, slots=True, eq=False)
class TipCheck:
    """What contacts say of the tip, and what was said of it.

    Attributes:
        agreement: By how much the contacts say that it is other.
        tip: How well it is said to be known.
        place_sd: How far off the sensor's calibration may leave contacts, sideways [m].
    """

    agreement: TipAgreement
    tip: TipUncertainty
    place_sd: float

    def broken(self) -> Iterator[BrokenAssumption]:
        """Return what does not agree; see `TipAgreement.broken`."""
        return self.agreement.broken(self.tip, self.place_sd)


def tip_check(
    record: Record,
    finger: FingerDescription,
    kept: npt.NDArray[np.bool_],
    tip: TipUncertainty,
    place_sd: float,
) -> TipCheck | None:
    """Return what a scan says of the tip; None where it says nothing, as along a single line.

    Args:
        record: Of the run.
        finger: That felt it.
        kept: Which periods gave a point of the map, shape (n,).
        tip: How well its fingertip is said to be known.
        place_sd: How far off the sensor's calibration may leave contacts, sideways [m].
    """
    felt = np.flatnonzero(kept)
    if not len(felt):
        return None
    found = point_normals(record.centroid[felt], record.normal[felt], radius=AROUND, spacing=SPACING, count=ASKED)
    rows = felt[found.rows]
    rubbing = np.linalg.norm(record.tangential_force[rows], axis=1) > LEAST_FRICTION * record.normal_force[rows]
    rows, normal, bend = rows[rubbing], found.normal[rubbing], found.bend[rubbing]
    if not len(rows):
        return None
    contacts = contacts_from_wrenches(finger.surface, record.wrench[rows])
    base = _axes(record.normal[rows], record.tangential_force[rows])
    sensor = _axes(contacts.normal, contacts.tangential_force)
    turn = sensor @ base.transpose(0, 2, 1)
    normal = np.einsum("nij,nj->ni", turn, normal)
    agreement = tip_agreement(finger.surface, contacts, normal, turn @ bend @ turn.transpose(0, 2, 1))
    return None if agreement is None else TipCheck(agreement, tip, place_sd)


def _axes(normal: FloatArray, friction: FloatArray) -> FloatArray:
    """Axes along normal, friction, and across both, as columns, shape (n, 3, 3)."""
    along = friction / np.linalg.norm(friction, axis=1, keepdims=True)
    return np.asarray(np.stack([normal, along, np.cross(normal, along)], axis=2), dtype=float)
