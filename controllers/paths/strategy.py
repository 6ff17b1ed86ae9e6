"""What decides where the tip goes."""

from typing import Protocol

from palpate.controllers.paths.felt import Felt
from palpate.controllers.paths.legs import Ended, Leg
from palpate.controllers.paths.marks import Mark
from palpate.controllers.paths.plane import PathPlane


class Strategy(Protocol):
    """Decides leg by leg where the tip goes, from what it felt.

    A controller calls `feel` in every period in contact (microseconds) and `next` between legs, with the tip at
    rest (up to 100 ms). All that a strategy knows it was told by these calls: told the same again after `start`,
    it asks for the same.
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

    def feel(self, felt: Felt) -> bool:
        """Take one period in contact; return whether the present leg has now found its end."""
        ...

    def next(self, ended: Ended | None) -> Leg | None:
        """Return the next leg, or None at the end.

        Args:
            ended: What came of the last leg; None at the beginning.
        """
        ...
