"""A log as a bag of ROS 2: a folder with the MCAP file and the metadata that `ros2 bag play` asks for."""

import contextlib
import shutil
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Attachment, Channel, Chunk, McapRecord, Message, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.summary import Summary
from mcap.writer import CompressionType, Writer

from palpate.atomic_file import replacing
from palpate.errors import InvalidValueError
from palpate.runtime.log.mcap_builder import PROFILE
from palpate.yaml_text import yaml_text

METADATA = "metadata.yaml"

_VERSION = 5
"""Of the metadata: ROS 2 Humble's, which later ones read as well (rosbag2_storage, metadata_io)."""


def write_bag(log: Path, folder: Path, *, complete: bool) -> Mapping[str, int]:
    """Write a log as a bag.

    Args:
        log: The file.
        folder: To make; it must not be there yet, as for `ros2 bag record`.
        complete: Whether the log is; of another one all that is whole is written anew, as a complete file.

    Returns:
        The number of messages on each topic that has any.

    Raises:
        InvalidValueError: The folder is there, or cannot be made.
        OSError: A file cannot be written.
    """
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise InvalidValueError(f"out = {folder}: is there already; a bag is a new folder, name another") from None
    except OSError as error:
        raise InvalidValueError(f"out = {folder}: {error.strerror}; choose another place") from None
    bag = folder / log.name
    with log.open("rb") as source, replacing(bag) as target:
        if complete:
            shutil.copyfileobj(source, target)
        else:
            _finish(source, target)
    with bag.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None  # the file is complete
    with replacing(folder / METADATA) as file:
        file.write(yaml_text({"rosbag2_bagfile_information": _information(bag.name, summary)}).encode())
    return {channel.topic: count for channel, count in _counted(summary)}


def _information(name: str, summary: Summary) -> dict[str, object]:
    statistics = summary.statistics
    assert statistics is not None
    extent = {
        "duration": {"nanoseconds": statistics.message_end_time - statistics.message_start_time},
        "starting_time": {"nanoseconds_since_epoch": statistics.message_start_time},
        "message_count": statistics.message_count,
    }
    return {
        "version": _VERSION,
        "storage_identifier": "mcap",
        **extent,
        "topics_with_message_count": _topics(summary),
        "compression_format": "",  # of whole files; chunks are MCAP's own business
        "compression_mode": "",
        "relative_file_paths": [name],
        "files": [{"path": name, **extent}],
    }


def _counted(summary: Summary) -> list[tuple[Channel, int]]:
    """Return each channel that has messages, with their number."""
    counts = {} if summary.statistics is None else summary.statistics.channel_message_counts
    return [(channel, counts[number]) for number, channel in summary.channels.items() if counts.get(number)]


def _topics(summary: Summary) -> list[dict[str, object]]:
    return [
        {
            "topic_metadata": {
                "name": channel.topic,
                "type": summary.schemas[channel.schema_id].name,
                "serialization_format": channel.message_encoding,
                "offered_qos_profiles": "",
            },
            "message_count": count,
        }
        for channel, count in _counted(summary)
    ]


def _finish(source: BinaryIO, target: BinaryIO) -> None:
    """Write all records that are whole into a new file, up to where nothing can be understood any more."""
    writer = Writer(target, compression=CompressionType.ZSTD)
    writer.start(profile=PROFILE)
    schemas: dict[int, int] = {}
    channels: dict[int, int] = {}
    with contextlib.suppress(McapError, struct.error, ValueError, LookupError):
        for record in _whole_records(source):
            if isinstance(record, Schema):
                schemas[record.id] = writer.register_schema(record.name, record.encoding, record.data)
            elif isinstance(record, Channel):
                channels[record.id] = writer.register_channel(
                    record.topic, record.message_encoding, schemas[record.schema_id], record.metadata
                )
            elif isinstance(record, Attachment):
                writer.add_attachment(
                    record.create_time, record.log_time, record.name, record.media_type, record.data
                )
            elif isinstance(record, Message):
                writer.add_message(
                    channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
    writer.finish()  # type: ignore[no-untyped-call]


def _whole_records(source: BinaryIO) -> Iterator[McapRecord]:
    for record in StreamReader(source, emit_chunks=True).records:
        if isinstance(record, Chunk):
            with contextlib.suppress(McapError, zstandard.ZstdError, struct.error, ValueError):
                yield from breakup_chunk(record, validate_crc=True)
        else:
            yield record
