"""Friction measured by a nudge in a grasp: planned with, and kept for the report."""

from dataclasses import dataclass

from palpate.controllers.grip.nudge import NudgedSurface
from palpate.errors import positive
from palpate.friction.limit_surface import LimitSurface


@dataclass(frozen=True, slots=True)
class NudgeFinding:
    """What one finger felt of its contact.

    Attributes:
        friction: mu; None where nothing slid.
        spin_length: e at the grip of the nudge [m]; None where nothing spun.
    """

    friction: float | None
    spin_length: float | None


class NotedNudge(NudgedSurface):
    """Plans with the friction that a nudge measured, and keeps it. e, measured at one grip, is scaled by gamma."""

    def __init__(self, cautious: LimitSurface, grip: float) -> None:
        """Take the least that the contacts can bear, and the grip of the nudge [N]."""
        super().__init__(cautious)
        self._growth = positive("grip", grip, "N") ** cautious.load_exponent
        self.found: tuple[NudgeFinding, ...] = ()

    found: tuple[NudgeFinding, ...]
    """One per finger that was nudged."""

    def start(self) -> None:
        """See `SurfaceBelief`."""
        super().start()
        self.found = ()

    def learn(self, finger: int, friction: float | None, spin_length: float | None) -> None:
        """See `NudgedSurface`."""
        self.found += (NudgeFinding(friction, spin_length),)
        super().learn(finger, friction, None if spin_length is None else spin_length / self._growth)
