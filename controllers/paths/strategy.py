"""The interface of exploration strategies."""

from typing import Protocol

from palpate.controllers.paths.contact_period import ContactPeriod
from palpate.controllers.paths.legs import Leg, LegResult
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.plane import PathPlane


class Strategy(Protocol):
    """Decides leg by leg where the tip goes, from what it felt.

    A controller calls `feel` in every period in which the tip sweeps or a touch rests (microseconds), and `next`
    between legs, when the tip is commanded to rest: on the surface under force control, or lifted. (After a loss
    it is just stopping from landing speed: 10 ms are 0.05 mm.) `next` should take a period at most, and 10 ms at
    worst: for that long the robot keeps to its last command, and a real-time loop is late and, unless it is set to
    stop at that, skips the periods it missed. At 100 ms between samples the supervisor ends the run. A strategy
    depends on these calls only: given the same calls after `start`, it requests the same legs.
    """

    @property
    def plane(self) -> PathPlane:
        """In which the points of legs lie, and along whose axis the tip comes and goes."""
        ...

    @property
    def marks(self) -> tuple[Mark, ...]:
        """Marks for the map, in order."""
        ...

    def start(self) -> None:
        """Forget everything."""
        ...

    def feel(self, felt: ContactPeriod) -> bool:
        """Take one period in contact; return whether the present leg has now found its end.

        It is not called during landings, which settle and do not sweep.
        """
        ...

    def next(self, ended: LegResult | None) -> Leg | None:
        """Return the next leg, or None at the end.

        Args:
            ended: What came of the last leg; None at the beginning.
        """
        ...
