"""Parses command-line options before they are checked as a whole; imports nothing heavy."""

import dataclasses
import inspect
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, make_dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any, TypeVar, get_type_hints

import tyro
from tyro._docstrings import get_field_docstring

from palpate.commands.colours import parser_colours
from palpate.reporting.data import FigureKind

Options = TypeVar("Options", bound=Any)
"""A frozen dataclass."""


EXPERIMENT_FILE = (
    "Experiment file: lines like `force: 3`, with the names of these options. Options typed here override "
    "the file, and the file overrides the robot file."
)
"""Help of --config."""


@dataclass(frozen=True, slots=True)
class SharedOption:
    """An option that many commands share, outside of their configuration.

    Attributes:
        name: As it is typed, and that of a field.
        about: Its help.
        kind: Of its values.
        default: Where it is not typed.
    """

    name: str
    about: str
    kind: Any = Annotated[bool, tyro.conf.FlagCreatePairsOff]  # no --no-json: the default is off
    default: Any = False


JSON = SharedOption(
    "json", "Print one JSON document, numbers in SI units, and write everything else to standard error."
)
DRY_RUN = SharedOption(
    "dry_run",
    "Plan and check everything and show what would be done: move nothing, connect to nothing, write nothing.",
)
FIGURES = SharedOption(
    "figures",
    "Write each figure of the report as a file, too, in the style of a paper, into the folder figures.",
    FigureKind | None,
    None,
)


def read_typed(kind: type[Options], command: str, arguments: Sequence[str], **keywords: Any) -> Options:
    """Return the options typed for a command; an error, or --help, is printed and ends the program.

    Args:
        kind: Of the options; its fields need not have defaults.
        command: As it is typed, with the program's name, for messages.
        arguments: What follows it.
        keywords: For `tyro.cli`, as description and default.
    """
    return read_with_shared(kind, command, arguments, (), **keywords)[0]


def read_with_shared(
    kind: type[Options], command: str, arguments: Sequence[str], shared: Sequence[SharedOption], **keywords: Any
) -> tuple[Options, Mapping[str, Any]]:
    """Return what is typed for a command as `read_typed`, and the values of these shared options by name.

    A command that has an option of the same name keeps its own.
    """
    found = _parsed(with_shared(kind, command, shared), kind, command, arguments, keywords)
    return _made(kind, found), _values(found, kind, shared)


def read_experiment(
    kind: type[Options], experiment: str, command: str, arguments: Sequence[str], shared: Sequence[SharedOption]
) -> tuple[Options, Mapping[str, Any]]:
    """Return what is typed for an experiment on top of the file that --config names, and the shared options.

    Args:
        kind: Its `Config`.
        experiment: Its name.
        command: As it is typed, with the program's name.
        arguments: What follows it.
        shared: That it has besides.

    Raises:
        InvalidValueError: The file cannot be read, or something in it is wrong.
    """
    keywords: dict[str, Any] = {"description": inspect.getdoc(kind)}
    named = with_shared(kind, command, shared, experiment_file=True)
    file = option("config", arguments)
    if file is not None:
        from palpate.experiments.kit.config_file import load_overlay

        keywords["default"] = SimpleNamespace(**load_overlay(Path(file), experiment, kind))
    found = _parsed(named, kind, command, arguments, keywords)
    return _made(kind, found), _values(found, kind, shared)


def with_shared(kind: type, command: str, shared: Sequence[SharedOption], *, experiment_file: bool = False) -> Any:
    """Return the type that tyro reads: the options of a command with what explains them, and these shared ones.

    A command that has an option of the same name keeps its own.

    Args:
        kind: Of the options.
        command: As it is typed.
        shared: Besides.
        experiment_file: Whether --config is offered.
    """
    typed: list[tuple[str, Any, Any]] = [
        (
            each.name,
            Annotated[each.kind, tyro.conf.arg(help=each.about)],
            dataclasses.field(default=each.default),
        )
        for each in shared
        if each.name not in _names(kind)
    ]
    if experiment_file:
        file = Annotated[Path | None, tyro.conf.arg(metavar="FILE.YAML", help=EXPERIMENT_FILE)]
        typed.insert(0, ("config", file, dataclasses.field(default=None)))
    # where values cannot be together, tyro names the class that refuses them: people know the command, not ours
    named: Any = make_dataclass(command, typed, bases=(kind,), frozen=True)
    named.__annotations__ |= _explained(kind)
    return named


def _parsed(named: Any, kind: type, command: str, arguments: Sequence[str], keywords: dict[str, Any]) -> Any:
    if "default" in keywords:
        keywords["default"] = _copied(keywords["default"], named)
    with parser_colours(arguments):
        try:
            return tyro.cli(named, prog=command, args=arguments, **keywords)
        except SystemExit as left:
            if left.code:
                _advise(kind, arguments)
            raise


def _made(kind: type[Options], found: Any) -> Options:
    """The options alone, checked."""
    made: Options = kind(**{name: getattr(found, name) for name in _names(kind)})
    return made


def _values(found: Any, kind: type, shared: Sequence[SharedOption]) -> Mapping[str, Any]:
    return {each.name: getattr(found, each.name) for each in shared if each.name not in _names(kind)}


def _names(kind: type) -> frozenset[str]:
    return frozenset(each.name for each in fields(kind))


def _explained(kind: type) -> dict[str, Any]:
    """The types of the fields of a class, each with what stands below it as its help.

    tyro would keep the line breaks of the source, and wrap each of its lines alone.
    """
    hints = get_type_hints(kind, include_extras=True)
    explained: dict[str, Any] = {}
    for each in fields(kind):
        # evaluated only for --help: reading source is slow
        keywords: Any = partial(_paragraphs, kind, each.name)
        explained[each.name] = Annotated[hints[each.name], tyro.conf.arg(help=keywords)]
    return explained


def _paragraphs(kind: type, name: str) -> str:
    """What stands below a field, each paragraph in one line."""
    text = get_field_docstring(kind, name, ()) or ""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def _advise(kind: type, arguments: Sequence[str]) -> None:
    """Print below the parser's message what may have been meant."""
    from palpate.commands.typed_mistake import advice_on_mistake

    if advice := advice_on_mistake(kind, arguments):
        sys.stderr.write(f"{advice}\n")


def _copied(values: Any, named: type) -> Any:
    """The same values in another class, with its defaults for what they lack; not checked."""
    copy: Any = object.__new__(named)
    for each in fields(named):
        object.__setattr__(copy, each.name, getattr(values, each.name, each.default))
    return copy


def option(name: str, arguments: Sequence[str]) -> str | None:
    """Return what is typed for an option, without judging the rest."""
    found = None
    for i, word in enumerate(arguments):
        if word == f"--{name}" and i + 1 < len(arguments):
            found = arguments[i + 1]
        elif word.startswith(f"--{name}="):
            found = word.removeprefix(f"--{name}=")
    return found
