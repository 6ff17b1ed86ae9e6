"""Slips of the fingers: what the command line says to them; and help that reads well where it is narrow."""

import re
from itertools import pairwise

import pytest

from palpate.cli import main, typed_commands
from support.cli_samples import leaves
from support.typed_mistakes import answer_to

NARROW = 80


@pytest.mark.parametrize("typed", ["explore --out sphere --speed 20", "explore --sped 1", "explore --object qqqq"])
def test_what_is_no_slip_of_that_kind_gets_no_advice(typed, capsys):
    assert not re.search("(D|d)id you mean", answer_to(typed.split(), capsys))


@pytest.mark.parametrize("name", ["", *typed_commands(), *(name for name in leaves() if " " in name)])
def test_help_fills_its_lines(name, capsys, monkeypatch):
    """In a box, no line ends where the first word of the next would still have had room."""
    monkeypatch.setenv("COLUMNS", str(NARROW))
    with pytest.raises(SystemExit):
        main([*name.split(), "--help"])
    # boxes fill the width, with spaces where there are no lines to draw; what stands above them is not wrapped
    inside = [line[2:-2] for line in capsys.readouterr().out.splitlines() if len(line) == NARROW]
    assert any("--help" in line for line in inside)
    for line, following in pairwise(inside):
        column = len(following) - len(following.lstrip())
        if not 4 <= column < len(following) or line[column - 2 : column].strip() or line[column] == " ":
            continue  # another option, or the words above belong to none of its help
        room = NARROW - 4 - len(line.rstrip()) - 1
        assert len(following.split()[0]) > room, f"{line!r} could hold more of {following!r}"
