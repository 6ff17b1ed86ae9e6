"""Pseudo terminal in place of the USB adapter of a servo bus or a sensor.

Bytes arrive at once, at any speed; the speed that the client has set can be read.
"""

import contextlib
import errno
import os
import struct
from pathlib import Path

from palpate.errors import InvalidValueError

_TCGETS2 = 0x802C542A
"""Linux, x86 and ARM: request for the terminal's settings with any speed as a number (asm-generic/ioctls.h)."""

_TERMIOS2 = struct.Struct("=4IB19s2I")


class Terminal:
    """Both ends of a pseudo terminal, non-blocking, with a link of a fixed name if desired."""

    def __init__(self, link: Path | None = None) -> None:
        """Open it.

        Args:
            link: Symbolic link to it, as udev makes them for adapters; a link to another pseudo terminal, which a
                killed process leaves behind, is replaced.

        Raises:
            InvalidValueError: If the path is taken, no link can be made, or this is Windows.
        """
        if os.name == "nt":
            raise InvalidValueError(f"link = {link}: Windows has no pseudo terminals; run this on Linux")
        import pty  # not above: Windows has none, and simulations need none
        import tty

        self.master, self._slave = pty.openpty()
        # the slave's end stays open, too: the master's reads would fail whenever the client closes its own
        for end in (self.master, self._slave):
            tty.setraw(end)
        os.set_blocking(self.master, False)
        self._link, self._device = link, os.ttyname(self._slave)
        self.lost = 0
        if link is not None:
            try:
                if link.is_symlink() and os.readlink(link).startswith(os.path.dirname(self._device) + os.sep):
                    link.unlink()
                link.symlink_to(self._device)
            except OSError as error:
                self._close_ends()
                raise InvalidValueError(f"link = {link}: {error.strerror}; choose another place for it") from None

    @property
    def path(self) -> str:
        """Path that a client opens."""
        return self._device if self._link is None else str(self._link)

    def baud_rate(self) -> int | None:
        """Return the rate that the client has set [1/s]; None if this system cannot report it."""
        import fcntl
        import termios

        try:
            reply = fcntl.ioctl(self._slave, _TCGETS2, bytes(_TERMIOS2.size))
            return int(_TERMIOS2.unpack(reply)[-1])
        except OSError:
            names = [name for name in dir(termios) if name[0] == "B" and name[1:].isdigit()]
            speeds = {getattr(termios, name): int(name[1:]) for name in names}
            return speeds.get(termios.tcgetattr(self._slave)[5])

    def read(self) -> bytes:
        """Return the bytes that have arrived."""
        try:
            return os.read(self.master, 4096)
        except OSError as error:
            if error.errno in (errno.EAGAIN, errno.EIO):
                return b""
            raise

    def write(self, data: bytes) -> None:
        """Send; bytes that are not read for long are lost, as on a wire."""
        try:
            self.lost += len(data) - os.write(self.master, data)
        except BlockingIOError:
            self.lost += len(data)

    def close(self) -> None:
        """Close both ends and remove the link; may be called more than once."""
        if self.master < 0:
            return
        self._close_ends()
        if self._link is not None and self._link.is_symlink() and os.readlink(self._link) == self._device:
            self._link.unlink()

    def _close_ends(self) -> None:
        for end in (self.master, self._slave):
            with contextlib.suppress(OSError):
                os.close(end)
        self.master = self._slave = -1
