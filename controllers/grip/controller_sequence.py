"""Runs controllers in sequence, such as lifting and then turning."""

from palpate.errors import InvalidValueError
from palpate.runtime.data import Command, Observation, Phase
from palpate.runtime.protocols import Controller


class ControllerSequence:
    """Starts each controller when the one before is DONE; ends as the last, or with the first LOST.

    Attributes:
        at: Index of the one that runs.
    """

    def __init__(self, *controllers: Controller) -> None:
        """Take them.

        Raises:
            InvalidValueError: None given.
        """
        if not controllers:
            raise InvalidValueError("ControllerSequence() has no controller: give at least one")
        self._controllers = controllers
        self.at = 0

    def start(self, first: Observation) -> None:
        """Take the first observation."""
        self.at = 0
        self._controllers[0].start(first)

    def step(self, now: Observation) -> Command:
        """Return what hand and arm are to do during the next period."""
        command = self._controllers[self.at].step(now)
        if command.phase is Phase.DONE and self.at + 1 < len(self._controllers):
            self.at += 1
            self._controllers[self.at].start(now)
            return self._controllers[self.at].step(now)
        return command
