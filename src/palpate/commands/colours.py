"""Whether output is coloured: on a terminal, unless NO_COLOR or FORCE_COLOR decides otherwise."""

import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TextIO

import tyro

HELP_WORDS = frozenset({"-h", "--help"})


def coloured(stream: TextIO) -> bool:
    """Return whether colours belong on a stream (https://no-color.org, https://force-color.org)."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return stream.isatty() and os.environ.get("TERM") not in (None, "dumb")


@contextmanager
def parser_colours(arguments: Sequence[str]) -> Iterator[None]:
    """Let the parser colour its help by standard output, and its refusals by standard error, where they go.

    tyro honours neither variable and inspects standard output in both cases.
    """
    options = tyro._experimental_options
    before, out = options["ansi_codes"], sys.stdout
    wanted = coloured(out if HELP_WORDS & set(arguments) else sys.stderr)
    options["ansi_codes"] = wanted
    if wanted:
        sys.stdout = _Terminal(out)
    try:
        yield
    finally:
        options["ansi_codes"], sys.stdout = before, out


class _Terminal:
    """A stream that claims to be a terminal."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def isatty(self) -> bool:
        return True

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
