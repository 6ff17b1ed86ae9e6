"""RTDE packages: uint16 total size, uint8 type, payload; everything big-endian.

Source: Universal Robots, "Real-Time Data Exchange (RTDE) guide".
"""

import struct
from enum import IntEnum

from palpate.errors import InvalidValueError

HEADER = struct.Struct(">HB")

LARGEST = 4096
"""Bytes of a package that a controller takes: twice the 2048 bytes of names that a recipe may have."""


class PackageType(IntEnum):
    """What a package is for: the ASCII code of a letter."""

    VERSION = ord("V")
    CONTROLLER_VERSION = ord("v")
    TEXT = ord("M")
    DATA = ord("U")
    OUTPUTS = ord("O")
    INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


class FramingError(InvalidValueError):
    """A size that no package can have: nothing after it can be understood."""


def package(kind: PackageType, payload: bytes) -> bytes:
    """Return a package with its header."""
    return HEADER.pack(HEADER.size + len(payload), kind) + payload


def text_message(message: str, source: str, level: int) -> bytes:
    """Return the payload of a text message; level 0 exception, 1 error, 2 warning, 3 info."""
    text, by = message.encode()[:255], source.encode()[:255]
    return bytes((len(text),)) + text + bytes((len(by),)) + by + bytes((level,))


class PackageReader:
    """Cuts a stream of bytes into packages."""

    def __init__(self) -> None:
        """Begin between two packages."""
        self._rest = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, bytes]]:
        """Return type and payload of each package that is complete with these bytes.

        Raises:
            FramingError: A size below that of a header or above `LARGEST`; the stream cannot be read on.
        """
        rest = self._rest
        rest += data
        packages: list[tuple[int, bytes]] = []
        start = 0
        while len(rest) - start >= HEADER.size:
            size, kind = HEADER.unpack_from(rest, start)
            if not HEADER.size <= size <= LARGEST:
                raise FramingError(f"RTDE package of {size} bytes: must be {HEADER.size} to {LARGEST}")
            if len(rest) - start < size:
                break
            packages.append((kind, bytes(rest[start + HEADER.size : start + size])))
            start += size
        del rest[:start]
        return packages
