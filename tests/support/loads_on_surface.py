"""Loads of a given ratio on a limit surface."""

import math

from palpate.friction.contact_load import ContactLoad


def on_surface(surface, normal_force, share, ratio=1.0, across=0.0):
    """A load of that ratio; share 0 only pulls, pi/2 only twists, beyond pi/2 the other way round."""
    e, p = surface.spin_length_at(normal_force), surface.norm_exponent
    x, y = math.cos(share), math.sin(share)
    most = ratio * surface.friction * normal_force / (abs(x) ** p + abs(y) ** p) ** (1.0 / p)
    return ContactLoad(normal_force, (most * x * math.cos(across), most * x * math.sin(across), 0.0), most * e * y)
