"""Slips of the fingers: what the command line says to them; and help that reads well where it is narrow."""

import re
from itertools import pairwise

import pytest

from palpate.cli import main, typed_commands
from palpate.commands.command_result import ExitCode
from support.cli_samples import leaves
from support.typed_mistakes import answer_to

NARROW = 80


@pytest.mark.parametrize(
    ("typed", "said"),
    [
        ("explor --dry-run", "explor: no such command; did you mean palpate explore? there are explore, friction"),
        ("version", "did you mean palpate --version?"),
        ("help", "did you mean palpate --help?"),
        (
            "robot chek",
            "robot chek: no such command; did you mean palpate robot check? there are list",
        ),
        ("qqqq", "qqqq: no such command; there are explore"),
        ("explore sphere", "Options have names here: did you mean --object sphere?"),
        ("explore --force 2 sphere", "did you mean --object sphere?"),
        ("explore --beyond spiral", "did you mean --strategy spiral?"),
        ("explore --object spere", "Did you mean sphere?"),
        ("explore --object=spere", "Did you mean sphere?"),
        ("regulate --motion sin", "Did you mean sine?"),
        ("calibrate new x.yaml --preset nano", "Did you mean nano17?"),
        ("sweep explor", "did you mean explore?"),
        ("friction --mu 0.8", "Did you mean --friction?"),
        ("grasp --mu=0.8", "Did you mean --friction?"),
        ("explore --robot emulated-hand", "it has 2 fingers, this takes one; for a hand there is palpate grasp"),
        ("view explore --host 192.0.2.1", "host = '192.0.2.1': "),
        ("view explore --host a..b --json", "host = 'a..b': "),
    ],
)
def test_a_slip_is_answered_with_what_was_meant(typed, said, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert said in answer_to(typed.split(), capsys)
    assert not list(tmp_path.iterdir()), "nothing was written"


@pytest.mark.parametrize("typed", ["explore --out sphere --speed 20", "explore --sped 1", "explore --object qqqq"])
def test_what_is_no_slip_of_that_kind_gets_no_advice(typed, capsys):
    assert not re.search("(D|d)id you mean", answer_to(typed.split(), capsys))


def test_a_word_that_is_no_command_is_wrong_input_in_one_line(capsys):
    assert main(["explor"]) == ExitCode.MISTAKE
    assert capsys.readouterr().err.count("\n") == 1


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
