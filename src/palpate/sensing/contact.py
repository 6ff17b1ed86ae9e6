"""Results of contact sensing: one contact, or many as a structure of arrays."""

from dataclasses import dataclass
from enum import IntEnum
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray

ContactModel = Literal["soft", "hard"]
""""soft": force and spin torque through the contact (exact). "hard": force only, the wrench-axis method."""


class ContactStatus(IntEnum):
    """Whether a wrench explains a contact, and if not, why not."""

    OK = 0
    """The contact was found; every field is finite."""
    NO_CONTACT = 1
    """No point of the surface explains the wrench: its axis misses and there is no spin."""
    NO_FORCE = 2
    """The force is exactly zero. (Thresholds belong to the sensor pipeline.)"""
    OUTSIDE = 3
    """The solution lies off every patch of a bounded or composite tip."""
    INVALID = 4
    """The wrench is not finite, or no float64 can hold its contact."""
    NOT_CONVERGED = 5
    """An iterative solver (implicit or compliant surface) found no contact that it can vouch for."""
    AMBIGUOUS = 6
    """Several contacts explain the wrench as well: normals of a mesh turn back, or its facets are too coarse for
    so tangential a force; or rounding decides which patch of a composite such a force touches."""


_STATUS = tuple(ContactStatus)
_CENTROID, _NORMAL, _FORCE, _TANGENTIAL = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
_new = object.__new__


@dataclass(frozen=True, slots=True, eq=False)
class Contact:
    """One contact, in the sensor frame.

    The wrench is what the object exerts on the finger, the normal points out of the fingertip and so into the
    object. Unless `status` is OK, every number but `force` is NaN and `condition` is infinite.

    Attributes:
        centroid: Contact centroid, shape (3,) [m].
        normal: Outward unit normal of the fingertip there, shape (3,).
        force: Contact force f, shape (3,) [N].
        normal_force: -f.n [N], positive when pushing.
        tangential_force: f - (f.n) n, shape (3,) [N].
        spin_torque: q.n [N m], the torque about the normal.
        condition: How many times larger than the relative error of the wrench the relative error of the
            centroid can be (see `palpate.sensing.solver`).
        status: See `ContactStatus`.
    """

    centroid: FloatArray
    normal: FloatArray
    force: FloatArray
    normal_force: float
    tangential_force: FloatArray
    spin_torque: float
    condition: float
    status: ContactStatus

    def _repr_html_(self) -> str:
        """What a notebook shows: each quantity with its unit."""
        rows = (
            ("status", self.status.name, ""),
            ("centroid", _entries(1e3 * self.centroid), "mm"),
            ("normal", _entries(self.normal), ""),
            ("normal force", f"{self.normal_force:.4g}", "N"),
            ("tangential force", _entries(self.tangential_force), "N"),
            ("spin torque", f"{1e3 * self.spin_torque + 0.0:.4g}", "mN m"),
            ("condition", f"{self.condition:.3g}", ""),
        )
        cells = "".join(f"<tr><th>{name}</th><td>{value}</td><td>{unit}</td></tr>" for name, value, unit in rows)
        return f"<table>{cells}</table>"


class _Draft:
    """A contact while it is filled in: laid out like `Contact`, so that it can become one, but not yet frozen."""

    __slots__ = Contact.__slots__


def contact_of(row: FloatArray, normal_force: float, spin_torque: float, condition: float, status: int) -> Contact:
    """Return one contact of a solver's numbers; a seventh of the time of the constructor, which freezes first.

    Args:
        row: Centroid, normal, force, tangential force, in this order, shape (12,) or longer; becomes read-only.
        normal_force: See `Contact`,
        spin_torque: likewise,
        condition: likewise.
        status: Its value.
    """
    row.setflags(False)  # type: ignore[call-arg]  # by keyword it takes twice as long
    draft: Any = _new(_Draft)
    draft.centroid = row[_CENTROID]
    draft.normal = row[_NORMAL]
    draft.force = row[_FORCE]
    draft.normal_force = normal_force
    draft.tangential_force = row[_TANGENTIAL]
    draft.spin_torque = spin_torque
    draft.condition = condition
    draft.status = _STATUS[status]
    draft.__class__ = Contact
    contact: Contact = draft
    return contact


def _entries(vector: FloatArray) -> str:
    return ", ".join(f"{entry + 0.0:.4g}" for entry in vector.tolist())


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """n contacts as a structure of arrays: the fields of `Contact` with a leading n.

    Attributes:
        centroid: Shape (n, 3) [m].
        normal: Shape (n, 3).
        force: Shape (n, 3) [N].
        normal_force: Shape (n,) [N].
        tangential_force: Shape (n, 3) [N].
        spin_torque: Shape (n,) [N m].
        condition: Shape (n,).
        status: Shape (n,), values of `ContactStatus`.
    """

    centroid: FloatArray
    normal: FloatArray
    force: FloatArray
    normal_force: FloatArray
    tangential_force: FloatArray
    spin_torque: FloatArray
    condition: FloatArray
    status: npt.NDArray[np.int8]

    def __len__(self) -> int:
        """Number of contacts."""
        return len(self.status)
