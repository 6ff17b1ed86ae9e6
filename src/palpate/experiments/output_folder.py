"""Where results go."""

import os
from pathlib import Path

from palpate.errors import InvalidValueError


def make_folder(folder: Path) -> None:
    """Make a folder before the work, so that nothing is lost after it.

    Raises:
        InvalidValueError: It cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        (folder / ".writable").touch()
        (folder / ".writable").unlink()
    except OSError as error:
        raise InvalidValueError(f"out = {folder}: {error.strerror}; choose another folder (--out)") from None


def check_folder(folder: Path) -> None:
    """Find out whether `make_folder` would make a folder, without making anything.

    Raises:
        InvalidValueError: It cannot be made or written.
    """
    present = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not present.is_dir():
        raise InvalidValueError(f"out = {folder}: {present} is no folder; choose another folder (--out)")
    if not os.access(present, os.W_OK | os.X_OK):
        raise InvalidValueError(f"out = {folder}: {present} cannot be written; choose another folder (--out)")
