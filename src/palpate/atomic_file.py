"""Files that appear whole or not at all."""

import contextlib
import os
import secrets
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO


@contextlib.contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[BinaryIO]:
    """Open a temporary sibling of `path` for bytes; it takes the name `path` once the block succeeds.

    If the block raises, the temporary file goes away and a former file at `path` stays as it was. This guards
    against errors and interruption of the program, not against loss of power.

    Raises:
        OSError: The folder does not exist or cannot be written to.
    """
    target = Path(path)
    # A sibling, since only within one file system a file can take another's place in one step.
    partial = target.with_name(f".{target.name}.{secrets.token_hex(4)}.part")
    try:
        with partial.open("xb") as file:
            yield file
        partial.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            partial.unlink()
        raise
