"""A fingertip: the round end of a peg."""

import msgspec
import numpy as np

import palpate as pp
from palpate.robots.surface_entries import PlacedSurface


class RoundPeg(PlacedSurface, frozen=True, kw_only=True):
    """A peg that ends in a half sphere.

    Attributes:
        diameter: Of the peg [m].
    """

    diameter: float = msgspec.field(name="diameter_m")
    LENGTHS = (("diameter", "diameter_m"),)

    def surface(self) -> pp.Sphere:
        """See `SurfaceKind`: it touches with its end."""
        return pp.Sphere(0.5 * self.diameter, center=np.array(self.center), rotation=self.rotation)
