"""Mistakes that people type, and what the command line says to them."""

import re

from palpate.cli import main
from palpate.commands.command_result import ExitCode


def answer_to(typed, capsys):
    """What is said to a command that must be refused, in one line without the box around it."""
    try:
        code = main(typed)
    except SystemExit as left:  # what the options alone tell is refused while they are read
        code = left.code
    assert code == ExitCode.MISTAKE
    return " ".join(re.sub("[│╭╮╰╯─]", " ", capsys.readouterr().err).split())
