"""What people typed, before anybody has judged it as a whole; imports nothing heavy."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields
from typing import Any, TypeVar

Options = TypeVar("Options", bound=Any)
"""A frozen dataclass of which every field has a default."""


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
    """Return options with these values and defaults for the rest, before anybody has judged them together."""
    options = object.__new__(kind)
    for field in fields(kind):
        assert field.default is not MISSING  # every option has one
        object.__setattr__(options, field.name, values.get(field.name, field.default))
    return options


def settled(kind: type[Options], options: Options) -> Options:
    """Return the values of a configuration alone, checked, from options that add to it."""
    made: Options = kind(**{field.name: getattr(options, field.name) for field in fields(kind)})
    return made
