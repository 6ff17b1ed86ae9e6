"""The sensor as a server of `palpate.hw.emulators`."""

from pathlib import Path

from palpate.hw.emulators.serial_ft import TerminalServer
from palpate_bench.box import RATE


class BenchBoxServer(TerminalServer):
    """Streams the wrench of one sensor of the plant."""

    def __init__(self, path: str, number: int) -> None:
        """Open a terminal with a link at this path."""
        super().__init__(f"bench box {number}", number, RATE, Path(path))
        self._boot(self._switched_on)

    def _boot(self, now: float) -> None:
        self._stream(now)

    def _frame(self, time: float) -> bytes:
        fx, fy, fz, mx, my, mz = self._shown((100.0,) * 6)
        return f"{fx:.6g},{fy:.6g},{fz:.6g},{1e3 * mx:.6g},{1e3 * my:.6g},{1e3 * mz:.6g}\n".encode()
