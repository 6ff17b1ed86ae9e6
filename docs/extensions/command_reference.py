"""The directive `{commands}`: what `--help` says of every command, asked of the command line itself."""

import contextlib
import io
import os
import textwrap
from collections.abc import Iterator

from docutils import nodes
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from palpate.cli import CommandGroup, Typed, main, typed_commands

COLUMNS = 80
"""Of a terminal to print for: the page's text is about as wide."""


def words_typed(commands: Typed, before: str = "") -> Iterator[str]:
    """Yield what can be typed after `palpate`, in the order of `palpate --help`; of a group also the group."""
    for name, command in commands.items():
        yield f"{before}{name}"
        if isinstance(command, CommandGroup):
            yield from words_typed(command.commands, f"{before}{name} ")


def help_text(typed: str) -> str:
    """Return what `palpate TYPED --help` prints."""
    printed = io.StringIO()
    width = os.environ.get("COLUMNS")
    os.environ["COLUMNS"] = str(COLUMNS)
    try:
        with contextlib.redirect_stdout(printed), contextlib.suppress(SystemExit):
            main([*typed.split(), "--help"])
    finally:
        if width is None:
            del os.environ["COLUMNS"]
        else:
            os.environ["COLUMNS"] = width
    lines = printed.getvalue().strip().splitlines()
    return "\n".join(
        part for line in lines for part in (textwrap.wrap(line, COLUMNS) if len(line) > COLUMNS else [line])
    )


class Commands(SphinxDirective):
    """A heading and a block for each command."""

    def run(self) -> list[nodes.Node]:
        """Return them."""
        lines = ["## palpate", "", "```text", help_text(""), "```", ""]
        for typed in words_typed(typed_commands()):
            lines += [f"## palpate {typed}", "", "```text", help_text(typed), "```", ""]
        found = nodes.Element()
        text = StringList("\n".join(lines).splitlines(), source="palpate --help")
        self.state.nested_parse(text, self.content_offset, found, match_titles=True)
        return found.children


def setup(app: Sphinx) -> dict[str, bool]:
    """Make it known to Sphinx."""
    app.add_directive("commands", Commands)
    return {"parallel_read_safe": True}
