"""What was found to be wrong, and what became of it."""

from dataclasses import dataclass, field
from enum import StrEnum
from typing import NamedTuple, Protocol, runtime_checkable

NO_EXCEPTION = "no exception"
"""The limit of a trip because something raised one."""


class Cause(StrEnum):
    """What has to be seen to before the run is repeated: advice follows from it."""

    WIRE = "wire"
    """Cable, network or power: nothing, or nothing recent, comes from a device."""
    DEVICE = "device"
    """A device reports a stop or a fault of its own, or what it reports cannot be."""
    FORCE = "force"
    """The contact pressed or twisted too hard."""
    GRIP = "grip"
    """What a hand holds slips in it, or is about to."""
    MOTION = "motion"
    """The tip went too fast, or out of its room."""
    CONTROLLER = "controller"
    """One's own code."""
    COMPUTER = "computer"
    """This computer was too slow."""
    OTHER = "other"
    """See the words."""


@runtime_checkable
class Attributed(Protocol):
    """An exception that states its cause. Optional."""

    @property
    def cause(self) -> Cause:
        """What has to be seen to."""
        ...


class Violation(NamedTuple):
    """Something out of bounds.

    Attributes:
        measure: What.
        value: Its value, with unit.
        limit: The limit it broke, with unit.
        cause: What has to be seen to.
    """

    measure: str
    value: str
    limit: str
    cause: Cause = Cause.OTHER


@dataclass(frozen=True, slots=True)
class Trip:
    """Why the supervisor stopped the robot.

    Attributes:
        time: When [s].
        measure: What was out of bounds.
        value: Its value, with unit.
        limit: The limit it broke, with unit.
        cause: What has to be seen to.
        aftermath: What the reaction did, and how it left things, once it is over; empty if it only stood still.
    """

    time: float
    measure: str
    value: str
    limit: str
    cause: Cause = field(default=Cause.OTHER, compare=False)
    aftermath: str = field(default="", compare=False)

    def __str__(self) -> str:
        """One line for a person; logs keep it."""
        found = f"{self.measure} was {self.value} at t = {self.time:.3f} s"
        return found if self.limit == NO_EXCEPTION else f"{found}; the limit is {self.limit}"
