"""Which way a gear's friction is to be made up for: eased over, never switched.

A servo that is to press more needs current for the friction of its gear; one that is to press less must give way
to what friction holds up. To switch from one to the other takes twice the friction off the current, a fifth of it:
the rotor swings on the contact, and the force falls below what was asked for by almost as much.
"""

EASE = 0.2
"""[s] In which the current goes over when the force is to sink. The simulated XM430 on 20 kN/m swings with some
20 Hz; over two to four swings it follows. With 0.05 s half of the swing was left, and three fingers that share a
load let it slip by 20 um."""


class GearDirection:
    """Of one finger. `share` is that of the current that drives; what is left of 1, of the current that yields."""

    __slots__ = ("_force", "_rising", "share")

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """The finger stands open."""
        self._force, self._rising, self.share = 0.0, True, 1.0

    def command(self, force: float) -> None:
        """Take the force that it is to press with now [N]; the same again says nothing new."""
        self._rising = force > self._force or (force == self._force and self._rising)
        self._force = force

    def advance(self, period: float) -> None:
        """Go on by the time between two currents that are written [s]: up at once, down gently."""
        self.share = 1.0 if self._rising else max(self.share - period / EASE, 0.0)

    def state(self) -> tuple[float, bool, float]:
        """Return all that it remembers."""
        return (self._force, self._rising, self.share)

    def set_state(self, state: tuple[float, bool, float]) -> None:
        """Take back what `state` gave."""
        self._force, self._rising, self.share = state
