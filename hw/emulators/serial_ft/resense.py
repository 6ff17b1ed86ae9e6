"""A Resense HEX: frames of seven numbers, without end, from the moment it is switched on."""

import math
from pathlib import Path

from palpate.hw.emulators.serial_ft.terminal_server import TerminalServer
from palpate.hw.serial_ft.resense import FRAME, MOMENT_UNIT
from palpate.spatial import Wrench


class ResenseServer(TerminalServer):
    """A `Server`; it hears nothing."""

    def __init__(
        self,
        sensor: int = 0,
        *,
        rate: float = 1000.0,
        ranges: Wrench = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12),
        temperature: float = 27.0,
        link: Path | None = None,
    ) -> None:
        """Open a terminal and stream; `ranges` [N, N m] and `temperature` [deg C] are the sensor's."""
        self._ranges = ranges
        self._temperature = temperature
        super().__init__(f"Resense sensor {sensor}", sensor, rate, link)
        self._boot(self._switched_on)

    def _boot(self, now: float) -> None:
        self._stream(now)

    def _hear(self, data: bytes, now: float) -> None:
        pass

    def _frame(self, time: float) -> bytes:
        load = self._shown(self._ranges)
        return FRAME.pack(*load[:3], *(value / MOMENT_UNIT for value in load[3:]), self._temperature)

    def _idle_due(self) -> float:
        return math.inf

    def _idle(self, now: float) -> None:
        pass
