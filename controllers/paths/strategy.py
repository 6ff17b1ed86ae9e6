"""What decides where the tip goes."""

from typing import Protocol

from palpate.controllers.paths.felt import ContactPeriod
from palpate.controllers.paths.legs import Ended, Leg
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.plane import PathPlane


class Strategy(Protocol):
    """Decides leg by leg where the tip goes, from what it felt.

    A controller calls `feel` in every period in which the tip sweeps or a touch rests (microseconds), and `next`
    between legs, when it has told the tip to rest: on the surface under force control, or lifted. (After a loss it
    is just stopping from landing speed: 10 ms are 0.05 mm.) `next` should take a period at most, and 10 ms at
    worst: so long the robot goes on as it was last told, and a real-time loop is late and, unless it was told to
    stop at that, skips the periods it missed. At 100 ms between samples the supervisor ends the run.
    All that a strategy knows it was told by these calls: told the same again after `start`, it asks for the same.
    """

    @property
    def plane(self) -> PathPlane:
        """In which the points of legs lie, and along whose axis the tip comes and goes."""
        ...

    @property
    def marks(self) -> tuple[Mark, ...]:
        """What there is to say besides the surface, in order."""
        ...

    def start(self) -> None:
        """Forget everything."""
        ...

    def feel(self, felt: ContactPeriod) -> bool:
        """Take one period in contact; return whether the present leg has now found its end.

        Landings are not told: they are settled, not swept.
        """
        ...

    def next(self, ended: Ended | None) -> Leg | None:
        """Return the next leg, or None at the end.

        Args:
            ended: What came of the last leg; None at the beginning.
        """
        ...
