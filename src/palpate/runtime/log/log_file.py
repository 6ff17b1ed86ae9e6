"""A file that grows by whole pieces: what cannot be written whole is taken off again."""

import contextlib
import os
from pathlib import Path
from types import TracebackType
from typing import Self


class LogGoneError(OSError):
    """Others have shortened, deleted, moved or replaced a file while it was written.

    Attributes:
        left: Bytes of it that are still there, under its name.
    """

    def __init__(self, what: str, left: int) -> None:
        """Take what happened, and what is left [bytes]."""
        super().__init__(what)
        self.left = left


class LogFile:
    """A new file. Nothing is buffered in this process: what `append` returned from survives the process's death.

    It is not forced to the disk (fsync): a loss of power may lose the last seconds, and a log that waited for the
    disk would lose more.

    Attributes:
        size: Bytes in the file, all of them whole pieces.
    """

    def __init__(self, path: Path) -> None:
        """Make the file.

        Raises:
            FileExistsError: There is one; logs are not overwritten.
            OSError: It cannot be made.
        """
        self.size = 0
        self._path = path.absolute()
        self._file = path.open("xb", buffering=0)

    @staticmethod
    def begun(path: Path, opening: bytes) -> "LogFile":
        """Return a new file with its first piece; where that cannot be written, no file is left.

        Raises:
            OSError: As for the constructor and `append`.
        """
        file = LogFile(path)
        try:
            file.append(opening)
        except OSError:
            with file:
                path.unlink()
            raise
        return file

    def append(self, data: bytes) -> None:
        """Write a piece.

        Raises:
            LogGoneError: See `check`.
            OSError: It cannot be written; the file ends with the piece before it.
        """
        self.check()
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) or 0 :]
        except OSError:
            with contextlib.suppress(OSError):
                self._file.truncate(self.size)
                self._file.seek(self.size)
            raise
        self.size += len(data)

    def check(self) -> None:
        """Make sure that all that was written is there, under the file's name.

        Raises:
            LogGoneError: It is not.
            OSError: The folder cannot be read.
        """
        own = os.fstat(self._file.fileno())
        try:
            named = os.stat(self._path)
        except (FileNotFoundError, NotADirectoryError):
            raise LogGoneError("the file was deleted or moved while it was written", 0) from None
        if not os.path.samestat(own, named):
            raise LogGoneError("another file has taken its place while it was written", 0)
        if own.st_size != self.size:
            cut = f"others have changed its size from {self.size} to {own.st_size} bytes while it was written"
            raise LogGoneError(cut, min(own.st_size, self.size))

    def __enter__(self) -> Self:
        """Close it at the end, which raises OSError if the system finds out only then that it cannot write."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()
