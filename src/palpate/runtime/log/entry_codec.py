"""Events and parameter changes as messages of a log: plain CDR, little endian."""

import struct
from dataclasses import dataclass

from palpate.errors import InvalidValueError
from palpate.runtime.live import Change
from palpate.runtime.log.entries import Event, Level
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.message_layout import CDR_LITTLE_ENDIAN, MESSAGE, SEQUENCES

EVENT_CHANNEL = 2
PARAMETER_CHANNEL = 3

LONGEST_TEXT = 10_000
"""Characters of a text that are kept: an exception's message may be any length."""

_HEADER = struct.Struct("<BQHIQQ4siI")
"""MCAP message record, encapsulation, stamp: as `MessageLayout` begins."""


@dataclass(frozen=True, slots=True)
class Entry:
    """An event or a change with its place in the log.

    Attributes:
        sequence: Consecutive over events and changes together.
        what: The entry.
    """

    sequence: int
    what: Event | Change


def encode_entry(entry: Entry, heading: Heading) -> bytes:
    """Return a whole MCAP message record."""
    what, stamp = entry.what, heading.stamp(entry.what.time)
    body = bytearray()
    if isinstance(what, Event):
        channel = EVENT_CHANNEL
        body.append(what.level)
        for text in (what.source, what.text, "", repr(float(what.time))):
            _put_text(body, text)
        body += bytes(-len(body) % 4) + bytes(4)
    else:
        channel = PARAMETER_CHANNEL
        body += struct.pack("<dd", what.time, what.value)
        _put_text(body, what.name)
    length = _HEADER.size - 9 + len(body)
    sec, nanosec = divmod(stamp, 10**9)
    header = _HEADER.pack(
        MESSAGE, length, channel, entry.sequence % SEQUENCES, stamp, stamp, CDR_LITTLE_ENDIAN, sec, nanosec
    )
    return header + body


def decode_entry(data: memoryview) -> tuple[Entry, int]:
    """Return the entry at the start of `data`, and the size of its record.

    Raises:
        InvalidValueError: There is none. What is found is not yet known to be what was written: the caller encodes
            it again and compares.
    """
    try:
        _, length, channel, sequence, _, _, _, _, _ = _HEADER.unpack_from(data)
        size = length + 9
        body = bytes(data[_HEADER.size : size])
        if channel == PARAMETER_CHANNEL:
            time, value = struct.unpack_from("<dd", body)
            name, _ = _take_text(body, 16)
            return Entry(sequence, Change(time, name, value)), size
        if channel == EVENT_CHANNEL:
            source, place = _take_text(body, 1)
            text, place = _take_text(body, place)
            _, place = _take_text(body, place)
            exact, _ = _take_text(body, place)
            return Entry(sequence, Event(float(exact), Level(body[0]), source, text)), size
    except (struct.error, ValueError, IndexError) as error:
        raise InvalidValueError(f"a message cannot be decoded: {error}") from None
    raise InvalidValueError(f"a message of channel {channel}, which palpate does not write")


def _put_text(body: bytearray, text: str) -> None:
    """Append length, characters and a closing zero, at a multiple of 4 (the stamp before it is 8 long)."""
    data = _plain(text).encode() + b"\0"
    body += bytes(-len(body) % 4) + struct.pack("<I", len(data)) + data


def _plain(text: str) -> str:
    """Return what can be kept of a text: no lone surrogates, not too long."""
    return text.encode("utf-8", "backslashreplace").decode()[:LONGEST_TEXT]


def _take_text(body: bytes, place: int) -> tuple[str, int]:
    place += -place % 4
    (length,) = struct.unpack_from("<I", body, place)
    end = place + 4 + length
    return body[place + 4 : end - 1].decode(), end
