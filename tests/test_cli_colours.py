"""Colours and moving bars: on a terminal and nowhere else, unless the environment says so."""

import io
import os
import pty
import subprocess
import sys

import pytest
from rich.console import Console

from palpate.commands.colours import coloured
from palpate.commands.progress import lively
from support import warm_process

ESCAPE = "\x1b["
HELP = ("robot", "--help")
MISTAKE = ("explore", "--speed", "20")
PLAIN = ("NO_COLOR", "FORCE_COLOR", "COLUMNS")


class Screen(io.StringIO):
    """A terminal."""

    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("stream", "environment", "wanted"),
    [
        (Screen(), {}, True),
        (io.StringIO(), {}, False),
        (Screen(), {"NO_COLOR": "1"}, False),
        (Screen(), {"NO_COLOR": ""}, True),
        (io.StringIO(), {"FORCE_COLOR": "1"}, True),
        (io.StringIO(), {"FORCE_COLOR": "1", "NO_COLOR": "1"}, False),
        (Screen(), {"TERM": "dumb"}, False),
    ],
)
def test_who_gets_colours(stream, environment, wanted, monkeypatch):
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert coloured(stream) is wanted


def test_nothing_moves_where_only_colours_are_forced(monkeypatch):
    monkeypatch.setenv("FORCE_COLOR", "1")
    assert Console(file=io.StringIO()).is_terminal, "rich has changed its mind: `lively` may go"
    assert not lively(Console(file=io.StringIO()))
    assert lively(Console(file=Screen(), force_terminal=True))


def piped(words, **environment):
    """What a command writes into pipes."""
    done = warm_process.palpate(*words, environment={"TERM": "xterm", **environment})
    return done.stdout, done.stderr


@pytest.mark.parametrize(("words", "which"), [(HELP, 0), (MISTAKE, 1)])
def test_pipes_get_no_colours_unless_they_are_forced(words, which):
    assert ESCAPE not in "".join(piped(words))
    assert ESCAPE in piped(words, FORCE_COLOR="1")[which]
    assert ESCAPE not in "".join(piped(words, FORCE_COLOR="1", NO_COLOR="1"))


def test_a_refusal_is_coloured_by_where_it_goes_and_help_by_where_that_goes():
    """A terminal for the one and a pipe for the other."""
    ours, theirs = pty.openpty()
    kept = {name: value for name, value in os.environ.items() if name not in PLAIN}
    try:
        done = subprocess.run(
            [sys.executable, "-m", "palpate", *MISTAKE],
            stdout=theirs,
            stderr=subprocess.PIPE,
            text=True,
            env={**kept, "TERM": "xterm"},
        )
    finally:
        os.close(theirs)
        os.close(ours)
    assert ESCAPE not in done.stderr
