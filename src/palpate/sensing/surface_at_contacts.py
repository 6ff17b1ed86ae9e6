"""What a fingertip is like where it touches: its curvature there, and how it yields."""

from dataclasses import dataclass
from functools import singledispatch

import numpy as np

from palpate.errors import FloatArray
from palpate.sensing.contact import Contacts
from palpate.sensing.curvature import shape_operator
from palpate.surfaces.compliant import CompliantTip


@dataclass(frozen=True, slots=True, eq=False)
class SurfaceAtContacts:
    """A fingertip at n contacts.

    Attributes:
        shape_operator: W with dn = W dc for motions of the centroid along the surface, shape (n, 3, 3) [1/m].
        yielding: How much deeper the centroid lies per normal force, shape (n,) [m/N]; zero for a rigid tip.
    """

    shape_operator: FloatArray
    yielding: FloatArray


@singledispatch
def surface_at_contacts(surface: object, contacts: Contacts) -> SurfaceAtContacts:
    """Return what a fingertip is like at contacts on it; this one is for every rigid tip.

    Raises:
        InvalidValueError: The curvature of this kind of surface is not registered.
    """
    return SurfaceAtContacts(shape_operator(surface, contacts.centroid), np.zeros(len(contacts)))


@surface_at_contacts.register
def _(surface: CompliantTip, contacts: Contacts) -> SurfaceAtContacts:
    # The centroid c = x - delta n runs on a parallel surface: dc = (1 - delta W) dx, dn = W dx.
    delta = (contacts.normal_force / surface.stiffness) ** surface.exponent
    W = shape_operator(surface.surface, contacts.centroid + delta[:, None] * contacts.normal)
    found = np.isfinite(W).all(axis=(1, 2)) & np.isfinite(delta)
    shrunk = np.where(found[:, None, None], np.eye(3) - delta[:, None, None] * W, np.eye(3))
    parallel = np.where(found[:, None, None], W @ np.linalg.inv(shrunk), np.nan)
    return SurfaceAtContacts(parallel, surface.exponent * delta / contacts.normal_force)
