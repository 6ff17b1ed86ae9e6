"""Dynamixel Protocol 2.0 (ROBOTIS e-manual): instructions, errors, checksum and stuffing.

    FF FF FD 00 | id | length, 2 bytes | instruction | parameters | checksum, 2 bytes

Length counts from the instruction to the checksum inclusive; numbers begin with their low byte.
"""

from enum import IntEnum

HEADER = b"\xff\xff\xfd\x00"
"""Begins every packet; its first three bytes nowhere else, because an FD is stuffed in behind them."""

FORBIDDEN = b"\xff\xff\xfd"
"""What must not occur between instruction and checksum."""

BROADCAST_ID = 0xFE
"""All servos are meant."""

LARGEST_ID = 252
"""Of a servo (e-manual, ID(7))."""

STATUS = 0x55
"""In place of the instruction: this is a reply."""

ALERT = 0x80
"""Bit of a reply's error byte: Hardware Error Status(70) is not 0."""

OVERHEAD = 7
"""Bytes before the instruction."""


class Instruction(IntEnum):
    """What a packet asks for."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REG_WRITE = 0x04
    ACTION = 0x05
    FACTORY_RESET = 0x06
    REBOOT = 0x08
    CLEAR = 0x10
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83
    FAST_SYNC_READ = 0x8A
    BULK_READ = 0x92
    BULK_WRITE = 0x93
    FAST_BULK_READ = 0x9A


class DynamixelRefusal(IntEnum):
    """Why an instruction was not carried out: the low seven bits of a reply's error byte."""

    NONE = 0
    RESULT = 1
    INSTRUCTION = 2
    CHECKSUM = 3
    RANGE = 4
    LENGTH = 5
    LIMIT = 6
    ACCESS = 7


def _table() -> tuple[int, ...]:
    rows = []
    for byte in range(256):
        value = byte << 8
        for _ in range(8):
            value = (value << 1) ^ (0x8005 if value & 0x8000 else 0)
        rows.append(value & 0xFFFF)
    return tuple(rows)


_TABLE = _table()


def checksum(data: bytes | bytearray | list[int], start: int = 0) -> int:
    """Return the CRC-16 of bytes: polynomial 0x8005, nothing reflected, no final exclusive or.

    Args:
        data: The bytes.
        start: Checksum of what came before.
    """
    value, table = start, _TABLE
    for byte in data:
        value = ((value << 8) & 0xFFFF) ^ table[(value >> 8) ^ byte]
    return value


def stuffed(content: bytes) -> bytes:
    """Return instruction and parameters as they go on the wire."""
    return content.replace(FORBIDDEN, FORBIDDEN + b"\xfd")


def unstuffed(content: bytes) -> bytes:
    """Return instruction and parameters as they were meant.

    An FD behind FF FF FD goes, whatever follows; what follows it begins anew, as it does for who stuffed it.
    """
    return content.replace(FORBIDDEN + b"\xfd", FORBIDDEN)


def packet(servo_id: int, content: bytes) -> bytes:
    """Return a whole packet.

    Args:
        servo_id: For whom, or from whom.
        content: Instruction and parameters; of a reply `STATUS`, error byte and data.
    """
    inner = stuffed(content)
    body = HEADER + bytes((servo_id,)) + (len(inner) + 2).to_bytes(2, "little") + inner
    return body + checksum(body).to_bytes(2, "little")
