"""What stops a device that no command reaches: stated by devices and back ends, for when nobody can measure it."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.runtime.wrapped_backend import unwrapped


@dataclass(frozen=True, slots=True)
class DeviceWatchdog:
    """What a device does by itself once no command reaches it.

    Attributes:
        device: Its name, for messages.
        action: What happens to it: "is stopped by its controller".
        within: Longest time from the last command until it stands [s].
        check: How to see it, an imperative clause.
    """

    device: str
    action: str
    within: float
    check: str

    def __str__(self) -> str:
        """A clause of a sentence."""
        when = f" within {self.within:.2g} s after its last command" if self.within > 0.0 else ""
        return f"{self.device} {self.action}{when} ({self.check})"


STEPPED = DeviceWatchdog("the simulation", "moves only while it is stepped", 0.0, "nothing real moves")
"""Of a simulation."""


@runtime_checkable
class WatchdogSource(Protocol):
    """A device or a back end that states what stops it. Optional: of one without, nothing is known."""

    def watchdogs(self) -> tuple[DeviceWatchdog, ...]:
        """Return one entry per device that moves; none if nothing is known to stop one of them."""
        ...


def watchdogs_of(source: object) -> tuple[DeviceWatchdog, ...]:
    """Return what stops a device or a back end without commands; none if that is not known."""
    inner = unwrapped(source)
    return inner.watchdogs() if isinstance(inner, WatchdogSource) else ()
