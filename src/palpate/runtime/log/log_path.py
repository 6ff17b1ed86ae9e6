"""Where logs lie: one file per run, named by its start, and a link to the latest."""

import contextlib
import secrets
from datetime import datetime
from pathlib import Path

from palpate.errors import InvalidValueError

SUFFIX = ".mcap"
LATEST = f"latest{SUFFIX}"


def new_log_path(folder: Path, now: datetime) -> Path:
    """Return a name that no log in a folder has, as in 2026-11-21_02-30-05.mcap; "-2" and so on if need be.

    Args:
        folder: Made if need be.
        now: Start of the run, in the time zone that people will look for it in.

    Raises:
        OSError: The folder cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    stem, number = now.strftime("%Y-%m-%d_%H-%M-%S"), 1
    path = folder / f"{stem}{SUFFIX}"
    while path.exists() or path.is_symlink():
        number += 1
        path = folder / f"{stem}-{number}{SUFFIX}"
    return path


def point_latest(path: Path) -> str:
    """Make latest.mcap beside a log a link to it, in one step; returns what went wrong in one line, or nothing."""
    link = path.with_name(LATEST)
    if path.name == LATEST:
        return ""
    if link.exists() and not link.is_symlink():
        return f"{link} is no link and was left as it is"
    partial = link.with_name(f".{LATEST}.{secrets.token_hex(4)}.part")
    try:
        partial.symlink_to(path.name)
        partial.replace(link)
    except (OSError, NotImplementedError) as error:
        with contextlib.suppress(OSError):
            partial.unlink()
        return f"{link} was not made: {getattr(error, 'strerror', None) or error}"
    return ""


def log_in(place: Path) -> Path:
    """Return the log that a person means by a file, or by a folder with its latest log.

    Raises:
        InvalidValueError: There is none.
    """
    path = place / LATEST if place.is_dir() else place
    if not path.exists():
        if path == place:
            raise InvalidValueError(f"{place}: there is no such file or folder")
        raise InvalidValueError(f"{place}: there is no {LATEST} in this folder; name the log's file")
    return path
