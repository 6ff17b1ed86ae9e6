"""What a chunk of a log holds: rows and entries in the order in which they came."""

import struct
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.log.entry_codec import Entry, decode_entry, encode_entry
from palpate.runtime.log.message_layout import MESSAGE, Messages, Stamps
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.standard.cloud import CLOUD_CHANNEL, Cloud, cloud_message
from palpate.runtime.log.standard.topic import Block
from palpate.runtime.log.standard.topics import FIRST_CHANNEL, StandardTopics

PERIOD_CHANNEL = 1

_HEAD = struct.Struct("<BQH")
"""Opcode, length, channel of a message record."""

_HEAD_DTYPE = np.dtype([("opcode", "u1"), ("length", "<u8"), ("channel", "<u2")])

_OTHERS = "messages that do not agree with themselves or with this run's start"


@dataclass(frozen=True, slots=True)
class PackedRows:
    """Consecutive periods.

    Attributes:
        first: Number of the first period.
        data: Packed rows of float64.
    """

    first: int
    data: memoryview


@dataclass(frozen=True, slots=True, eq=False)
class LogRows:
    """Periods as read.

    Attributes:
        sequence: Number of each period, shape (n,), rising.
        values: Shape (n, width).
    """

    sequence: npt.NDArray[np.int64]
    values: FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ChunkContent:
    """The messages of a chunk, not compressed.

    Attributes:
        data: Message records.
        start: Earliest stamp [ns].
        end: Latest stamp [ns].
        index: For each channel, pairs of stamp and place in `data`, shape (n, 2).
    """

    data: bytes
    start: int
    end: int
    index: dict[int, npt.NDArray[np.uint64]]


def encode_chunk(
    segments: Sequence[PackedRows | LogRows | Entry], codec: PeriodCodec, standard: StandardTopics | None = None
) -> ChunkContent:
    """Return the messages of rows and entries, with the standard ones that tell the same if topics are given."""
    chunk = _Chunk()
    for segment in segments:
        if isinstance(segment, Entry):
            data = encode_entry(segment, codec.heading)
            stamps = codec.heading.stamps(np.array([segment.what.time]))
            chunk.add(data, (_Part(int.from_bytes(data[9:11], "little"), stamps, 0, len(data)),))
            continue
        if isinstance(segment, PackedRows):
            rows = codec.rows(segment.data)
            segment = LogRows(segment.first + np.arange(len(rows)), rows)
        if standard is None:
            messages = codec.encode(segment.values, segment.sequence)
            part = _Part(PERIOD_CHANNEL, messages["log_time"], 0, messages.itemsize)
            chunk.add(messages.view(np.uint8).data, (part,))
        else:
            _add_rows(chunk, Block.of(codec, segment.values, segment.sequence), codec, standard)
    return chunk.content()


def cloud_chunk(cloud: Cloud, stamp: int) -> ChunkContent:
    """Return a cloud alone; see `cloud_message`."""
    message, chunk = cloud_message(cloud, stamp), _Chunk()
    chunk.add(message.tobytes(), (_Part(CLOUD_CHANNEL, message["log_time"], 0, message.nbytes),))
    return chunk.content()


@dataclass(frozen=True, slots=True, eq=False)
class _Part:
    """Messages of one channel among others: the first one's place, and from each to the next."""

    channel: int
    stamps: Stamps
    first: int
    step: int


class _Chunk:
    """A chunk that grows."""

    def __init__(self) -> None:
        self._data: list[bytes | memoryview] = []
        self._index: dict[int, list[npt.NDArray[np.uint64]]] = {}
        self._size = 0

    def add(self, data: bytes | memoryview, parts: Iterable[_Part]) -> None:
        for part in parts:
            entries = np.empty((len(part.stamps), 2), np.uint64)
            entries[:, 0] = part.stamps
            entries[:, 1] = self._size + part.first + part.step * np.arange(len(entries))
            self._index.setdefault(part.channel, []).append(entries)
        self._data.append(data)
        self._size += len(data)

    def content(self) -> ChunkContent:
        index = {channel: np.concatenate(entries) for channel, entries in sorted(self._index.items())}
        stamps = np.concatenate([entries[:, 0] for entries in index.values()])
        return ChunkContent(b"".join(self._data), int(stamps.min()), int(stamps.max()), index)


def _add_rows(chunk: _Chunk, block: Block, codec: PeriodCodec, standard: StandardTopics) -> None:
    """Add each period followed by its standard messages, whose numbers the compressor finds just before them."""
    templates = [codec.template, *(topic.template for topic in standard.every_period)]
    ends = np.cumsum([template.itemsize for template in templates]).tolist()
    count, step = len(block.rows), ends[-1]
    together = np.tile(np.concatenate([template.view(np.uint8) for template in templates]), count)
    messages: list[Messages] = [
        np.ndarray((count,), template.dtype, together, end - template.itemsize, (step,))
        for template, end in zip(templates, ends, strict=True)
    ]
    codec.fill(messages[0], block.rows, block.sequence, block.stamps)
    for topic, theirs in zip(standard.every_period, messages[1:], strict=True):
        topic.fill(theirs, block)
    channels = (PERIOD_CHANNEL, *(topic.channel for topic in standard.every_period))
    begins = (end - each.itemsize for each, end in zip(messages, ends, strict=True))
    parts = (_Part(channel, block.stamps, place, step) for channel, place in zip(channels, begins, strict=True))
    chunk.add(together.data, parts)
    selected = standard.selected(block)
    for other in standard.seldom if len(selected.rows) else ():
        told = other.messages(selected)
        if len(told):
            chunk.add(told.view(np.uint8).data, (_Part(other.channel, told["log_time"], 0, told.itemsize),))


def decode_chunk(data: bytes, codec: PeriodCodec) -> list[LogRows | Entry]:
    """Return what `encode_chunk` was given. Standard messages are skipped: they tell nothing more.

    Raises:
        InvalidValueError: The messages are not what palpate writes for this run. Each is encoded again and
            compared, so that a chunk of another run, with valid check sums, does not pass.
    """
    found: list[LogRows | Entry] = []
    view, place = memoryview(data), 0
    while (place := _behind_standard(view, place)) < len(data):
        segment, size = _next_segment(view[place:], codec)
        found.append(segment)
        place += size
    return found


def _behind_standard(data: memoryview, place: int) -> int:
    """Return where the standard messages end that begin at a place, if any do."""
    while place + _HEAD.size <= len(data):
        opcode, length, channel = _HEAD.unpack_from(data, place)
        if opcode != MESSAGE or channel < FIRST_CHANNEL:
            break
        place += 9 + length
    return place


def _next_segment(data: memoryview, codec: PeriodCodec) -> tuple[LogRows | Entry, int]:
    size = codec.dtype.itemsize
    step = _behind_standard(data, size)  # from one period to the next
    count = max(0, (len(data) - size) // step + 1)
    octets = np.ndarray((count, size), np.uint8, data if count else None, strides=(step, 1))
    heads = np.ascontiguousarray(octets[:, : _HEAD.size]).view(_HEAD_DTYPE)[:, 0]
    is_period = (heads["opcode"] == MESSAGE) & (heads["channel"] == PERIOD_CHANNEL)
    count = len(heads) if is_period.all() else int(is_period.argmin())
    if count:
        messages: Messages = np.ascontiguousarray(octets[:count]).view(codec.dtype)[:, 0]
        rows = LogRows(messages["sequence"].astype(np.int64), codec.decode(messages))
        encoded = codec.encode(rows.values, rows.sequence)
        if encoded.tobytes() != messages.tobytes() or not codec.is_plausible(rows.values):
            raise InvalidValueError(_OTHERS)
        return rows, (count - 1) * step + size
    entry, size = decode_entry(data)
    if encode_entry(entry, codec.heading) != data[:size]:
        raise InvalidValueError(_OTHERS)
    return entry, size
