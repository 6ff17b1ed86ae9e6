"""Reading a log, whole or damaged: what comes out is what went in, or it does not come out."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import BinaryIO

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
from palpate.runtime.log.mcap_builder import HEADING_NAME
from palpate.runtime.log.mcap_walk import DamageError, McapWalk, RawRecord, attachment_of, chunk_of
from palpate.runtime.log.period_codec import PeriodCodec

LARGEST_LOG = 1 << 31
"""Bytes of expanded messages: an hour at 1 kHz."""

MOST_DAMAGE = 1000
"""Damaged places that are reported: a file of nothing else is not read to its end."""

_OPENING = (Opcode.HEADER, Opcode.SCHEMA, Opcode.CHANNEL)


def read_log(path: Path, progress: Callable[[float], None] | None = None) -> Log:
    """Read a log, or as much of it as is undamaged.

    Every check sum is checked, and every message compared with what palpate would have written: a chunk that does
    not pass is left out and reported in `Log.damage`. What was read before stays, and so does what comes after, if
    it can be found: sequence numbers show what is missing. A log that is still being written is read up to its
    last chunk.

    Args:
        path: The file.
        progress: Told now and then which fraction has been read.

    Raises:
        InvalidValueError: It is no log of palpate's, of a newer format, or too damaged to tell; or it may not be
            read.
        OSError: There is none, or it cannot be read.
    """
    with _opened(path) as file:
        try:
            walk = McapWalk(file)
            records = walk.records()
            heading = _read_opening(walk, records)
        except (DamageError, InvalidValueError) as error:
            raise InvalidValueError(f"{path} cannot be read as a log of palpate's: {error}") from None
        content = _Content(heading)
        complete = False
        try:
            for record in records:
                content.take(record)
                if progress is not None:
                    progress(walk.place / walk.size)
            if walk.place < walk.size:
                walk.check_end()
                complete = not content.damage
        except DamageError as error:
            content.damage.append(str(error))
    return content.log(path, complete)


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


class _Content:
    """What has been read so far."""

    def __init__(self, heading: Heading) -> None:
        self.damage: list[str] = []
        self._codec = PeriodCodec(heading, PERIOD_CHANNEL)
        self._attachments: dict[str, str] = {}
        self._rows: list[LogRows] = []
        self._entries: list[Entry] = []
        self._last_row, self._last_entry = -1, -1
        self._size = 0

    def take(self, record: RawRecord) -> None:
        """Take a record after the heading.

        Raises:
            DamageError: What follows it makes no sense either.
        """
        try:
            if record.opcode == Opcode.ATTACHMENT:
                self._take_attachment(record)
                return
            if record.opcode == Opcode.CHUNK:
                self._take_chunk(record)
                return
        except DamageError as error:
            self.damage.append(str(error))
            if len(self.damage) >= MOST_DAMAGE:
                raise DamageError(f"{MOST_DAMAGE} places are damaged: what follows was not read") from None
            return
        if record.opcode != Opcode.MESSAGE_INDEX:  # which the check sum of the data section covers
            raise DamageError(f"at byte {record.place} begins nothing that palpate writes")

    def _take_attachment(self, record: RawRecord) -> None:
        attachment = attachment_of(record)
        name, start = attachment.name, self._codec.heading.wall_start
        if attachment.times != (start, start) or name == HEADING_NAME or name in self._attachments:
            raise DamageError(f"the attachment {name!r} at byte {record.place} is of another run, or comes again")
        try:
            self._attachments[name] = attachment.data.decode()
        except UnicodeDecodeError:
            raise DamageError(f"the attachment {name!r} at byte {record.place} is no text") from None

    def _take_chunk(self, record: RawRecord) -> None:
        chunk = chunk_of(record)
        where = f"the chunk at byte {record.place}"
        self._size += len(chunk.data)
        if self._size > LARGEST_LOG:
            raise DamageError(f"{where}: more than {LARGEST_LOG} bytes of messages; record shorter runs")
        try:
            found = decode_chunk(chunk.data, self._codec)
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
        self._rows += [segment for segment in found if isinstance(segment, LogRows)]
        self._entries += [segment for segment in found if isinstance(segment, Entry)]
        self._last_row, self._last_entry = last_row, last_entry

    def log(self, path: Path, complete: bool) -> Log:
        """Return it all."""
        rows, self._rows = self._rows, []
        sequence: list[npt.NDArray[np.int64]] = [block.sequence for block in rows]
        values: list[FloatArray] = [block.values for block in rows]
        what = [entry.what for entry in self._entries]
        more = f"; {len(self.damage) - 1} more" if len(self.damage) > 1 else ""
        return Log(
            path=path,
            codec=self._codec,
            attachments=self._attachments,
            sequence=np.concatenate(sequence) if rows else np.empty(0, np.int64),
            rows=np.concatenate(values) if rows else np.empty((0, self._codec.width)),
            events=tuple(one for one in what if isinstance(one, Event)),
            changes=tuple(one for one in what if isinstance(one, Change)),
            damage=self.damage[0] + more if self.damage else None,
            complete=complete,
        )
