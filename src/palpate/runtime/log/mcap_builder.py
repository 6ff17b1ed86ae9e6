"""The records of an MCAP file around our chunks, made with the classes of the mcap library.

https://mcap.dev/spec. Order in the file: header, schemas, channels, attachments; then chunks, each with its
message indexes; then the summary. The first attachment is the heading. It carries the check sum of all before it,
since MCAP has none for schemas and channels.
"""

import struct
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Schema,
    Statistics,
    SummaryOffset,
)

from palpate.runtime.log.chunk import PERIOD_CHANNEL, ChunkContent
from palpate.runtime.log.entry_codec import EVENT_CHANNEL, PARAMETER_CHANNEL
from palpate.runtime.log.heading import Heading, encode_heading
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.schema import EVENT, PARAMETER, PERIOD, PLAIN_TYPES, full_name, own_types, schema
from palpate.runtime.log.standard.cloud import CLOUD_CHANNEL, CLOUD_TOPIC
from palpate.runtime.log.standard.topics import StandardTopics
from palpate.runtime.log.standard.types import POINT_CLOUD, STANDARD_TYPES

MAGIC = b"\x89MCAP0\r\n"
PROFILE = "ros2"
HEADING_NAME = "palpate_log.json"
COMPRESSION = "zstd"
COMPRESSION_LEVEL = 1
"""Of 60 random doubles at 1 kHz, level 1 leaves 0.49 MB/s in half a millisecond of the writer's time per block,
without the interpreter's lock; levels 3 and 6 the same in two and four times as long, LZ4 0.52 MB/s in a third."""

_MEDIA_TYPES = {".json": "application/json", ".yaml": "application/yaml", ".csv": "text/csv"}


@dataclass(frozen=True, slots=True, eq=False)
class Piece:
    """A chunk with its message indexes, ready to be appended.

    Attributes:
        data: Bytes of the file.
        entry: The chunk's record in the summary.
        content: What is in it.
    """

    data: bytes
    entry: bytes
    content: ChunkContent


class McapBuilder:
    """Knows what has been written so far, and makes what comes next. Memory: about 100 bytes per chunk."""

    def __init__(self, schemas: Sequence[Schema], channels: Sequence[Channel]) -> None:
        """Begin a file with these; see `run_builder`."""
        self._schemas, self._channels = tuple(schemas), tuple(channels)
        self._compressor = zstandard.ZstdCompressor(level=COMPRESSION_LEVEL)
        self._attachment_entries: list[AttachmentIndex] = []
        self._chunk_entries = bytearray()
        self._counts: dict[int, int] = dict.fromkeys((channel.id for channel in channels), 0)
        self._chunks = 0
        self._start, self._end = 0, 0
        self._size = self._crc = 0

    def opening(self, given: Heading, attachments: Mapping[str, str]) -> bytes:
        """Return what the file begins with.

        Args:
            given: Of the run.
            attachments: Texts to attach, by name.
        """
        head = MAGIC + _records([Header(PROFILE, given.written_by), *self._schemas, *self._channels])
        parts = [head]
        heading = encode_heading(given, zlib.crc32(head))
        place = len(head)
        texts = {HEADING_NAME: heading} | {
            name: text.encode("utf-8", "backslashreplace") for name, text in attachments.items()
        }
        for name, data in texts.items():
            suffix = name[name.rfind(".") :]
            attachment = Attachment(
                create_time=given.wall_start,
                log_time=given.wall_start,
                name=name,
                media_type=_MEDIA_TYPES.get(suffix, "text/plain"),
                data=data,
            )
            record = _records([attachment])
            self._attachment_entries.append(
                AttachmentIndex(
                    offset=place,
                    length=len(record),
                    log_time=attachment.log_time,
                    create_time=attachment.create_time,
                    data_size=len(data),
                    name=name,
                    media_type=attachment.media_type,
                )
            )
            parts.append(record)
            place += len(record)
        opening = b"".join(parts)
        self._advance(opening)
        return opening

    def piece(self, content: ChunkContent) -> Piece:
        """Return the next chunk; `written` tells that it has been appended."""
        compressed = self._compressor.compress(content.data)
        chunk = Chunk(
            compression=COMPRESSION,
            data=compressed,
            message_start_time=content.start,
            message_end_time=content.end,
            uncompressed_crc=zlib.crc32(content.data),
            uncompressed_size=len(content.data),
        )
        parts = [_records([chunk])]
        indexes_start = place = self._size + len(parts[0])
        places: dict[int, int] = {}
        for channel, entries in content.index.items():
            places[channel] = place
            # as MessageIndex.write, which takes 0.3 ms for 200 messages in Python
            body = entries.astype("<u8", copy=False).tobytes()
            parts.append(struct.pack("<BQHI", Opcode.MESSAGE_INDEX, len(body) + 6, channel, len(body)) + body)
            place += len(parts[-1])
        entry = ChunkIndex(
            chunk_length=len(parts[0]),
            chunk_start_offset=self._size,
            compression=COMPRESSION,
            compressed_size=len(compressed),
            message_end_time=content.end,
            message_index_length=place - indexes_start,
            message_index_offsets=places,
            message_start_time=content.start,
            uncompressed_size=len(content.data),
        )
        return Piece(b"".join(parts), _records([entry]), content)

    def written(self, piece: Piece) -> None:
        """Count a piece that is in the file now."""
        self._advance(piece.data)
        content = piece.content
        self._start = content.start if self._chunks == 0 else min(self._start, content.start)
        self._end = max(self._end, content.end)
        self._chunk_entries += piece.entry
        self._chunks += 1
        for channel, entries in content.index.items():
            self._counts[channel] += len(entries)

    @property
    def end(self) -> int:
        """Latest stamp of a message that was written [ns]."""
        return self._end

    def closing(self) -> bytes:
        """Return what the file ends with."""
        data_end = _records([DataEnd(self._crc)])
        summary_start = self._size + len(data_end)
        statistics = Statistics(
            attachment_count=len(self._attachment_entries),
            channel_count=len(self._channels),
            channel_message_counts=self._counts,
            chunk_count=self._chunks,
            message_count=sum(self._counts.values()),
            message_end_time=self._end,
            message_start_time=self._start,
            metadata_count=0,
            schema_count=len(self._schemas),
        )
        groups = {
            Opcode.SCHEMA: _records(self._schemas),
            Opcode.CHANNEL: _records(self._channels),
            Opcode.STATISTICS: _records([statistics]),
            Opcode.CHUNK_INDEX: bytes(self._chunk_entries),
            Opcode.ATTACHMENT_INDEX: _records(self._attachment_entries),
        }
        place, offsets = summary_start, []
        for opcode, group in groups.items():
            if group:
                offsets.append(SummaryOffset(opcode, place, len(group)))
            place += len(group)
        summary = b"".join(groups.values()) + _records(offsets)
        # the check sum goes over the summary and the footer up to the check sum itself
        footer = struct.pack("<BQQQ", Opcode.FOOTER, 20, summary_start, place)
        crc = zlib.crc32(footer, zlib.crc32(summary))
        return data_end + summary + _records([Footer(summary_start, place, crc)]) + MAGIC

    def _advance(self, data: bytes) -> None:
        self._size += len(data)
        self._crc = zlib.crc32(data, self._crc)


def run_builder(codec: PeriodCodec, standard: StandardTopics | None = None) -> McapBuilder:
    """Return the builder of a run's log: with palpate's own topics, and those that other tools read if given."""
    topics = [
        (PERIOD_CHANNEL, "/period", PERIOD),
        (EVENT_CHANNEL, "/event", EVENT),
        (PARAMETER_CHANNEL, "/parameter", PARAMETER),
    ]
    if standard is not None:
        topics.append((CLOUD_CHANNEL, CLOUD_TOPIC, POINT_CLOUD))
        topics += [(each.channel, each.name, each.kind) for each in (*standard.every_period, *standard.seldom)]
    codes, truth = codec.heading.codes, codec.heading.layout.truth
    types = {**PLAIN_TYPES, **STANDARD_TYPES, **own_types(codes, truth)}
    kinds = {kind: i + 1 for i, kind in enumerate(dict.fromkeys(kind for _, _, kind in topics))}
    schemas = [_schema(i, full_name(kind), schema(kind, types)) for kind, i in kinds.items()]
    return McapBuilder(schemas, [_channel(number, topic, kinds[kind]) for number, topic, kind in topics])


def _schema(number: int, name: str, text: str) -> Schema:
    return Schema(id=number, data=text.encode(), encoding="ros2msg", name=name)


def _channel(number: int, topic: str, schema_number: int) -> Channel:
    return Channel(id=number, topic=topic, message_encoding="cdr", metadata={}, schema_id=schema_number)


def _records(records: Iterable[McapRecord]) -> bytes:
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())  # type: ignore[no-untyped-call]
