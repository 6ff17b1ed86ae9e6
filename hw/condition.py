"""What a device reports of itself after a stop, and what brings it back."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable


@dataclass(frozen=True, slots=True)
class DeviceCondition:
    """What a device reports.

    Attributes:
        device: Its name.
        state: In words.
        fit: Whether it can run as it is.
        action: What can be done from here to make it fit, a command to it and what may move then; "" for nothing.
        remedy: What somebody has to do first; "" for nothing.
    """

    device: str
    state: str
    fit: bool
    action: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        """One line for a person."""
        todo = f"; {self.remedy}" if self.remedy else ""
        return f"{self.device}: {self.state}{todo}"


@runtime_checkable
class Recoverable(Protocol):
    """A device that can be brought back after a stop. Optional: others are started, read and closed."""

    def condition(self) -> DeviceCondition:
        """Connect, ask it for its state, and change nothing.

        Raises:
            DeviceError: It cannot be reached.
            MissingLibraryError: This computer lacks its client library.
        """
        ...

    def recover(self) -> None:
        """Do what its condition offers.

        Raises:
            DeviceError: It could not be done.
        """
        ...
