"""The seam: what a robot, simulated or real, and a controller look like to the loop."""

from types import TracebackType
from typing import Protocol, Self

from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.pacing import Pacer


class Backend(Protocol):
    """Devices behind one interface: a MuJoCo scene, a rig of real devices, a replayed log."""

    @property
    def period(self) -> float:
        """Control period [s]."""
        ...

    @property
    def pacer(self) -> Pacer:
        """Where its time comes from; the loop starts and stops it, `step` waits with it."""
        ...

    def start(self) -> Sample:
        """Bring the devices up, standing still, and return the first sample."""
        ...

    def step(self, command: Command) -> Sample:
        """Apply `command`, wait (or simulate) one period, and return what the devices say then.

        Raises:
            OSError: A device was lost (or another exception of the back end's).
            OverrunError: The period was over before its work was done, and the pacer does not tolerate that.
        """
        ...

    def close(self) -> None:
        """Leave the robot stopped; may be called more than once, and at any time."""
        ...

    def __enter__(self) -> Self: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


class Controller(Protocol):
    """A pure step function with memory: no clock, no input or output."""

    def start(self, first: Observation) -> None:
        """Take the first observation; nothing moves yet."""
        ...

    def step(self, now: Observation) -> Command:
        """Return what the arm is to do during the next period."""
        ...
