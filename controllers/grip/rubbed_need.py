"""The grip that a load needs where e was measured up to some normal force, and is taken as constant beyond."""

from dataclasses import dataclass, replace

from palpate.errors import positive
from palpate.friction.limit_surface import LimitSurface


@dataclass(frozen=True, slots=True)
class NeedWithinRubbed:
    """Neither slip nor spin, with an e that grows only up to the largest normal force rubbed with. A `GripNeed`.

    Attributes:
        largest: That force [N]; infinity: e goes on growing as the surface says.
    """

    largest: float

    def __post_init__(self) -> None:
        positive("largest", self.largest, "N", infinite_allowed=True)

    def least(self, surface: LimitSurface, tangential_force: float, spin_torque: float) -> float:
        """See `GripNeed`."""
        need = surface.least_normal_force(tangential_force, spin_torque)
        if not need > self.largest or surface.load_exponent == 0.0:
            return need
        # from here on e stays: at the border both surfaces, and so both needs, are the same
        constant = replace(surface, spin_length=surface.spin_length_at(self.largest), load_exponent=0.0)
        return constant.least_normal_force(tangential_force, spin_torque)
