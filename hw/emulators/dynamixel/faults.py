"""What can go wrong on a servo bus, switched by name and number."""

from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from palpate.errors import InvalidValueError


class BusFault(StrEnum):
    """What `inject` takes, with what its number means.

    SILENT: the servo of this id hears and says nothing; -1 ends it.
    MUTE: nobody on the bus replies (1) or they do again (0): a broken wire back.
    WRONG_CHECKSUM: this share of replies has a bit turned over.
    LATE: every reply comes later by so many seconds.
    LOST_BYTES: this share of replies lacks a byte.
    NOISE: this share of replies comes behind random bytes.
    PIECES: replies come in pieces of so many bytes, 1 ms apart; 0 ends it.
    BABBLE: so many random bytes per second all the time.
    OVERLOAD: the servo of this id reports an overload, and shuts down if it is set to.
    BROWN_OUT: the servo of this id loses its power for a moment.
    TEMPERATURE: all servos have this temperature [degrees C].
    VOLTAGE: all servos have this supply [V].
    UNPLUGGED: the terminal is gone (1), or there is a new one behind the same link (0).
    """

    SILENT = "silent"
    MUTE = "mute"
    WRONG_CHECKSUM = "wrong_checksum"
    LATE = "late"
    LOST_BYTES = "lost_bytes"
    NOISE = "noise"
    PIECES = "pieces"
    BABBLE = "babble"
    OVERLOAD = "overload"
    BROWN_OUT = "brown_out"
    TEMPERATURE = "temperature"
    VOLTAGE = "voltage"
    UNPLUGGED = "unplugged"


def fault_named(name: str) -> BusFault:
    """Return the fault of this name.

    Raises:
        InvalidValueError: There is none.
    """
    try:
        return BusFault(name)
    except ValueError:
        raise InvalidValueError(f"fault = {name!r}: must be one of {', '.join(BusFault)}") from None


SHARES = (BusFault.WRONG_CHECKSUM, BusFault.LOST_BYTES, BusFault.NOISE)
"""Those whose number is a share of all replies."""


@dataclass(slots=True, eq=False)
class LineFaults:
    """What the wire does to replies.

    Attributes:
        random: What it draws from.
        values: Number of each fault that is switched on.
        harmed: How many replies did not go out as they should have.
    """

    random: np.random.Generator
    values: dict[BusFault, float] = field(default_factory=dict)
    harmed: int = 0

    def set(self, fault: BusFault, value: float) -> None:
        """Switch one on or off.

        Raises:
            InvalidValueError: A share above 1, or a number below 0.
        """
        if fault in SHARES and not 0.0 <= value <= 1.0:
            raise InvalidValueError(f"{fault} = {value:g}: must be a share of the replies, from 0 to 1")
        if not 0.0 <= value < float("inf"):
            raise InvalidValueError(f"{fault} = {value:g}: must be finite, 0 or above; 0 switches it off")
        self.values[fault] = value

    def distorted(self, reply: bytes) -> bytes:
        """Return what becomes of a reply on the wire."""
        draw, result = self.random, reply
        if self._happens(BusFault.WRONG_CHECKSUM):
            at = int(draw.integers(4, len(result)))  # behind the header, so that somebody looks at the checksum
            result = result[:at] + bytes([result[at] ^ (1 << int(draw.integers(8)))]) + result[at + 1 :]
        if self._happens(BusFault.LOST_BYTES):
            at = int(draw.integers(len(result)))
            result = result[:at] + result[at + 1 :]
        if self._happens(BusFault.NOISE):
            result = draw.bytes(int(draw.integers(1, 20))) + result
        self.harmed += result != reply
        return result

    def _happens(self, fault: BusFault) -> bool:
        share = self.values.get(fault, 0.0)
        return share > 0.0 and self.random.random() < share
