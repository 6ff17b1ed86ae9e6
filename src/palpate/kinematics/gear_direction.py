"""Direction in which gear friction is compensated: changed at once upwards, gradually while the force sinks.

A servo that is to press more needs current for the friction of its gear; one that is to press less must yield
to what friction holds up. To switch from one to the other takes twice the friction off the current, a fifth of it:
the rotor swings on the contact, and the force falls below what was asked for by almost as much. Two opposed
fingers do so together, and it takes a switch to let an object slip as it is meant to. Of three fingers that share
a load, one that swings shakes it: there the current had better go over while the force sinks by a small share.
"""

from palpate.errors import not_negative


class GearDirection:
    """Of one finger.

    Attributes:
        driving: Share of the current that drives; what is left of 1, of the current that yields.
    """

    __slots__ = ("_force", "_span", "_top", "driving")

    def __init__(self, span: float = 0.0) -> None:
        """Take the share of the force over which the current goes over; 0: it is switched."""
        self._span = not_negative("span", span, "")
        self.restart()

    def restart(self) -> None:
        """The finger stands open."""
        self._force, self._top, self.driving = 0.0, 0.0, 1.0

    def command(self, force: float) -> None:
        """Take the force that it is to press with now [N]; the same again says nothing new."""
        if force > self._force:
            self._top, self.driving = force, 1.0
        elif force < self._force:
            left = self._span * self._top - (self._top - force)
            self.driving = min(self.driving, left / (self._span * self._top)) if left > 0.0 else 0.0
        self._force = force

    def state(self) -> tuple[float, float, float]:
        """Return all that it remembers."""
        return (self._force, self._top, self.driving)

    def set_state(self, state: tuple[float, float, float]) -> None:
        """Take back what `state` gave."""
        self._force, self._top, self.driving = state
