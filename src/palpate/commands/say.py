"""A line for people, on the terminal or wherever the output goes."""

from contextlib import suppress

from rich.console import Console

from palpate.plain_text import inert


def say(console: Console, text: str) -> None:
    """Print a text in one line, inert: what people typed may look like markup, and paths are long.

    Whoever reads the output may have had enough, upon which rich exits: that must cost neither run nor report.
    """
    with suppress(OSError, SystemExit):
        console.print(inert(text), highlight=False, markup=False, soft_wrap=True)
