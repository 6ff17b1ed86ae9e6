"""What can go wrong with a sensor on Ethernet, and how the emulator does it."""

from dataclasses import dataclass
from enum import StrEnum

from palpate.errors import InvalidValueError


class NetFtFault(StrEnum):
    """A fault; its value in brackets. 0 ends it, unless it happens once."""

    SILENT = "silent"
    """Sends neither records nor replies (1: on)."""
    OUT_OF_RANGE = "out_of_range"
    """Status bits of an overload, readings at the end of the range (1: on)."""
    STATUS = "status"
    """Any status word (the word)."""
    GAP = "gap"
    """Once, records that are never sent; the counters of both kinds jump (how many)."""
    RESTARTED = "restarted"
    """Once, both counters begin anew while the stream goes on."""
    REBOOTED = "rebooted"
    """Once, counters begin anew and nobody is the destination any more."""
    DROPPED = "dropped"
    """Every k-th record is lost (k)."""
    REORDERED = "reordered"
    """Every k-th record comes after the next one (k >= 2)."""
    REPEATED = "repeated"
    """Every k-th record is sent twice (k)."""
    WRONG_LENGTH = "wrong_length"
    """Every k-th record is cut short by a byte, or has one more, in turn (k)."""


@dataclass(slots=True)
class ActiveFaults:
    """Those that last; 0: off."""

    silent: bool = False
    out_of_range: bool = False
    status: int = 0
    dropped: int = 0
    reordered: int = 0
    repeated: int = 0
    wrong_length: int = 0

    @property
    def disturbs(self) -> bool:
        """Whether datagrams must be looked at one by one."""
        return bool(self.dropped or self.reordered or self.repeated or self.wrong_length)


def whole_number(fault: str, value: float, most: int) -> int:
    """Return the value of a fault that counts.

    Raises:
        InvalidValueError: Not a whole number from 0 to `most`.
    """
    if not 0 <= value <= most or value != int(value):
        raise InvalidValueError(f"fault {fault!r} = {value!r}: must be a whole number, 0 to {most}")
    return int(value)


def fault_named(fault: str) -> NetFtFault:
    """Return the fault of a name.

    Raises:
        InvalidValueError: There is none; the message lists them.
    """
    try:
        return NetFtFault(fault)
    except ValueError:
        known = ", ".join(f"{one.value!r}" for one in NetFtFault)
        raise InvalidValueError(f"fault {fault!r} is unknown: must be one of {known}") from None
