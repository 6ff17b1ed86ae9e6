"""Lengths, angles and surfaces of a grasp, as people read them."""

import math

from palpate.friction.limit_surface import LimitSurface

MILLI = 1e3

SMALL = 1e-3
"""Of gamma: below, e differs by less than half a per cent from 0.01 N to 100 N."""


def bears(surface: LimitSurface) -> str:
    """Return what a contact bears; exponents only where they are not those of an ellipse of constant size."""
    text = f"mu = {surface.friction:.3g}, e = {MILLI * surface.spin_length:.3g} mm"
    if surface.load_exponent > SMALL:
        text += f" at 1 N, gamma = {surface.load_exponent:.3g}"
    return text if surface.norm_exponent == 2.0 else f"{text}, p = {surface.norm_exponent:.3g}"


def in_mm(length: float) -> str:
    """Return a length [m] in millimetres; a dash where it is not known."""
    return "-" if math.isnan(length) else f"{MILLI * length:.2g} mm"


def in_degrees(angle: float) -> str:
    """Return an angle [rad] in degrees; a dash where it is not known."""
    return "-" if math.isnan(angle) else f"{math.degrees(angle):.2g} degrees"


def in_percent(share: float) -> str:
    """Return a share in per cent."""
    return f"{100.0 * share:.3g} %"
