"""An experiment whose name has a dot belongs to a group of commands: one that is there, or one of its own."""

import json
from types import SimpleNamespace

import pytest

from palpate.cli import CommandGroup, main, typed_commands
from palpate.experiments.kit import registry
from palpate.experiments.kit.registry import experiment_named, typed_words
from palpate.experiments.kit.repeat_words import command_line
from palpate.experiments.regulate.experiment import Regulate


@pytest.fixture
def declared(monkeypatch):
    """Packages that declare experiments of these names, all of which hold a force."""

    def declare(*names):
        made = {
            name: SimpleNamespace(
                load=lambda name=name: type("Other", (Regulate,), {"name": name}), value="mine:Other"
            )
            for name in names
        }
        monkeypatch.setattr(registry, "declared_in", lambda group: made)
        monkeypatch.setattr("palpate.cli.experiment_names", lambda: tuple(made))

    typed_commands.cache_clear()
    experiment_named.cache_clear()
    yield declare
    typed_commands.cache_clear()
    experiment_named.cache_clear()


def test_it_joins_a_group_that_is_there(declared, capsys):
    declared("calibrate.mine")
    group = typed_commands()["calibrate"]
    assert isinstance(group, CommandGroup)
    assert {"mine", "new", "tare"} <= set(group.commands)
    assert main(["calibrate", "mine", "--dry-run", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert (told["command"], told["dry_run"]) == ("calibrate mine", True)


def test_it_makes_a_group_if_there_is_none_and_both_ways_of_typing_it_do(declared, capsys):
    declared("mine.first", "mine.second", "plain")
    group = typed_commands()["mine"]
    assert isinstance(group, CommandGroup)
    assert set(group.commands) == {"first", "second"}
    for typed in (["mine", "first"], ["mine.first"], ["plain"]):
        assert main([*typed, "--dry-run"]) == 0
    assert "expected duration" in capsys.readouterr().out


def test_what_a_report_says_to_type_is_what_can_be_typed():
    assert typed_words("group.word") == ("group", "word")
    assert typed_words("mine.py:Mine") == ("mine.py:Mine",)
    assert command_line("group.word", Regulate.Config(force=3.0)) == "palpate group word --force 3.0"
