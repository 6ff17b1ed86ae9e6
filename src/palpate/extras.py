"""Libraries that only some need: `pip install "palpate[EXTRA]"` brings them."""

from importlib.util import find_spec

from palpate.errors import PalpateError


class MissingLibraryError(PalpateError, ImportError):
    """A library that is needed is not installed; the message gives the command that installs it."""


def require(library: str, extra: str, what: str) -> None:
    """Refuse what needs a library that is not there, before anything of it is imported.

    Args:
        library: Its name, as imported.
        extra: Of palpate, that brings it.
        what: What needs it, for the message.

    Raises:
        MissingLibraryError: It is not installed.
    """
    if find_spec(library) is None:
        raise MissingLibraryError(
            f'{what} needs {library}, which is not installed: pip install "palpate[{extra}]"', name=library
        )
