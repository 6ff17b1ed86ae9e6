"""What a device reports of itself after a stop, and what brings it back."""

from dataclasses import dataclass
from typing import Protocol

from palpate.hw.devices import DeviceError


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


class Recoverable(Protocol):
    """A device of a rig, as this command sees it."""

    @property
    def name(self) -> str:
        """For messages."""
        ...

    def condition(self) -> DeviceCondition:
        """Connect, ask it for its state, and change nothing.

        Raises:
            DeviceError: It cannot be reached.
        """
        ...

    def recover(self) -> None:
        """Do what its condition offers.

        Raises:
            DeviceError: It could not be done.
        """
        ...

    def close(self) -> None:
        """Disconnect; may be called at any time."""
        ...


def condition_of(device: Recoverable) -> DeviceCondition:
    """Return the condition of a device; one that cannot be reached is not fit."""
    try:
        return device.condition()
    except DeviceError as error:
        return failed(device, error)


def failed(device: Recoverable, error: DeviceError) -> DeviceCondition:
    """Return the condition of a device that did not do what it was asked."""
    return DeviceCondition(device.name, error.problem, fit=False, remedy=error.remedy)
