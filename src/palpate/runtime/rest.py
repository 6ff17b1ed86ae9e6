"""Whether the robot is at rest at the end of a run: at rest and moving are measured, else it is not known."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, Self, runtime_checkable

from palpate.runtime.data import Sample
from palpate.runtime.log.entries import Event
from palpate.runtime.watchdog import DeviceWatchdog


class RestState(StrEnum):
    """Whether a robot is at rest."""

    AT_REST = "at rest"
    """Measured."""
    MOVING = "moving"
    """Measured."""
    NOT_KNOWN = "not known"
    """Its state could not be read, was too old, or made no sense."""


CLAUSES = {
    RestState.AT_REST: "the robot is at rest",
    RestState.MOVING: "THE ROBOT IS STILL MOVING",
    RestState.NOT_KNOWN: "IT IS NOT KNOWN WHETHER THE ROBOT IS AT REST",
}
"""How the clause on each begins."""

REST = "rest"
"""Source of the event that a log has on it."""

WATCHDOG = "watchdog"
"""Source of the events on what stops the robot without commands; of a killed run a log has no more."""

LOOK = "look at it before you go near"
"""Where no watchdog is known."""


@dataclass(frozen=True, slots=True)
class RobotRest:
    """Whether the robot is at rest, and the clause that terminal, report, log and JSON have on it.

    Attributes:
        state: Measured or not known.
        words: The clause.
    """

    state: RestState
    words: str

    @classmethod
    def at_rest(cls) -> Self:
        """Return that it was measured to stand still."""
        return cls(RestState.AT_REST, CLAUSES[RestState.AT_REST])

    @classmethod
    def moving(cls, speed: float) -> Self:
        """Return that it was measured to move, with `speed` [m/s]."""
        clause = CLAUSES[RestState.MOVING]
        return cls(RestState.MOVING, f"{clause}, at {1e3 * speed:.3g} mm/s: press its emergency stop")

    @classmethod
    def not_known(cls, watchdogs: Sequence[DeviceWatchdog | str] = ()) -> Self:
        """Return that nobody could measure it, and what stops it then."""
        then = "; ".join(map(str, watchdogs)) or LOOK
        return cls(RestState.NOT_KNOWN, f"{CLAUSES[RestState.NOT_KNOWN]}: {then}")

    def __str__(self) -> str:
        """The clause."""
        return self.words


def rest_in(events: Iterable[Event]) -> RobotRest:
    """Return what a log has on rest; of one that breaks off before the run's end, it is not known."""
    stated: list[str] = []
    for event in events:
        if event.source == WATCHDOG:
            stated.append(event.text)
        elif event.source == REST:
            for state, clause in CLAUSES.items():
                if event.text.startswith(clause):
                    return RobotRest(state, event.text)
    return RobotRest.not_known(stated)


@runtime_checkable
class ArmSource(Protocol):
    """A back end whose arm can be read alone, where another device keeps `step` from returning. Optional."""

    def arm_alone(self) -> Sample:
        """Return the newest state of the arm, no older than `step` would have it, without wrenches.

        Raises:
            OSError: It is lost, or too old.
        """
        ...
