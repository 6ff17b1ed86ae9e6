"""The watchdog that a client may ask the controller for."""

import math
from collections.abc import Collection


class Watchdog:
    """Wants one of the inputs to be written often enough."""

    def __init__(self) -> None:
        """Want nothing."""
        self._name = ""
        self._longest = math.inf
        self._seen = 0.0

    def watch(self, name: str, frequency: float, now: float) -> None:
        """Want an input at a frequency [Hz] from now on [s]; 0 for never."""
        self._name, self._seen = name, now
        self._longest = 1.0 / frequency if frequency > 0.0 else math.inf

    def off(self) -> None:
        """Want nothing any more."""
        self._longest = math.inf

    def see(self, names: Collection[str], now: float) -> None:
        """Take note of inputs that were written, whatever their values."""
        if self._name in names:
            self._seen = now

    def expired(self, now: float) -> bool:
        """Return whether it has waited too long."""
        return now - self._seen > self._longest
