"""Parses command-line options before they are checked as a whole; imports nothing heavy."""

import dataclasses
import inspect
import os
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields, make_dataclass
from functools import partial
from pathlib import Path
from types import SimpleNamespace, UnionType
from typing import Annotated, Any, Literal, NoReturn, TextIO, TypeVar, Union, get_args, get_origin, get_type_hints

import tyro
from tyro import _errors
from tyro._docstrings import get_field_docstring

from palpate.errors import InvalidValueError
from palpate.experiments.kit.options import option_of_symbol, put_first, specs_of
from palpate.nearest_name import nearest
from palpate.reporting.data import FigureKind
from palpate.reporting.units import UNITS

Options = TypeVar("Options", bound=Any)
"""A frozen dataclass."""

_EXPERIMENT_FILE = (
    "Experiment file: lines like `force: 3`, with the names of these options. Options typed here override "
    "the file, and the file overrides the robot file."
)
"""Help of --config."""

_SI_UNITS = {**UNITS, "cm": ("m", 1e-2), "Nm": UNITS["N m"]}
"""Units that people type: suffix of a key in JSON, and factor to the SI unit."""

_NUMBER_WITH_UNIT = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\d\s.,:=].*)")


@dataclass(frozen=True, slots=True)
class SharedOption:
    """An option that many commands share, outside of their configuration.

    Attributes:
        name: Name of its field; typed with hyphens.
        about: Help text.
        kind: Type of the values.
        default: Value where it is not typed.
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


def read_options(
    kind: type[Options], command: str, arguments: Sequence[str], shared: Sequence[SharedOption] = ()
) -> tuple[Options, Mapping[str, Any]]:
    """Return the options typed for a command, and the values of shared options by name.

    A command that has an option of the same name keeps its own. `--help` is printed and ends the program.

    Args:
        kind: Class of the options; its fields need not have defaults.
        command: Command as typed, with the program's name.
        arguments: Words typed after the command.
        shared: Shared options of the command.

    Raises:
        InvalidValueError: If the options are not understood, or a value is refused.
    """
    return _parsed(with_shared(kind, command, shared), command, arguments, shared)


def read_experiment(
    kind: type[Options], experiment: str, command: str, arguments: Sequence[str], shared: Sequence[SharedOption]
) -> tuple[Options, Mapping[str, Any]]:
    """Return the options typed for an experiment on top of the file that --config names, and the shared options.

    Args:
        kind: Class of its `Config`.
        experiment: Name of the experiment.
        command: Command as typed, with the program's name.
        arguments: Words typed after the command.
        shared: Shared options of experiments.

    Raises:
        InvalidValueError: If the file cannot be read, something in it is wrong, or a typed option is.
    """
    named = with_shared(kind, command, shared, experiment_file=True)
    file = _typed_value("config", arguments)
    if file is None:
        return _parsed(named, command, arguments, shared)
    from palpate.experiments.kit.config_file import load_overlay

    values = SimpleNamespace(**load_overlay(Path(file), experiment, kind))
    defaults: Any = object.__new__(named)  # not checked: options that are typed may correct the file
    for each in fields(named):
        object.__setattr__(defaults, each.name, getattr(values, each.name, each.default))
    return _parsed(named, command, arguments, shared, default=defaults)


def with_shared(kind: type, command: str, shared: Sequence[SharedOption], *, experiment_file: bool = False) -> Any:
    """Return the class that tyro reads: a command's options with their help, and shared options.

    A command that has an option of the same name keeps its own.

    Args:
        kind: Class of the options.
        command: Command as typed.
        shared: Shared options of the command.
        experiment_file: Whether --config is offered.
    """
    own = {each.name for each in fields(kind)}
    added: list[tuple[str, Any, Any]] = [
        (each.name, Annotated[each.kind, tyro.conf.arg(help=each.about)], dataclasses.field(default=each.default))
        for each in shared
        if each.name not in own
    ]
    if experiment_file:
        file = Annotated[Path | None, tyro.conf.arg(metavar="FILE.YAML", help=_EXPERIMENT_FILE)]
        added.insert(0, ("config", file, dataclasses.field(default=None)))
    named: Any = make_dataclass(command, added, bases=(kind,), frozen=True)
    put_first(named, [each.name for each in fields(kind)])
    hints = get_type_hints(kind, include_extras=True)
    for name in own:
        # evaluated only for --help: reading source is slow; tyro alone would keep the line breaks of the source
        about: Any = partial(_paragraphs, kind, name)
        named.__annotations__[name] = Annotated[hints[name], tyro.conf.arg(help=about)]
    return named


def _parsed(
    named: Any, command: str, arguments: Sequence[str], shared: Sequence[SharedOption], **keywords: Any
) -> tuple[Any, Mapping[str, Any]]:
    (kind,) = named.__bases__
    found = parsed(named, command, inspect.getdoc(kind), arguments, partial(_refuse, named, arguments), **keywords)
    own = {each.name for each in fields(kind)}
    values = {each.name: getattr(found, each.name) for each in shared if each.name not in own}
    return kind(**{name: getattr(found, name) for name in own}), values


def parsed(
    kind: Any, command: str, about: str | None, arguments: Sequence[str], refuse: Any, **keywords: Any
) -> Any:
    """Return what tyro makes of arguments; `refuse` is called with its event if it can make nothing of them."""
    with _help_colours(), _errors.on_parse_error(refuse):
        return tyro.cli(kind, prog=command, description=about, args=arguments, **keywords)


def _paragraphs(kind: type, name: str) -> str:
    """Return the docstring of a field, each paragraph in one line; an inherited one if the class gives none."""
    declaring = (each for each in kind.__mro__ if name in getattr(each, "__dataclass_fields__", ()))
    text = next(filter(None, (get_field_docstring(each, name, ()) for each in declaring)), "")
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def _typed_value(name: str, arguments: Sequence[str]) -> str | None:
    """Return the value typed for an option, without judging the rest."""
    return next(iter(_typed_words(f"--{name}", arguments)), None)


def _typed_words(flag: str, arguments: Sequence[str]) -> list[str]:
    """Return the words typed for an option, up to the next option; for an option typed twice, the later words."""
    words: list[str] = []
    for i, word in enumerate(arguments):
        name, equals, value = word.partition("=")
        if name.replace("_", "-") != flag.replace("_", "-"):
            continue
        words = [value] if equals else []
        for following in arguments[i + 1 :] if not equals else ():
            if following.startswith("--"):
                break
            words.append(following)
    return words


# --- refusals ---


def _refuse(named: Any, arguments: Sequence[str], event: Any) -> NoReturn:
    """Raise the parser's refusal as an error in one line: name, value, limit, remedy."""
    raise InvalidValueError(_refusal(named, arguments, event)) from None


def _refusal(named: Any, arguments: Sequence[str], event: Any) -> str:
    (kind,) = named.__bases__
    see_help = f"`{event.prog} --help` explains the options"
    match event:
        case _errors.InstantiationFailure(argument=None):
            return str(event.message)
        case _errors.InstantiationFailure():
            return _wrong_value(kind, event, arguments)
        case _errors.InvalidChoice():
            near = nearest(event.value, event.choices)
            meant = f"; did you mean {near}?" if near else ""
            name = event.argument.field.intern_name
            return f"{name} = {event.value}: must be one of {', '.join(event.choices)}{meant}"
        case _errors.BadValue():
            flag, metavar = event.argument.lowered.name_or_flags[-1], event.argument.lowered.metavar
            return f"{flag}: a value is missing; give {flag} {metavar}"
        case _errors.MissingArgs():
            missing = [each.arg for each in event.missing_arguments]
            names = ", ".join(
                str(each.lowered.metavar) if each.is_positional() else each.lowered.name_or_flags[-1]
                for each in missing
            )
            about = _paragraphs(kind, missing[0].field.intern_name)
            examples = [line for line in (inspect.getdoc(kind) or "").splitlines() if line.startswith("Example")]
            return " ".join([f"{names} {'is' if len(missing) == 1 else 'are'} missing:", about, *examples[:1]])
        case _errors.UnrecognizedArgs():
            problem = "no such option" if event.tokens[0].startswith("-") else "unexpected"
            return f"{' '.join(event.tokens)}: {problem}; {_meant_option(named, arguments) or see_help}"
        case _:
            return f"{' '.join(arguments)}: not understood; {see_help}"


def _wrong_value(kind: type, event: Any, arguments: Sequence[str]) -> str:
    """Return the refusal of words that have not the type of their option."""
    argument = event.argument
    name, metavar = argument.field.intern_name, argument.lowered.metavar
    if argument.is_positional():
        words = re.findall("'([^']*)'", event.message)[-1:]
    else:
        words = _typed_words(argument.lowered.name_or_flags[-1], arguments)
    types = _leaves(get_type_hints(kind)[name])
    if types <= {int, float, type(None)}:
        wanted, convert = ("a number", float) if float in types else ("a whole number", int)
        for word in words:
            try:
                convert(word)
            except ValueError:
                return f"{name} = {word}: must be {wanted}{_unit_hint(kind, name, word)}"
    return f"{name} = {' '.join(words)}: must be {metavar}"


def _unit_hint(kind: type, name: str, word: str) -> str:
    """Return the remedy for a number that is typed with a unit, as 20mm; "" for any other word."""
    typed = _NUMBER_WITH_UNIT.fullmatch(word.strip())
    if typed is None:
        return ""
    declared = re.search(r"\[([^\]\s][^\]]*)\]", _paragraphs(kind, name))
    unit, typed_unit = specs_of(kind)[name].unit or (declared[1] if declared else ""), typed[2]
    ratio = None
    if (unit, typed_unit) == ("", "%"):
        ratio = 0.01
    elif unit in _SI_UNITS and typed_unit in _SI_UNITS and _SI_UNITS[unit][0] == _SI_UNITS[typed_unit][0]:
        ratio = _SI_UNITS[typed_unit][1] / _SI_UNITS[unit][1]
    remedy = "" if ratio is None else f": give {float(typed[1]) * ratio:.12g}"
    in_unit = f"this option is in {unit}" if unit else "and this option has none"
    return f"; units are not typed, {in_unit}{remedy}"


def _leaves(hint: Any) -> set[Any]:
    """Return the types within a type: float of tuple[float, ...] | None, and NoneType."""
    if get_origin(hint) in (tuple, Union, UnionType, Annotated):
        return {leaf for each in get_args(hint) if each is not Ellipsis for leaf in _leaves(each)}
    return {hint}


def _meant_option(named: Any, arguments: Sequence[str]) -> str:
    """Return advice on the first word that looks like a slip; "" if none does."""
    hints = {"--" + name.replace("_", "-"): hint for name, hint in get_type_hints(named).items()}
    positional = any(
        tyro.conf.Positional in get_args(hint) for hint in get_type_hints(named, include_extras=True).values()
    )
    for word, last in zip(arguments, ("", *arguments), strict=False):
        if word.startswith("--"):
            name = word.partition("=")[0].replace("_", "-")
            if name not in hints:
                symbol = option_of_symbol(named, name.removeprefix("--"))
                near = f"--{symbol.replace('_', '-')}" if symbol else nearest(name, list(hints))
                return f"did you mean {near}?" if near else ""
        elif not positional and not (last.startswith("--") and "=" not in last and hints.get(last) is not bool):
            for option, hint in hints.items():
                if word in _choices(hint):
                    return f"options have names here: did you mean {option} {word}?"
    return ""


def _choices(hint: Any) -> tuple[str, ...]:
    """Return the words that a value of a type can be; empty if it can be any."""
    if get_origin(hint) is Literal:
        return get_args(hint)
    if get_origin(hint) in (Union, UnionType):
        return tuple(choice for each in get_args(hint) for choice in _choices(each))
    return ()


# --- colours ---


def coloured(stream: TextIO) -> bool:
    """Return whether colours belong on a stream (https://no-color.org, https://force-color.org)."""
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return stream.isatty() and os.environ.get("TERM") not in (None, "dumb")


@contextmanager
def _help_colours() -> Iterator[None]:
    """Let tyro colour its help if colours belong on standard output; it honours neither variable."""
    options = tyro._experimental_options
    before, out = options["ansi_codes"], sys.stdout
    options["ansi_codes"] = coloured(out)
    if options["ansi_codes"]:
        sys.stdout = _Terminal(out)
    try:
        yield
    finally:
        options["ansi_codes"], sys.stdout = before, out


class _Terminal:
    """A stream that claims to be a terminal."""

    def __init__(self, stream: Any) -> None:
        self._stream = stream

    def isatty(self) -> bool:
        return True

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)
