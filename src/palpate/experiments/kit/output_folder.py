"""Where results go."""

import os
from pathlib import Path
from tempfile import TemporaryFile

from palpate.errors import InvalidValueError


def make_folder(folder: Path) -> None:
    """Make a folder before the work, so that nothing is lost after it.

    Raises:
        InvalidValueError: It cannot be made or written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=folder):  # a name of nobody else's, or none
            pass
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


def check_file(file: Path, option: str | None = "out") -> None:
    """Find out whether a file can be written, before the work, without making anything.

    Args:
        file: It is.
        option: That names another one; None if it is no option.

    Raises:
        InvalidValueError: It cannot be.
    """
    name, typed = ("file", "") if option is None else (option, f" (--{option})")
    folder = file.parent
    if not folder.exists():
        raise InvalidValueError(f"{name} = {file}: there is no such folder; make it, or choose another{typed}")
    if not folder.is_dir():
        raise InvalidValueError(f"{name} = {file}: {folder} is no folder; choose another{typed}")
    if file.is_dir():
        raise InvalidValueError(f"{name} = {file}: is a folder; name a file in it{typed}")
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InvalidValueError(f"{name} = {file}: {folder} cannot be written; choose another folder{typed}")
