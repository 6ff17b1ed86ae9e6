"""A log once more, with topics of types that other tools know beside its own.

They are made after the run: while it goes on, its process has better things to do.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import BinaryIO

from palpate.atomic_file import replacing
from palpate.errors import InvalidValueError
from palpate.runtime.log.chunk import ChunkContent, cloud_chunk, encode_chunk
from palpate.runtime.log.mcap_builder import run_builder
from palpate.runtime.log.reader import LogReader
from palpate.runtime.log.standard.cloud import Cloud
from palpate.runtime.log.standard.topics import RobotNotes, StandardTopics

Progress = Callable[[float], None]
"""Told now and then which fraction is done."""


def add_topics(path: Path, notes: RobotNotes, cloud: Cloud | None = None) -> None:
    """Write a finished log anew, with standard topics; it is replaced when all is written, or stays as it was.

    Args:
        path: The log.
        notes: What is known of the robot.
        cloud: What was found, for the topic /map, stamped with the end of the run; of more than `MOST_POINTS`
            points some, evenly.

    Raises:
        InvalidValueError: It is no log, or not whole.
        OSError: It cannot be read or written.
    """
    with LogReader(path) as log, replacing(path) as file:
        write_told(log, file, lambda texts: notes, cloud)
        if not log.complete:
            raise InvalidValueError(f"{path} is not whole: {log.damage_words or 'it has no end'}")


def write_told(
    log: LogReader,
    file: BinaryIO,
    notes: Callable[[Mapping[str, str]], RobotNotes],
    cloud: Cloud | None = None,
    progress: Progress | None = None,
) -> None:
    """Write all that can be read of a log into a new file, with standard topics.

    Args:
        log: Of which nothing was read yet.
        file: To write to.
        notes: From the texts that the log keeps to what is known of the robot.
        cloud: See `add_topics`.
        progress: Told which fraction has been read.

    Raises:
        OSError: The file cannot be written.
    """
    told: _Told | None = None
    for chunk in log.chunks(progress):
        told = told or _Told(log, file, notes)  # the texts are known now
        told.append(encode_chunk(chunk, log.codec, told.topics))
    if told is not None and cloud is not None:
        told.append(cloud_chunk(cloud.thinned, told.builder.end))
    told = told or _Told(log, file, notes)
    file.write(told.builder.closing())


class _Told:
    """The new file, begun."""

    def __init__(self, log: LogReader, file: BinaryIO, notes: Callable[[Mapping[str, str]], RobotNotes]) -> None:
        self.topics = StandardTopics(log.codec, notes(log.attachments))
        self.builder, self._file = run_builder(log.codec, self.topics), file
        file.write(self.builder.opening(log.codec.heading, log.attachments))

    def append(self, content: ChunkContent) -> None:
        piece = self.builder.piece(content)
        self._file.write(piece.data)
        self.builder.written(piece)
