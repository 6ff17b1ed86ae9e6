"""How a tip comes to rest once it is commanded to stand still: stated by devices and back ends that know it."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.runtime.wrapped_backend import unwrapped


@dataclass(frozen=True, slots=True)
class Stopping:
    """A tip goes on as before for a time, then slows down evenly.

    Attributes:
        delay: From the command to stand still to the deceleration [s]. Default: the lag of the simulated stage's
            servos, 20 ms, and a period of 125 Hz besides.
        deceleration: [m/s^2]. Default: the acceleration with which a UR arm follows velocities.
    """

    delay: float = 0.03
    deceleration: float = 5.0

    def equivalent_time(self, speed: float) -> float:
        """Return for how long the tip would go on with its whole speed [m/s] to get as far [s]."""
        return stopping_time(speed, self.delay, self.deceleration)


def stopping_time(speed: float, delay: float, deceleration: float) -> float:
    """Return the same of the two attributes, compiled too (`palpate.runtime.supervision.command_watch`)."""
    return delay + 0.5 * speed / deceleration


@runtime_checkable
class StoppingSource(Protocol):
    """A device or a back end that states how its tip comes to rest. Optional: others are as the defaults."""

    def stopping(self) -> Stopping:
        """Return it."""
        ...


def stopping_of(source: object) -> Stopping:
    """Return how the tip of a device or a back end comes to rest."""
    inner = unwrapped(source)
    return inner.stopping() if isinstance(inner, StoppingSource) else Stopping()
