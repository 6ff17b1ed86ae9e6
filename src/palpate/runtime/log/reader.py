"""Reading a log, whole or damaged: what comes out is what went in, or it does not come out."""

import os
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

import numpy as np
import numpy.typing as npt
from mcap.opcode import Opcode

from palpate.bounded_file import open_regular
from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime.live import Change
from palpate.runtime.log.chunk import PERIOD_CHANNEL, LogRows, decode_chunk
from palpate.runtime.log.entries import Event
from palpate.runtime.log.entry_codec import Entry
from palpate.runtime.log.heading import Heading, decode_heading
from palpate.runtime.log.log import Log
from palpate.runtime.log.log_path import log_in
from palpate.runtime.log.mcap_builder import HEADING_NAME
from palpate.runtime.log.mcap_walk import DamageError, McapWalk, RawRecord, attachment_of, chunk_of
from palpate.runtime.log.period_codec import PeriodCodec

LARGEST_LOG = 1 << 31
"""Bytes of periods that are read into memory at once: an hour at 1 kHz. In pieces a log of any size is read."""

LARGEST_ENTRIES = 1 << 25
"""Bytes of events and changes, which are kept while a log is read in pieces: a hundred thousand of them."""

MOST_DAMAGE = 1000
"""Damaged places that are reported: a file of nothing else is not read to its end."""

_OPENING = (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL)


def read_log(path: str | os.PathLike[str], progress: Callable[[float], None] | None = None) -> Log:
    """Read a log into memory, or as much of it as is undamaged and fits `LARGEST_LOG`; see `LogReader`.

    Args:
        path: The file, or a folder with its latest log.
        progress: Told now and then which fraction has been read.

    Raises:
        InvalidValueError: It is no log of palpate's, of a newer format, or too damaged to tell; or it may not be
            read.
        OSError: There is none, or it cannot be read.
    """
    sequence: list[npt.NDArray[np.int64]] = []
    values: list[FloatArray] = []
    place = log_in(Path(path)) if Path(path).is_dir() else Path(path)
    with LogReader(place) as reader:
        room = LARGEST_LOG
        for piece in reader.pieces(progress):
            room -= piece.values.nbytes
            if room < 0:
                reader.damage.append(
                    f"more than {LARGEST_LOG} bytes of periods, of which the first were read; "
                    "`palpate log info` and `palpate log export` read them all"
                )
                break
            sequence.append(piece.sequence)
            values.append(piece.values)
    return Log(
        path=place,
        codec=reader.codec,
        attachments=reader.attachments,
        sequence=np.concatenate(sequence) if sequence else np.empty(0, np.int64),
        rows=np.concatenate(values) if values else np.empty((0, reader.codec.width)),
        events=tuple(reader.events),
        changes=tuple(reader.changes),
        damage=reader.damage_words,
        complete=reader.complete,
    )


def _opened(path: Path) -> BinaryIO:
    try:
        return open_regular(path)
    except PermissionError:
        raise InvalidValueError(
            f"{path}: may not be read; ask its owner, or allow it (chmod a+r {path})"
        ) from None


def _read_opening(walk: McapWalk, records: Iterator[RawRecord]) -> Heading:
    """Read up to the heading, which vouches for all before it."""
    crc = walk.crc
    for record in records:
        if record.opcode == Opcode.ATTACHMENT:
            attachment = attachment_of(record)
            if attachment.name != HEADING_NAME:
                raise DamageError(f"it begins with {attachment.name!r}, not with {HEADING_NAME!r}")
            heading, preceding_crc = decode_heading(attachment.data)
            if preceding_crc != crc:
                raise DamageError("its schemas or channels are damaged (check sum)")
            return heading
        if record.opcode not in _OPENING:
            break
        crc = walk.crc
    raise DamageError(f"there is no {HEADING_NAME!r} where it should be")


class LogReader:
    """Reads a log of any size in pieces, once, from its beginning to its end.

    Every check sum is checked, and every message compared with what palpate would have written: a chunk that does
    not pass is left out and reported in `damage`. What was read before stays, and so does what comes after, if
    it can be found: sequence numbers show what is missing. A log that is still being written is read up to its
    last chunk.

    Attributes:
        path: The file.
        codec: Of the run: heading, columns of the rows.
        attachments: Texts that were kept with the run, by name.
        events: What happened, in order, as far as it was read.
        changes: Requests for live parameters, likewise.
        damage: Where something is damaged, and what, one line each.
        complete: Whether the writer came to its end, and every check sum is right; False before the end.
        periods: How many were read.
        missing: How many are missing before the last one: dropped by the writer, or damaged.
        gaps: In how many places.
        first_gap: Number of the last period before the first of them, -1 if they are the first; None if there is
            none.
    """

    def __init__(self, path: Path) -> None:
        """Open a log, and read what it begins with.

        Raises:
            InvalidValueError: It is no log of palpate's, of a newer format, or too damaged to tell; or it may not
                be read.
            OSError: There is none, or it cannot be read.
        """
        self.path, self._file = path, _opened(path)
        try:
            self._walk = McapWalk(self._file)
            self._records = self._walk.records()
            heading = _read_opening(self._walk, self._records)
        except BaseException as error:
            self._file.close()
            if isinstance(error, DamageError | InvalidValueError):
                raise InvalidValueError(f"{path} cannot be read as a log of palpate's: {error}") from None
            raise
        self.codec = PeriodCodec(heading, PERIOD_CHANNEL)
        self.attachments: dict[str, str] = {}
        self.events: list[Event] = []
        self.changes: list[Change] = []
        self.damage: list[str] = []
        self.complete = False
        self.periods = self.missing = self.gaps = 0
        self.first_gap: int | None = None
        self._last_row, self._last_entry = -1, -1
        self._room = LARGEST_ENTRIES

    def pieces(self, progress: Callable[[float], None] | None = None) -> Iterator[LogRows]:
        """Yield some periods after the other; what is not periods is found on the way.

        Args:
            progress: Told now and then which fraction has been read.
        """
        for chunk in self.chunks(progress):
            yield from (segment for segment in chunk if isinstance(segment, LogRows))

    def chunks(self, progress: Callable[[float], None] | None = None) -> Iterator[list[LogRows | Entry]]:
        """Yield likewise all that is in each chunk, in order; `attachments` come before the first.

        Args:
            progress: Told now and then which fraction has been read.
        """
        walk = self._walk
        try:
            for record in self._records:
                found = self._take(record)
                if found:
                    for segment in found:
                        if isinstance(segment, LogRows):
                            self._count(segment)
                    yield found
                if progress is not None:
                    progress(walk.place / walk.size)
            if walk.place < walk.size:
                walk.check_end()
                self.complete = not self.damage
        except DamageError as error:
            self.damage.append(str(error))

    @property
    def damage_words(self) -> str | None:
        """The damage in one line; None if there is none."""
        more = f"; {len(self.damage) - 1} more" if len(self.damage) > 1 else ""
        return self.damage[0] + more if self.damage else None

    def __enter__(self) -> Self:
        """Close the file at the end."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    def _count(self, piece: LogRows) -> None:
        steps = np.diff(piece.sequence, prepend=self._last_row)
        holes = np.flatnonzero(steps > 1)
        if len(holes) and self.first_gap is None:
            self.first_gap = int(piece.sequence[holes[0]] - steps[holes[0]])
        self.gaps += len(holes)
        self.missing += int((steps - 1).sum())
        self.periods += len(steps)
        self._last_row = int(piece.sequence[-1])

    def _take(self, record: RawRecord) -> list[LogRows | Entry]:
        """Take a record after the heading; returns what is in it if it is a chunk.

        Raises:
            DamageError: What follows it makes no sense either.
        """
        try:
            if record.opcode == Opcode.ATTACHMENT:
                self._take_attachment(record)
                return []
            if record.opcode == Opcode.CHUNK:
                return self._take_chunk(record)
        except DamageError as error:
            self.damage.append(str(error))
            if len(self.damage) >= MOST_DAMAGE:
                raise DamageError(f"{MOST_DAMAGE} places are damaged: what follows was not read") from None
            return []
        if record.opcode != Opcode.MESSAGE_INDEX:  # which the check sum of the data section covers
            raise DamageError(f"at byte {record.place} begins nothing that palpate writes")
        return []

    def _take_attachment(self, record: RawRecord) -> None:
        attachment = attachment_of(record)
        name, start = attachment.name, self.codec.heading.wall_start
        if attachment.times != (start, start) or name == HEADING_NAME or name in self.attachments:
            raise DamageError(f"the attachment {name!r} at byte {record.place} is of another run, or comes again")
        try:
            self.attachments[name] = attachment.data.decode()
        except UnicodeDecodeError:
            raise DamageError(f"the attachment {name!r} at byte {record.place} is no text") from None

    def _take_chunk(self, record: RawRecord) -> list[LogRows | Entry]:
        chunk = chunk_of(record)
        where = f"the chunk at byte {record.place}"
        try:
            found = decode_chunk(chunk.data, self.codec)
        except InvalidValueError as error:
            raise DamageError(f"{where} holds {error}") from None
        last_row, last_entry = self._last_row, self._last_entry
        for segment in found:
            if isinstance(segment, LogRows):
                if segment.sequence[0] <= last_row or (np.diff(segment.sequence) <= 0).any():
                    raise DamageError(f"{where} comes again, or late")
                last_row = int(segment.sequence[-1])
            else:
                if segment.sequence <= last_entry:
                    raise DamageError(f"{where} comes again, or late")
                last_entry = segment.sequence
        rows = [segment for segment in found if isinstance(segment, LogRows)]
        entries = [segment.what for segment in found if isinstance(segment, Entry)]
        self._room -= len(chunk.data) - sum(len(piece.sequence) for piece in rows) * self.codec.dtype.itemsize
        if self._room < 0:
            raise DamageError(f"{where}: more than {LARGEST_ENTRIES} bytes of events and changes")
        self.events += [what for what in entries if isinstance(what, Event)]
        self.changes += [what for what in entries if isinstance(what, Change)]
        self._last_entry = last_entry
        return found
