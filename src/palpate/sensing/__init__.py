"""From wrenches to contacts."""

from palpate.sensing import curvature_kinds as _curvature_kinds  # noqa: F401  # registers the kinds of surfaces
from palpate.sensing.contact import Contact, ContactModel, Contacts, ContactStatus
from palpate.sensing.solver import Solver, Surface, contact_from_wrench, contacts_from_wrenches

__all__ = [
    "Contact",
    "ContactModel",
    "ContactStatus",
    "Contacts",
    "Solver",
    "Surface",
    "contact_from_wrench",
    "contacts_from_wrenches",
]
