"""The records of an MCAP file one after the other, trusting nothing: no length, no check sum left out."""

import os
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import zstandard
from mcap.opcode import Opcode

from palpate.errors import PalpateError
from palpate.runtime.log.mcap_builder import COMPRESSION, MAGIC

LARGEST_RECORD = 2**26
"""Bytes; palpate's own are below 2**24. A length beyond is damage, not a reason to ask for so much memory."""

LARGEST_CONTENT = 2**24
"""Bytes of a chunk's messages; palpate's own are below 2**22."""

_CHUNK = struct.Struct("<QQQI")
_ATTACHMENT = struct.Struct("<QQ")
_FOOTER = struct.Struct("<BQQQI")


class DamageError(PalpateError):
    """Something in a log is not as palpate writes it."""


@dataclass(frozen=True, slots=True)
class RawRecord:
    """One record.

    Attributes:
        place: Of its first byte in the file.
        opcode: What it is.
        body: What follows opcode and length.
    """

    place: int
    opcode: int
    body: bytes


@dataclass(frozen=True, slots=True)
class RawChunk:
    """A chunk whose check sum is right.

    Attributes:
        start: Earliest stamp [ns].
        end: Latest stamp [ns].
        data: Message records.
    """

    start: int
    end: int
    data: bytes


class McapWalk:
    """Walks through the data section.

    Attributes:
        place: Of the next byte.
        size: Of the file when it was opened; what a writer appends meanwhile is left alone.
        crc: Check sum of all bytes so far.
    """

    def __init__(self, file: BinaryIO) -> None:
        """Take the magic bytes.

        Raises:
            DamageError: There are none.
        """
        self._file = file
        self.place, self.crc = 0, 0
        self.size = os.fstat(file.fileno()).st_size
        if self._take(min(len(MAGIC), self.size)) != MAGIC:
            raise DamageError("it is no MCAP file")

    def records(self) -> Iterator[RawRecord]:
        """Yield record after record of the data section; ends before its last, DataEnd, or at the end of the file.

        Raises:
            DamageError: The file is cut off within a record, or a length is impossible.
        """
        while self.place < self.size:
            place, crc = self.place, self.crc
            head = self._take(min(9, self.size - place))
            if len(head) < 9:
                raise DamageError(f"cut off at byte {self.size}")
            opcode, length = struct.unpack("<BQ", head)
            if opcode == Opcode.DATA_END:
                self.place, self.crc = place, crc
                return
            if length > self.size - self.place:
                raise DamageError(f"cut off at byte {self.size}, or the length at byte {place + 1} is wrong")
            if length > LARGEST_RECORD:
                raise DamageError(f"the record at byte {place} claims {length} bytes")
            yield RawRecord(place, opcode, self._take(length))

    def check_end(self) -> None:
        """Check what follows the data section.

        Raises:
            DamageError: A check sum is wrong, or something is missing.
        """
        self._file.seek(self.place)
        if self.size - self.place > LARGEST_RECORD:
            raise DamageError(f"no end where there should be one, at byte {self.place}")
        end = self._file.read(self.size - self.place)
        summary_start = self.place + 13
        if len(end) < 13 + _FOOTER.size + len(MAGIC) or end[:9] != struct.pack("<BQ", Opcode.DATA_END, 4):
            raise DamageError(f"the end is cut off at byte {self.size}")
        if int.from_bytes(end[9:13], "little") != self.crc:
            raise DamageError("a byte differs outside of the chunks (check sum of the data section)")
        opcode, length, summary, _, crc = _FOOTER.unpack(end[-len(MAGIC) - _FOOTER.size : -len(MAGIC)])
        if end[-len(MAGIC) :] != MAGIC or (opcode, length, summary) != (Opcode.FOOTER, 20, summary_start):
            raise DamageError("the summary is cut off or damaged")
        if crc != zlib.crc32(end[13 : -len(MAGIC) - 4]):
            raise DamageError("the summary is damaged (check sum)")

    def _take(self, count: int) -> bytes:
        self._file.seek(self.place)
        data = self._file.read(count)
        if len(data) != count:
            raise DamageError(f"cut off at byte {self.place + len(data)}")
        self.crc = zlib.crc32(data, self.crc)
        self.place += count
        return data


@dataclass(frozen=True, slots=True)
class RawAttachment:
    """An attachment whose check sum is right.

    Attributes:
        times: Of log and creation [ns].
        name: Of the attachment.
        data: What is attached.
    """

    times: tuple[int, int]
    name: str
    data: bytes


def attachment_of(record: RawRecord) -> RawAttachment:
    """Return an attachment.

    Raises:
        DamageError: Its check sum is wrong, or its parts do not fill it.
    """
    body = record.body
    try:
        logged, created = _ATTACHMENT.unpack_from(body)
        name, place = _prefixed(body, _ATTACHMENT.size, 4)
        _, place = _prefixed(body, place, 4)
        data, place = _prefixed(body, place, 8)
        text = name.decode()
    except (struct.error, UnicodeDecodeError):
        raise DamageError(f"the attachment at byte {record.place} is damaged") from None
    if len(body) != place + 4 or int.from_bytes(body[place:], "little") != zlib.crc32(body[:place]):
        raise DamageError(f"the attachment {text!r} at byte {record.place} is damaged (check sum)")
    return RawAttachment((logged, created), text, data)


def chunk_of(record: RawRecord) -> RawChunk:
    """Return a chunk, decompressed.

    Raises:
        DamageError: It cannot be decompressed to what it claims, or its check sum is wrong or missing.
    """
    where = f"the chunk at byte {record.place}"
    try:
        start, end, size, crc = _CHUNK.unpack_from(record.body)
        compression, place = _prefixed(record.body, _CHUNK.size, 4)
        compressed, place = _prefixed(record.body, place, 8)
    except struct.error:
        raise DamageError(f"{where} is damaged") from None
    if place != len(record.body) or compression != COMPRESSION.encode():
        raise DamageError(f"{where} is damaged, or another program has written it")
    if size > LARGEST_CONTENT:
        raise DamageError(f"{where} claims {size} bytes of messages")
    try:
        # the size in the frame's own header is what the library would reserve
        if zstandard.get_frame_parameters(compressed).content_size != size:
            raise DamageError(f"{where} is damaged (sizes differ)")
        data = zstandard.ZstdDecompressor().decompress(compressed, max_output_size=size, allow_extra_data=False)
    except zstandard.ZstdError:
        raise DamageError(f"{where} cannot be decompressed") from None
    if len(data) != size or crc != zlib.crc32(data):
        raise DamageError(f"{where} is damaged (check sum)")
    return RawChunk(start, end, data)


def _prefixed(body: bytes, place: int, width: int) -> tuple[bytes, int]:
    """Return bytes that come after their length, and the place behind them.

    Raises:
        struct.error: They are not all there.
    """
    start = place + width
    end = start + int.from_bytes(body[place:start], "little")
    if start > len(body) or end > len(body):
        raise struct.error
    return body[start:end], end
