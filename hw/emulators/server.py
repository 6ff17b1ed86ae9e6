"""What an emulated device looks like to the one loop that serves them all."""

from collections.abc import Sequence
from typing import Protocol

from palpate.hw.emulators.plant import PlantState, ServoGoal
from palpate.spatial import Vector


class Server(Protocol):
    """A device on a wire. Nothing in it blocks: the host calls when there is something to do.

    Times are of the host's wall clock, `time.monotonic` [s]; the plant's own time comes with its state.
    """

    @property
    def name(self) -> str:
        """Of the device, for messages and faults."""
        ...

    @property
    def address(self) -> str:
        """Where clients find it: an IP address, or the path of a terminal."""
        ...

    def files(self) -> Sequence[int]:
        """Return the file descriptors to wait for until they are readable; they may change from call to call."""
        ...

    def receive(self, file: int, now: float) -> None:
        """Read what has arrived at one of them, and reply."""
        ...

    def due(self) -> float:
        """Return when `tick` is wanted next [s]; infinity if it is not."""
        ...

    def tick(self, now: float) -> None:
        """Do what is due."""
        ...

    def take(self, state: PlantState) -> None:
        """Take what the plant is like now; called after every one of its steps."""
        ...

    def inject(self, fault: str, value: float) -> str:
        """Switch a fault on or off and return what was done, one line.

        Raises:
            InvalidValueError: There is no such fault; the message lists those that there are.
        """
        ...

    def close(self) -> None:
        """Close all files."""
        ...


class ArmServer(Server, Protocol):
    """A device that moves the plant's arm."""

    def velocity(self) -> tuple[Vector, Vector]:
        """Return the tool's velocity [m/s] and angular velocity [rad/s] for the plant's next step, base frame."""
        ...


class ServoServer(Server, Protocol):
    """A device that drives the plant's servos."""

    def goals(self) -> tuple[ServoGoal, ...]:
        """Return the goals for the plant's next step."""
        ...
