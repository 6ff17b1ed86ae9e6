"""A fingertip whose surface yields with the normal force."""

import math
from dataclasses import dataclass, field

import numpy as np

from palpate.errors import FloatArray, InvalidValueError, positive
from palpate.surfaces.implicit import Evaluate, Implicit, Level, evaluate_superellipsoid
from palpate.surfaces.quadric import CenteredQuadric

LINEAR = 1.0
"""Exponent of a tip that yields in proportion to the force."""

HERTZ = 2.0 / 3.0
"""Exponent of two elastic bodies that touch in a point (Hertz 1882): f_n = stiffness * delta^1.5."""


@dataclass(frozen=True, eq=False)
class CompliantTip:
    """A closed tip that yields by delta = (f_n / stiffness)^exponent along its normal: c = x - delta n.

    Attributes:
        surface: The undeformed tip: a sphere, an ellipsoid or an implicit surface.
        stiffness: [N/m^(1/exponent)]: N/m for `LINEAR`, N/m^1.5 for `HERTZ`.
        exponent: Of the law, above 0 and at most 1: a tip does not soften under load.
        evaluate: As in `Implicit`.
        parameters: As in `Implicit`.
        half_lengths: As in `Implicit`.
        level: As in `Implicit`.
    """

    surface: CenteredQuadric | Implicit
    stiffness: float
    exponent: float = LINEAR
    evaluate: Evaluate = field(init=False, repr=False)
    parameters: FloatArray = field(init=False, repr=False)
    half_lengths: FloatArray = field(init=False, repr=False)
    level: Level | None = field(init=False, repr=False, default=None)

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", positive("stiffness", self.stiffness, "N/m^(1/exponent)"))
        given = self.exponent
        try:
            object.__setattr__(self, "exponent", float(self.exponent))
        except (TypeError, ValueError):
            object.__setattr__(self, "exponent", math.nan)
        if not 0.0 < self.exponent <= 1.0:
            raise InvalidValueError(f"exponent = {given!r}: must be a number above 0 and at most 1; Hertz has 2/3")
        surface: object = self.surface
        if isinstance(surface, Implicit):
            evaluate, parameters = surface.evaluate, surface.parameters
            half_lengths = surface.half_lengths
        elif isinstance(surface, CenteredQuadric) and np.isfinite(surface.half_lengths).all():
            evaluate = evaluate_superellipsoid
            half_lengths = np.array(surface.half_lengths)
            parameters = np.array([*half_lengths, 2.0])
            for array in (half_lengths, parameters):
                array.setflags(write=False)
        else:
            raise InvalidValueError(
                f"surface is {surface!r}: must be closed, a Sphere, an Ellipsoid or an implicit surface"
            )
        if isinstance(surface, Implicit):
            object.__setattr__(self, "level", surface.level)
        for name, value in (("evaluate", evaluate), ("parameters", parameters), ("half_lengths", half_lengths)):
            object.__setattr__(self, name, value)

    @property
    def center(self) -> FloatArray:
        """Of the undeformed surface, sensor frame, shape (3,) [m]."""
        return self.surface.center

    @property
    def rotation(self) -> FloatArray:
        """Of the undeformed surface, shape (3, 3)."""
        return self.surface.rotation

    def indentation(self, normal_force: float) -> float:
        """Return delta [m] under a normal force [N]."""
        return float((max(normal_force, 0.0) / self.stiffness) ** self.exponent)

    def contact_radius(self, normal_force: float, curvature: float) -> float:
        """Return about how far from the centroid the contact reaches [m]: the paper's section 2 bound.

        Args:
            normal_force: [N].
            curvature: Mean curvature of tip and object together there [1/m]; the tip's alone on a flat object.

        Where a sphere of curvature k sinks in by delta the contact has the radius sqrt(delta / k) (Hertz; without
        the surface's rise at the rim it would be sqrt(2 delta / k)).
        """
        return math.sqrt(self.indentation(normal_force) / positive("curvature", curvature, "1/m"))
