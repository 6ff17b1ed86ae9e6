"""Typed commands: their exit codes and the words of their refusals."""

import re

from palpate.cli import main
from palpate.commands.command_result import ExitCode


def words_of(text):
    """Return a text in one line without the box around it."""
    return " ".join(re.sub("[│╭╮╰╯─]", " ", text).split())


def ended(typed):
    """Return the exit code of a command, also of one that is refused while its options are read."""
    try:
        return main(typed)
    except SystemExit as left:
        return left.code


def answer_to(typed, capsys):
    """Return the refusal of a command, in one line without the box around it."""
    assert ended(typed) == ExitCode.MISTAKE
    return words_of(capsys.readouterr().err)
