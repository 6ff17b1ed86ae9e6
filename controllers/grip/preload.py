"""Grip that is kept for steps of the load that nobody announces, and what it costs."""

from dataclasses import dataclass

from palpate.errors import check_not_negative
from palpate.friction.limit_surface import LimitSurface

RISE = 5e-3
"""[s] In which such a step comes: quicker than any grip follows."""


@dataclass(frozen=True, slots=True)
class Preload:
    """Steps of the load that are to be borne without slip, though nobody announces them.

    While a step rises within `RISE`, an actuator adds rate (RISE - lag) of grip, if that is above 0; all else must
    be there before. So the price is what the step alone needs, less that, whatever hangs: light loads pay most.

    Attributes:
        force: The largest step, of the object, in whatever direction [N].
        moment: Its moment about the line of the contacts [N m].
    """

    force: float = 0.0
    moment: float = 0.0

    def __post_init__(self) -> None:
        check_not_negative(self, force="N", moment="N m")

    def grip(self, surface: LimitSurface, fingers: int, margin: float, lag: float, rate: float) -> float:
        """Return by how much more a finger is to press [N], fingers sharing alike.

        Args:
            surface: What its contact bears.
            fingers: How many there are.
            margin: Share of grip beyond the least.
            lag: From a command to the grip [s].
            rate: At which a grip rises then [N/s].
        """
        if self.force == self.moment == 0.0:
            return 0.0
        need = (1.0 + margin) * surface.least_normal_force(self.force / fingers, self.moment / fingers)
        return max(need - rate * max(RISE - lag, 0.0), 0.0)
