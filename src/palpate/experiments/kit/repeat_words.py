"""Commands that repeat a run, and the location of its log, for its report."""

import shlex
from collections.abc import Sequence
from dataclasses import fields
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.experiments.kit.registry import typed_words
from palpate.runtime import RunResult

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


def repeat_commands(name: str, config: "DataclassInstance", result: RunResult) -> tuple[tuple[str, str], ...]:
    """Return what can be repeated of a run, and the command that does so.

    Args:
        name: Of the experiment's command.
        config: What was asked for.
        result: How it went; without a log only the run itself can be done again.
    """
    commands = [("The same again:", command_line(name, config))]
    kept = result.recording
    if kept is not None and kept.path is not None:
        log = shlex.quote(str(kept.path))
        commands += [
            ("Every command of it computed again from its log, bit for bit:", f"palpate replay {log}"),
            ("To watch it in the browser:", f"palpate view {log}"),
            ("Beside another run of the kind:", f"palpate compare {log} ANOTHER_RUN"),
        ]
    return tuple(commands)


def log_row(result: RunResult) -> tuple[tuple[str, str], ...]:
    """Return the log among the settings of a report; nothing if there is none."""
    kept = result.recording
    return () if kept is None or kept.path is None else (("log", str(kept)),)


def command_line(name: str, config: "DataclassInstance") -> str:
    """Return what to type for a configuration: the options that are not as they are by default."""
    usual = type(config)()
    words = ["palpate", *typed_words(name)]
    for field in fields(config):
        value = getattr(config, field.name)
        if value == getattr(usual, field.name):
            continue
        option = field.name.replace("_", "-")
        if isinstance(value, bool):
            words.append(f"--{option}" if value else f"--no-{option}")
        elif value is not None:
            words += [f"--{option}", *_typed(value)]
    return shlex.join(words)


def _typed(value: object) -> list[str]:
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [word for each in value for word in _typed(each)]
    if isinstance(value, Enum):
        return [str(value.value)]
    return [str(value) if isinstance(value, str | Path) else repr(value)]
