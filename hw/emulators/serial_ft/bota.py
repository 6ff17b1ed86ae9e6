"""A serial Bota sensor: says that it has booted until it is set up by a dialogue, then streams frames."""

import re
from pathlib import Path

from palpate.hw.emulators.serial_ft.terminal_server import SerialFault, TerminalServer
from palpate.hw.serial_ft.bota import BOOTED, CHECKSUM, DATA, HEADER, SINC_LENGTHS, SINC_TIME
from palpate.hw.serial_ft.crc import crc16_x25
from palpate.spatial import Wrench

BOOT_PERIOD = 0.1
"""Between two times that it says so [s]; assumed: the maker's example waits for it whenever it is started."""

TEMPERATURE = 30.0
"""Shown [deg C]."""

LONGEST = 64
"""Of what is kept of a question that is not complete [bytes]."""

_OUT_OF_RANGE = 0b10
"""Status bit."""

_QUESTION = re.compile(rb"([CR])|c,([01]),([01]),([0-9]),([0-9])|f,([0-9]{1,4}),([01]),([01]),([01])")


class BotaServer(TerminalServer):
    """A `Server`. Of the settings only the sinc length has an effect: on the rate."""

    def __init__(
        self,
        sensor: int = 0,
        *,
        ranges: Wrench = (12.0, 12.0, 17.0, 0.12, 0.12, 0.12),
        link: Path | None = None,
    ) -> None:
        """Open a terminal and wait to be set up; `ranges` [N, N m] are the sensor's."""
        self._ranges = ranges
        self._configures = False
        self._says = 0.0
        self._heard = bytearray()
        super().__init__(f"Bota sensor {sensor}", sensor, 1.0 / (SINC_TIME * SINC_LENGTHS[1]), link)
        self._boot(self._switched_on)

    def _boot(self, now: float) -> None:
        self._streams = self._configures = False
        self._heard.clear()
        self._says = now

    def _idle_due(self) -> float:
        return float("inf") if self._configures else self._says

    def _idle(self, now: float) -> None:
        if not self._faults[SerialFault.SILENT]:
            self._write(BOOTED + b"\r\n")
        self._says = now + BOOT_PERIOD

    def _hear(self, data: bytes, now: float) -> None:
        """Reply to each request once it is complete; other bytes are skipped one by one."""
        heard = self._heard
        heard += data
        while heard:
            question = _QUESTION.match(bytes(heard))  # a copy: groups are cut out later
            if question:
                del heard[: question.end()]
                self._reply(question, now)
            elif _may_become_one(heard):
                return
            else:
                del heard[:1]

    def _reply(self, question: "re.Match[bytes]", now: float) -> None:
        letter = question[0][:1]
        if letter == b"C":
            self._streams, self._configures = False, True
        elif not self._configures:
            return  # it listens to nothing else while it runs
        elif letter == b"f":
            length = int(question[6])
            if not SINC_LENGTHS[0] <= length <= SINC_LENGTHS[1]:
                self._write(b"r,1,f,0")
                return
            self._rate = 1.0 / (SINC_TIME * length)
        if not self._faults[SerialFault.SILENT]:
            self._write(b"r,0," + letter + b",0")
        if letter == b"R":
            self._configures = False
            self._stream(now)

    def _frame(self, time: float) -> bytes:
        load = self._shown(self._ranges)
        beyond = any(abs(value) > most for value, most in zip(load, self._ranges, strict=True))
        data = DATA.pack(_OUT_OF_RANGE if beyond else 0, *load, int(1e6 * time) % 2**32, TEMPERATURE)
        return bytes((HEADER,)) + data + CHECKSUM.pack(crc16_x25(data))


def _may_become_one(heard: bytearray) -> bool:
    """Whether it is the beginning of a question of several numbers."""
    return len(heard) <= LONGEST and re.fullmatch(rb"[cf](,[0-9]{0,4}){0,4}", heard) is not None
