"""A rig whose sensors are tared whenever it is started."""

from types import TracebackType
from typing import Self

from palpate.hw.rig.rig import Rig
from palpate.runtime.data import Command, Sample
from palpate.runtime.pacing import Pacer


class FreshlyTared:
    """A back end: at its start nothing may be touched. What a rig is otherwise, it is."""

    def __init__(self, rig: Rig) -> None:
        """Take the rig."""
        self.rig = rig

    @property
    def period(self) -> float:
        """Control period [s]."""
        return self.rig.period

    @property
    def pacer(self) -> Pacer:
        """See `Backend`."""
        return self.rig.pacer

    def start(self) -> Sample:
        """See `Rig.start` and `Rig.tare`.

        Raises:
            DeviceError: A device is not fit, or a sensor's readings move.
        """
        self.rig.start()
        try:
            self.rig.tare()
            return self.rig.start()
        except BaseException:
            self.rig.close()
            raise

    def step(self, command: Command) -> Sample:
        """See `Rig.step`."""
        return self.rig.step(command)

    def close(self) -> None:
        """See `Rig.close`."""
        self.rig.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
