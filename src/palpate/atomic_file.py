"""Files that appear whole or not at all."""

import contextlib
import os
import secrets
from collections.abc import Iterator
from io import FileIO
from pathlib import Path
from typing import BinaryIO


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a file for bytes in the folder of `path`; it takes the name `path` once the block succeeds.

    If the block raises, a former file at `path` stays as it was, as it does if this process is killed or the power
    fails. On Linux the new file has no name until it is on the disk: a process that is killed leaves none behind.

    Raises:
        OSError: The folder does not exist or cannot be written to.
    """
    target = Path(path)
    # A sibling, since only within one file system a file can take another's place in one step.
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        with _opened(partial) as own:
            with open(os.dup(own.fileno()), "wb") as file:  # which may be closed, as by a text stream around it
                yield file
            os.fsync(own.fileno())
            if not partial.exists():
                # a directory's descriptor makes it linkat, which follows; that of an absolute path does not matter
                os.link(f"/proc/self/fd/{own.fileno()}", partial, src_dir_fd=own.fileno())
        partial.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise


def _opened(partial: Path) -> FileIO:
    """Open a new file beside `partial` that has no name, or where the system knows none, `partial`."""
    with contextlib.suppress(OSError, AttributeError):
        return open(os.open(partial.parent, os.O_TMPFILE | os.O_WRONLY, 0o666), "wb", buffering=0)
    return partial.open("xb", buffering=0)
