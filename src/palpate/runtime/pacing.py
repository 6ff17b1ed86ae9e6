"""Where the loop's time comes from: simulated time passes at once, real time is waited for."""

from dataclasses import dataclass, field
from typing import Protocol

from palpate.runtime.times import Times


@dataclass(frozen=True, slots=True, eq=False)
class Punctuality:
    """How well deadlines were kept.

    Attributes:
        lateness: From each deadline to the wake-up after it; none for simulated time.
        overruns: Deadlines that had passed before the period's work was done.
        note: What the system granted or refused, one line for people; empty if there is nothing to say.
    """

    lateness: Times = field(default_factory=Times)
    overruns: int = 0
    note: str = ""


class Pacer(Protocol):
    """Waits for the end of a period."""

    def start(self) -> None:
        """Begin: the first period starts now."""
        ...

    def wait(self) -> None:
        """Return at the end of the present period.

        Raises:
            OverrunError: It is over already, and that was not to be tolerated.
        """
        ...

    @property
    def lateness(self) -> float:
        """From the last deadline to the wake-up after it [s]; 0 for simulated time."""
        ...

    def stop(self) -> Punctuality:
        """Give back what was taken from the system; return how it went. May be called more than once."""
        ...


class SimulatedTime:
    """Never waits: a simulation's periods take as long as they take to compute."""

    lateness = 0.0

    def start(self) -> None:
        """Nothing to begin."""

    def wait(self) -> None:
        """Return at once."""

    def stop(self) -> Punctuality:
        """Return that there were no deadlines."""
        return Punctuality()
