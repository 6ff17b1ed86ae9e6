"""palpate: hybrid force control with the sense of touch."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palpate.friction import ContactLoad, LimitSurface, Slip
    from palpate.grasp import GraspContacts, GraspForceOptimizer
    from palpate.sensing import Contact, Contacts, ContactStatus, contact_from_wrench, contacts_from_wrenches
    from palpate.surfaces import (
        Capsule,
        CompliantTip,
        Composite,
        Cylinder,
        Ellipsoid,
        Hyperboloid,
        ImplicitSurface,
        MeshSurface,
        Paraboloid,
        Patch,
        Plane,
        RoundedBox,
        Sphere,
        Superellipsoid,
    )

__version__ = "0.2.0"

__all__ = [
    "Capsule",
    "CompliantTip",
    "Composite",
    "Contact",
    "ContactLoad",
    "ContactStatus",
    "Contacts",
    "Cylinder",
    "Ellipsoid",
    "GraspContacts",
    "GraspForceOptimizer",
    "Hyperboloid",
    "ImplicitSurface",
    "LimitSurface",
    "MeshSurface",
    "Paraboloid",
    "Patch",
    "Plane",
    "RoundedBox",
    "Slip",
    "Sphere",
    "Superellipsoid",
    "contact_from_wrench",
    "contacts_from_wrenches",
]

_SURFACES = (
    "Capsule",
    "CompliantTip",
    "Composite",
    "Cylinder",
    "Ellipsoid",
    "Hyperboloid",
    "ImplicitSurface",
    "MeshSurface",
    "Paraboloid",
    "Patch",
    "Plane",
    "RoundedBox",
    "Sphere",
    "Superellipsoid",
)
_HOME = {name: "palpate.surfaces" if name in _SURFACES else "palpate.sensing" for name in __all__}
_HOME |= dict.fromkeys(("ContactLoad", "LimitSurface", "Slip"), "palpate.friction")
_HOME |= dict.fromkeys(("GraspContacts", "GraspForceOptimizer"), "palpate.grasp")


def __getattr__(name: str) -> object:
    # Imported when first used: numba alone takes longer to import than everything else together.
    if name in _HOME:
        return getattr(import_module(_HOME[name]), name)
    raise AttributeError(f"module 'palpate' has no attribute {name!r}; it has {', '.join(sorted(_HOME))}")


def __dir__() -> list[str]:
    return sorted(__all__)
