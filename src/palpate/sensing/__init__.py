"""From wrenches to contacts."""

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
