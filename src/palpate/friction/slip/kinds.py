"""What slips: the object slides over the finger, or it turns on it."""

from enum import StrEnum

from palpate.friction.contact_load import ContactLoad
from palpate.friction.limit_surface import LimitSurface


class SlipKind(StrEnum):
    """Which part of a slip is the faster."""

    SLIDE = "slide"
    """Along the surface."""
    SPIN = "spin"
    """About the contact normal."""


def kind_of_slip(surface: LimitSurface, load: ContactLoad) -> SlipKind:
    """Return how the object slips, or would, under a load: by normality, v against e omega.

    Where both are alike (p = 1: on every edge) the torque's share of the limit surface decides. Ask it of a
    load that is known: nothing is greater than NaN, so that one would be a slide.
    """
    e, force, torque = surface.spin_length_at(load.normal_force), load.tangential_length, abs(load.spin_torque)
    # v : e omega = f_t^(p-1) : (tau / e)^(p-1), so that for every p > 1 it is f_t : tau / e that decides
    return SlipKind.SPIN if torque > e * force else SlipKind.SLIDE
