"""Solvers written in C print what they like: their banners do not belong in a table."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console


@contextmanager
def only_console(width: int) -> Iterator[Console]:
    """Give a console that is heard while all else that is written to the standard streams is lost."""
    sys.stdout.flush()
    sys.stderr.flush()
    heard, deaf = [os.dup(1), os.dup(2)], os.open(os.devnull, os.O_WRONLY)
    try:
        with os.fdopen(os.dup(heard[0]), "w") as file:
            os.dup2(deaf, 1)
            os.dup2(deaf, 2)
            yield Console(file=file, width=width)
    finally:
        for there, kept in zip((1, 2), heard, strict=True):
            os.dup2(kept, there)
        for each in (*heard, deaf):
            os.close(each)
