"""A log as a bag of ROS 2: a folder with the MCAP file and the metadata that `ros2 bag play` asks for."""

import shutil
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Channel
from mcap.summary import Summary

from palpate.atomic_file import replacing
from palpate.errors import InvalidValueError
from palpate.runtime.log.reader import LogReader
from palpate.runtime.log.standard.topics import FIRST_CHANNEL, RobotNotes
from palpate.runtime.log.told_log import Progress, write_told
from palpate.yaml_text import yaml_text

METADATA = "metadata.yaml"

_VERSION = 5
"""Of the metadata: ROS 2 Humble's, which later ones read as well (rosbag2_storage, metadata_io)."""


@dataclass(frozen=True, slots=True)
class Bag:
    """What was written.

    Attributes:
        files: The log's file, and the metadata.
        counts: Messages on each topic that has any.
        damage: What of the log could not be read, one line; None if all could.
    """

    files: tuple[Path, ...]
    counts: Mapping[str, int]
    damage: str | None


def write_bag(
    log: Path,
    folder: Path,
    notes: Callable[[Mapping[str, str]], RobotNotes],
    progress: Progress | None = None,
) -> Bag:
    """Write a log as a bag: the very same file if it is whole and has standard topics; else anew, with them.

    Args:
        log: The file.
        folder: To make; it must not be there yet, as for `ros2 bag record`.
        notes: From the texts that the log keeps to what is known of the robot.
        progress: Told now and then which fraction is done.

    Raises:
        InvalidValueError: There is no log, or the folder is there, or cannot be made.
        OSError: A file cannot be written.
    """
    whole = _is_told(log) and _is_whole(log, progress)
    with LogReader(log) as reader:
        _make(folder)
        bag = folder / log.name
        with replacing(bag) as file:
            if whole:
                with log.open("rb") as source:
                    shutil.copyfileobj(source, file)
            else:
                write_told(reader, file, notes, progress=progress)
    with bag.open("rb") as read:
        summary = make_reader(read).get_summary()
    assert summary is not None  # the file is complete
    metadata = folder / METADATA
    with replacing(metadata) as file:
        file.write(yaml_text({"rosbag2_bagfile_information": _information(bag.name, summary)}).encode())
    counts = {channel.topic: count for channel, count in _counted(summary)}
    return Bag((bag, metadata), counts, reader.damage_words)


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise InvalidValueError(f"out = {folder}: is there already; a bag is a new folder, name another") from None
    except OSError as error:
        raise InvalidValueError(f"out = {folder}: {error.strerror}; choose another place") from None


def _is_whole(log: Path, progress: Progress | None) -> bool:
    """Whether every check sum is right."""
    with LogReader(log) as reader:
        for _ in reader.pieces(progress):
            pass
        return reader.complete


def _is_told(log: Path) -> bool:
    """Whether a log has an end, and standard topics."""
    try:
        with log.open("rb") as file:
            summary = make_reader(file).get_summary()
    except (McapError, struct.error, ValueError):
        return False
    return summary is not None and max(summary.channels, default=0) >= FIRST_CHANNEL


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
