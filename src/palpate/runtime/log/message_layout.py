"""Messages of one size as numpy arrays: records of MCAP around plain CDR, a block of them at a time.

What is the same in every message of a run, text above all, stands in a template; numbers are filled in. The
writer's thread must not hold the interpreter for long: a loop that wakes up meanwhile has to wait for it.
"""

from typing import Any

import numpy as np
import numpy.typing as npt

MESSAGE = 5
"""Opcode of an MCAP message record."""

CDR_LITTLE_ENDIAN = bytes((0, 1, 0, 0))
"""Encapsulation header: plain CDR, little endian (DDS-XTypes 1.2, section 7.6.3.1.2)."""

SEQUENCES = 2**32
"""Sequence numbers are counted modulo this: 32 bits last for 49 days at 1 kHz."""

NANOSECONDS = np.uint64(10**9)
"""Of a second."""

Messages = npt.NDArray[np.void]
Stamps = npt.NDArray[np.uint64]

_RECORD = (
    ("opcode", "u1"),
    ("length", "<u8"),
    ("channel", "<u2"),
    ("sequence", "<u4"),
    ("log_time", "<u8"),
    ("publish_time", "<u8"),
    ("encapsulation", "u1", (4,)),
)

_ORIGIN = np.dtype(list(_RECORD)).itemsize
"""Where the message begins, behind its encapsulation: alignment counts from here."""

PAYLOAD = _ORIGIN - len(CDR_LITTLE_ENDIAN)
"""Where in a record that begins which readers call the message's data."""


class MessageLayout:
    """Lays out messages of one size, field after field, each number at a multiple of its size (CDR)."""

    def __init__(self, channel: int) -> None:
        """Begin with the record's header.

        Args:
            channel: Of the MCAP file.
        """
        self._channel = channel
        header = np.dtype(list(_RECORD))
        fields = dict(header.fields or {})
        self._names: list[str] = list(fields)
        self._formats: list[Any] = [each[0] for each in fields.values()]
        self._offsets: list[int] = [each[1] for each in fields.values()]
        self._place = header.itemsize
        self._constants: dict[str, Any] = {}

    def add(self, name: str, dtype: str, count: int | None = None) -> None:
        """Add a number, or an array of some that stand one after the other; `name` is its field."""
        size = np.dtype(dtype).itemsize
        self._place += -(self._place - _ORIGIN) % size
        self._names.append(name)
        self._formats.append(np.dtype(dtype) if count is None else np.dtype((dtype, (count,))))
        self._offsets.append(self._place)
        self._place += size * (1 if count is None else count)

    def stamp(self, name: str = "") -> None:
        """Add a builtin_interfaces/Time, as the fields `name`sec and `name`nanosec."""
        self.add(f"{name}sec", "<i4")
        self.add(f"{name}nanosec", "<u4")

    def constant(self, dtype: str, *values: float) -> None:
        """Add numbers that are the same in every message."""
        name = f"constant_{len(self._constants)}"
        self.add(name, dtype, len(values))
        self._constants[name] = values

    def text(self, text: str) -> None:
        """Add a string that is the same in every message: its length, its bytes, a closing zero."""
        data = text.encode() + b"\0"
        self.constant("<u4", len(data))
        self.constant("u1", *data)

    def template(self) -> Messages:
        """Return one message with all that is the same in every one, and zeros for the rest, shape (1,)."""
        dtype = np.dtype(
            {
                "names": self._names,
                "formats": self._formats,
                "offsets": self._offsets,
                "itemsize": self._place,
            }
        )
        found: Messages = np.zeros(1, dtype)
        found["opcode"] = MESSAGE
        found["length"] = dtype.itemsize - 9  # without opcode and length
        found["channel"] = self._channel
        found["encapsulation"] = tuple(CDR_LITTLE_ENDIAN)
        for name, values in self._constants.items():
            found[name] = values
        return found


def put_heads(messages: Messages, sequence: npt.NDArray[np.int64], log_time: Stamps) -> None:
    """Fill in numbers and times of logging.

    Args:
        messages: Made from a template, shape (n,).
        sequence: Number of each, shape (n,).
        log_time: Shape (n,) [ns].
    """
    messages["sequence"] = sequence % SEQUENCES
    messages["log_time"] = messages["publish_time"] = log_time


def put_stamps(messages: Messages, stamps: Stamps, name: str = "") -> None:
    """Fill in what `MessageLayout.stamp` has laid out.

    Args:
        messages: Shape (n,).
        stamps: Shape (n,) [ns].
        name: As in `stamp`.
    """
    seconds = stamps // NANOSECONDS
    messages[f"{name}sec"] = seconds
    messages[f"{name}nanosec"] = stamps - seconds * NANOSECONDS
