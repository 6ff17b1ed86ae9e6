"""What was found to be wrong, and what became of it."""

from dataclasses import dataclass, field
from typing import NamedTuple

NO_EXCEPTION = "no exception"
"""The limit of a trip because something raised one."""


class Violation(NamedTuple):
    """Something out of bounds.

    Attributes:
        measure: What.
        value: Its value, with unit.
        limit: The limit it broke, with unit.
    """

    measure: str
    value: str
    limit: str


@dataclass(frozen=True, slots=True)
class Trip:
    """Why the supervisor stopped the robot.

    Attributes:
        time: When [s].
        measure: What was out of bounds.
        value: Its value, with unit.
        limit: The limit it broke, with unit.
        aftermath: What the reaction did, and how it left things, once it is over; empty if it only stood still.
    """

    time: float
    measure: str
    value: str
    limit: str
    aftermath: str = field(default="", compare=False)

    def __str__(self) -> str:
        """One line for a person; logs keep it."""
        found = f"{self.measure} was {self.value} at t = {self.time:.3f} s"
        return found if self.limit == NO_EXCEPTION else f"{found}; the limit is {self.limit}"
