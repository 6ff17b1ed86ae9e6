"""What was found after a run, added to its log."""

import struct
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.reader import make_reader

from palpate.errors import InvalidValueError
from palpate.runtime.log.chunk import cloud_chunk
from palpate.runtime.log.mcap_builder import MAGIC, McapBuilder
from palpate.runtime.log.standard.cloud import Cloud

_DATA_END = struct.Struct("<BQI")
"""Opcode, length and check sum of all before it."""


def add_cloud(path: Path, cloud: Cloud) -> None:
    """Add points to a log that is finished, stamped with its end, on the topic /map.

    All that is in the log stays where it is; only the index at its end is written anew, behind the points.

    Args:
        path: Of the log.
        cloud: In the base frame; of more than `MOST_POINTS` some, evenly.

    Raises:
        InvalidValueError: The log is not finished, or damaged at its end.
        OSError: It cannot be written; it is as it was.
    """
    with path.open("r+b") as file:
        builder, place, end = _resumed(path, file)
        file.seek(place)
        before = file.read()
        piece = builder.piece(cloud_chunk(cloud.thinned, end))
        builder.written(piece)
        after = piece.data + builder.closing()
        try:
            _put(file, place, after)
        except OSError:
            _put(file, place, before)
            file.truncate()
            raise


def _resumed(path: Path, file: BinaryIO) -> tuple[McapBuilder, int, int]:
    """Return what goes on with a file, from where on, and the latest stamp in it."""
    try:
        summary = make_reader(file).get_summary()
    except (McapError, struct.error, ValueError):
        summary = None
    if summary is None or summary.statistics is None:
        raise InvalidValueError(f"{path} is not finished, or damaged at its end: nothing can be added")
    file.seek(-len(MAGIC) - 20, 2)
    (summary_start,) = struct.unpack("<Q", file.read(8))
    place = summary_start - _DATA_END.size
    file.seek(place)
    _, _, crc = _DATA_END.unpack(file.read(_DATA_END.size))
    return McapBuilder.resumed(summary, place, crc), place, summary.statistics.message_end_time


def _put(file: BinaryIO, place: int, data: bytes) -> None:
    file.seek(place)
    file.write(data)
    file.flush()
