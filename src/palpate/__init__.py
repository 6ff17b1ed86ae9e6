"""palpate: hybrid force control with the sense of touch."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palpate.sensing import Contact, Contacts, ContactStatus, contact_from_wrench, contacts_from_wrenches
    from palpate.surfaces import Cylinder, Ellipsoid, Plane, Sphere

__version__ = "0.1.0"

__all__ = [
    "Contact",
    "ContactStatus",
    "Contacts",
    "Cylinder",
    "Ellipsoid",
    "Plane",
    "Sphere",
    "contact_from_wrench",
    "contacts_from_wrenches",
]

_HOME = {
    "Contact": "palpate.sensing",
    "ContactStatus": "palpate.sensing",
    "Contacts": "palpate.sensing",
    "Cylinder": "palpate.surfaces",
    "Ellipsoid": "palpate.surfaces",
    "Plane": "palpate.surfaces",
    "Sphere": "palpate.surfaces",
    "contact_from_wrench": "palpate.sensing",
    "contacts_from_wrenches": "palpate.sensing",
}


def __getattr__(name: str) -> object:
    # Imported when first used: numba alone takes longer to import than everything else together.
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'palpate' has no attribute {name!r}; it has {', '.join(sorted(_HOME))}")


def __dir__() -> list[str]:
    return sorted(__all__)
