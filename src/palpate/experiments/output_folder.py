"""Where results go."""

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
