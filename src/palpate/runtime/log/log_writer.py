"""A run in an MCAP file, written by a thread of its own."""

import queue
import threading
from array import array
from bisect import bisect_right
from collections.abc import Mapping
from pathlib import Path
from time import monotonic
from types import MappingProxyType

from palpate.errors import InvalidValueError
from palpate.runtime.log.chunk import PERIOD_CHANNEL, ChunkContent, PackedRows, encode_chunk
from palpate.runtime.log.entries import Event, Level
from palpate.runtime.log.entry_codec import Entry
from palpate.runtime.log.heading import Heading
from palpate.runtime.log.log_file import LogFile, LogGoneError
from palpate.runtime.log.log_path import point_latest
from palpate.runtime.log.mcap_builder import HEADING_NAME, McapBuilder, run_builder
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.log.sink import RecordingSummary

BACKLOG = 32 * 2**20
"""Bytes that may wait for the disk: about a minute at 1 kHz. Beyond, periods are dropped and counted."""

RESERVE = 2**20
"""Bytes on top of the backlog for events and parameter changes."""

ENTRY_COST = 512
"""Bytes that an event or a change counts for, besides its text."""

LARGEST_ATTACHMENT = 2**24
"""Characters."""

LARGEST_CHUNK = 2**20
"""Bytes of rows from which a chunk takes no more. It grows so large only where blocks come faster than the
interpreter's lock: in simulations that do not wait."""

GATHERING = 0.3
"""[s] for which blocks gather where they come much faster than from a robot: in simulations that do not wait. What
is written meanwhile holds the loop up, for two threads then want the interpreter's lock all the time."""

FASTEST_PACE = 0.1
"""[s] from chunk to chunk: a block that comes sooner is of such a simulation. A robot's take 0.2 s."""

CLOSING_TIME = 10.0
"""How long `close` waits for the disk [s]."""


class LogWriter:
    """A sink that writes an MCAP file. What it has not got done when the backlog is full is dropped and counted.

    Every chunk is in the file, complete and with its check sum, before the next one is begun. If the disk is full,
    or fails, the file ends with the last good chunk and the rest of the run is counted as lost; so is what others
    have cut off, and all of a file that is no longer where it was.
    """

    def __init__(
        self,
        path: Path,
        attachments: Mapping[str, str] = MappingProxyType({}),
        *,
        backlog: int = BACKLOG,
        closing_time: float = CLOSING_TIME,
    ) -> None:
        """Say where to write.

        Args:
            path: The file to make; see `new_log_path`.
            attachments: Texts to keep with the run ("experiment.yaml", "versions.yaml"), by name.
            backlog: Bytes of rows that may wait for the disk.
            closing_time: How long to wait for the disk at the end [s].

        Raises:
            InvalidValueError: An attachment has the name of the heading, or is too long.
        """
        for name, text in attachments.items():
            if name == HEADING_NAME:
                raise InvalidValueError(f"attachment {name!r}: is palpate's own; choose another name")
            if len(text) > LARGEST_ATTACHMENT:
                raise InvalidValueError(
                    f"attachment {name!r} has {len(text)} characters: at most {LARGEST_ATTACHMENT}; "
                    f"keep it beside the log"
                )
        self._path, self._attachments = path, dict(attachments)
        self._backlog, self._closing_time = backlog, closing_time
        self._queue: queue.SimpleQueue[PackedRows | Entry | None] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self._note = ""
        self._problem: str | None = None  # set by the writer's thread, once
        self._offered = self._put = 0  # by the loop's thread alone: rows; bytes
        self._written = self._taken = 0  # by the writer's alone
        self._entries = self._entries_put = 0
        self._ends, self._rows_until = array("q"), array("q")  # of each chunk: its end in the file, rows so far
        self._row_bytes = 1
        self._time = 0.0  # of the last period written
        self._closing = False
        self._hurry, self._begun, self._closing_asked = threading.Event(), 0.0, False

    def start(self, heading: Heading) -> None:
        """Make the file, write what it begins with, and start the thread.

        Raises:
            InvalidValueError: There is a file of this name, or the folder cannot be written.
        """
        codec = PeriodCodec(heading, PERIOD_CHANNEL)
        self._row_bytes = codec.row_bytes
        builder = run_builder(codec)
        self._time = heading.first_time
        try:
            file = LogFile.begun(self._path, builder.opening(heading, self._attachments))
        except OSError as error:
            raise InvalidValueError(f"log {self._path}: {error.strerror}; choose another place") from None
        self._note = point_latest(self._path)
        # a daemon: a disk that hangs must not keep the process from ending
        self._thread = threading.Thread(
            target=self._write, args=(file, builder, codec), name="palpate log writer", daemon=True
        )
        self._thread.start()

    def rows(self, rows: PackedRows) -> None:
        """See `Sink`."""
        size = len(rows.data)
        self._offered += size // self._row_bytes
        if self._problem is None and self._put - self._taken + size <= self._backlog:
            self._put += size
            self._queue.put(rows)
            if self._put - self._taken > self._backlog // 4:
                self._hurry.set()

    def entry(self, entry: Entry) -> None:
        """See `Sink`."""
        self._entries = entry.sequence + 1
        if self._problem is None and self._put - self._taken <= self._backlog + RESERVE:
            self._put += _cost(entry)
            self._entries_put += 1
            self._queue.put(entry)

    def close(self) -> RecordingSummary:
        """See `Sink`."""
        thread = self._thread
        if thread is not None:
            self._queue.put(None)
            self._closing_asked = True
            self._hurry.set()
            thread.join(self._closing_time)
        written, problem = self._written, self._problem
        lost = self._offered - written
        if thread is not None and thread.is_alive():
            problem = (
                problem or f"{self._path} takes too long to be written, given up after {self._closing_time:g} s"
            )
        elif problem is None and (lost or self._entries > self._entries_put):
            what = f"{lost} periods" if lost else f"{self._entries - self._entries_put} events"
            problem = f"{what} were dropped: {self._path} was not written fast enough"
        return RecordingSummary(self._path, written, lost, problem, self._note)

    def _write(self, file: LogFile, builder: McapBuilder, codec: PeriodCodec) -> None:
        """Write until asked to stop: the thread."""
        try:
            while segments := self._next_segments():
                content = encode_chunk(segments, codec)
                self._append(file, builder, content)
                rows = [segment for segment in segments if isinstance(segment, PackedRows)]
                if rows:
                    self._time = float(codec.rows(rows[-1].data)[-1, 0])
                    self._written += sum(len(block.data) for block in rows) // self._row_bytes
                self._ends.append(file.size)
                self._rows_until.append(self._written)
        except Exception as error:  # the loop must not know; the summary does
            self._fail(error, codec)
            while self._next_segments():
                pass  # no more is put in, and what is there is lost
        try:
            with file:
                self._finish(file, builder, codec)
                file.check()
        except LogGoneError as error:
            self._fail(error, codec)
        except Exception as error:  # the log is readable without its end
            self._problem = self._problem or f"the end of the log was not written: {error}"

    def _fail(self, error: Exception, codec: PeriodCodec) -> None:
        """Note why no more is written, and count what is left."""
        if isinstance(error, LogGoneError):
            whole = bisect_right(self._ends, error.left)
            self._written = self._rows_until[whole - 1] if whole else 0
            self._problem = f"{self._path}: {error}; {self._written or 'no'} periods are left"
        elif self._problem is None:
            done = self._time - codec.heading.first_time
            self._problem = f"recording ended after {done:.3f} s: {error}; the log is readable up to there"

    def _next_segments(self) -> list[PackedRows | Entry]:
        """Wait for something to write and return all there is of it; nothing when the recording is over."""
        segments: list[PackedRows | Entry] = []
        size = 0
        while not self._closing and size < LARGEST_CHUNK and not (segments and self._queue.empty()):
            segment = self._queue.get()
            if not segments:
                self._gather()
            if segment is None:
                self._closing = True
            else:
                segments.append(segment)
                size += _cost(segment)
        self._taken += size
        return segments

    def _gather(self) -> None:
        """Wait for more where blocks come much faster than from a robot, but for what has waited already."""
        if self._queue.empty() and monotonic() - self._begun < FASTEST_PACE:
            self._hurry.wait(GATHERING)
            if not self._closing_asked:
                self._hurry.clear()
        self._begun = monotonic()

    def _finish(self, file: LogFile, builder: McapBuilder, codec: PeriodCodec) -> None:
        lost = self._offered - self._written
        if lost:
            reason = self._problem or "the disk was too slow"
            event = Event(self._time, Level.WARN, "recorder", f"{lost} periods were not recorded: {reason}")
            self._append(file, builder, encode_chunk([Entry(self._entries, event)], codec))
        file.append(builder.closing())

    def _append(self, file: LogFile, builder: McapBuilder, content: ChunkContent) -> None:
        piece = builder.piece(content)
        file.append(piece.data)
        builder.written(piece)


def _cost(segment: PackedRows | Entry) -> int:
    if isinstance(segment, PackedRows):
        return len(segment.data)
    what = segment.what
    return ENTRY_COST + (4 * len(what.text) if isinstance(what, Event) else 0)
