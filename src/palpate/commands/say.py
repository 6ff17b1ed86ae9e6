"""Plain lines on the terminal."""

from contextlib import suppress

from rich.console import Console

from palpate.plain_text import inert


def say(console: Console, text: str) -> None:
    """Print a text in one line, without interpreting markup.

    A closed pipe, upon which rich exits, must end neither run nor report, and is ignored.
    """
    with suppress(OSError, SystemExit):
        console.print(inert(text), highlight=False, markup=False, soft_wrap=True)
