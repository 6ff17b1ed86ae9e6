"""What a chunk of a log holds: rows and entries in the order in which they came."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.log.entry_codec import Entry, decode_entry, encode_entry
from palpate.runtime.log.period_codec import MESSAGE, Messages, PeriodCodec

PERIOD_CHANNEL = 1


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


def encode_chunk(segments: Sequence[PackedRows | Entry], codec: PeriodCodec) -> ChunkContent:
    """Return the messages of rows and entries."""
    parts: list[bytes] = []
    index: dict[int, list[npt.NDArray[np.uint64]]] = {}
    place = 0
    for segment in segments:
        if isinstance(segment, Entry):
            data = encode_entry(segment, codec.heading)
            stamps = codec.heading.stamps(np.array([segment.what.time]))
            channel, step = int.from_bytes(data[9:11], "little"), len(data)
        else:
            rows = codec.rows(segment.data)
            messages = codec.encode(rows, np.arange(segment.first, segment.first + len(rows)))
            data, stamps = messages.tobytes(), messages["log_time"]
            channel, step = PERIOD_CHANNEL, messages.itemsize
        entries = np.empty((len(stamps), 2), np.uint64)
        entries[:, 0] = stamps
        entries[:, 1] = np.arange(place, place + len(data), step)
        index.setdefault(channel, []).append(entries)
        parts.append(data)
        place += len(data)
    joined = {channel: np.concatenate(entries) for channel, entries in sorted(index.items())}
    stamps = np.concatenate([entries[:, 0] for entries in joined.values()])
    return ChunkContent(b"".join(parts), int(stamps.min()), int(stamps.max()), joined)


def decode_chunk(data: bytes, codec: PeriodCodec) -> list[LogRows | Entry]:
    """Return what `encode_chunk` was given.

    Raises:
        InvalidValueError: The messages are not what palpate writes for this run. Each is encoded again and
            compared, so that a chunk of another run, with valid check sums, does not pass.
    """
    found: list[LogRows | Entry] = []
    view, place = memoryview(data), 0
    while place < len(data):
        segment, size = _next_segment(view[place:], codec)
        found.append(segment)
        place += size
    return found


def _next_segment(data: memoryview, codec: PeriodCodec) -> tuple[LogRows | Entry, int]:
    messages: Messages = np.frombuffer(data, codec.dtype, len(data) // codec.dtype.itemsize)
    is_period = (messages["opcode"] == MESSAGE) & (messages["channel"] == PERIOD_CHANNEL)
    count = len(messages) if is_period.all() else int(is_period.argmin())
    if count:
        messages = messages[:count]
        rows = LogRows(messages["sequence"].astype(np.int64), codec.decode(messages))
        encoded, size = codec.encode(rows.values, rows.sequence).tobytes(), messages.nbytes
        segment: LogRows | Entry = rows
    else:
        segment, size = decode_entry(data)
        encoded = encode_entry(segment, codec.heading)
    plausible = isinstance(segment, Entry) or codec.is_plausible(segment.values)
    if encoded != data[:size] or not plausible:
        raise InvalidValueError("messages that do not agree with themselves or with this run's start")
    return segment, size
