"""What people typed, before anybody has judged it as a whole; imports nothing heavy."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, TypeVar

import tyro

Options = TypeVar("Options", bound=Any)
"""A frozen dataclass."""


def read_typed(kind: type[Options], command: str, arguments: Sequence[str], **told: Any) -> Options:
    """Return what is typed for a command; a mistake, or --help, is answered and ends the program.

    Args:
        kind: Of the options; its fields need not have defaults.
        command: As it is typed, with the program's name: what a mistake is said to be in.
        arguments: What follows it.
        told: More for `tyro.cli`, as description and default.
    """
    # where values cannot be together, tyro names the class that refuses them: people know the command, not ours
    named: Any = type(command, (kind,), {"__slots__": ()})
    made: Options = settled(kind, tyro.cli(named, prog=command, args=arguments, **told))
    return made


def option(name: str, arguments: Sequence[str]) -> str | None:
    """Return what is typed for an option, without judging the rest."""
    found = None
    for i, word in enumerate(arguments):
        if word == f"--{name}" and i + 1 < len(arguments):
            found = arguments[i + 1]
        elif word.startswith(f"--{name}="):
            found = word.removeprefix(f"--{name}=")
    return found


def unchecked(kind: type[Options], values: Mapping[str, object]) -> Options:
    """Return options with these values and defaults for the rest, before anybody has judged them together.

    Every field must have a default.
    """
    options = object.__new__(kind)
    for field in fields(kind):
        assert field.default is not MISSING
        object.__setattr__(options, field.name, values.get(field.name, field.default))
    return options


def from_file(kind: type[Options], settled_kind: type, arguments: Sequence[str]) -> Options:
    """Return what holds if nothing more is typed than the experiment file that --config names.

    It is not checked as a whole, for what is typed comes on top.

    Args:
        kind: Of the options, which have a field config.
        settled_kind: The configuration that the file is for.
        arguments: As typed.

    Raises:
        InvalidValueError: The file cannot be read, or something in it is wrong.
    """
    config = option("config", arguments)
    if config is None:
        return unchecked(kind, {})
    from palpate.experiments.experiment_file import load_overlay

    return unchecked(kind, {"config": Path(config), **load_overlay(Path(config), settled_kind)})


def settled(kind: type[Options], options: Options) -> Options:
    """Return the values of a configuration alone, checked, from an object that has them among others."""
    made: Options = kind(**{field.name: getattr(options, field.name) for field in fields(kind)})
    return made
