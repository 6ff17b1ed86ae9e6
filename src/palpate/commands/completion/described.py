"""The command line as a shell has to know it: words, options, and what may follow them."""

import ast
import inspect
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import tyro

from palpate.commands.typed_options import Flag

NAMED_ROBOT = "robot"
"""A field of this name takes a robot that comes with palpate, or a robot file."""

LONGEST = 100
"""Letters of what is said of an option: menus of shells have a line for it."""

SIMULATED_LIBRARY = {"library": ("simulated",)}
"""Fields of files that have names for some, too."""


@dataclass(frozen=True, slots=True)
class Values:
    """What may follow an option, or stand where a command takes a word.

    Attributes:
        choices: Words that may.
        files: Whether a file or folder may.
        none: Whether nothing may: a flag.
    """

    choices: tuple[str, ...] = ()
    files: bool = False
    none: bool = False


FLAG = Values(none=True)


@dataclass(frozen=True, slots=True)
class Option:
    """An option of a command.

    Attributes:
        name: As typed, with its dashes.
        about: One line; may be empty.
        values: What follows it.
    """

    name: str
    about: str
    values: Values


@dataclass(frozen=True, slots=True)
class Node:
    """A word of the command line, and what may follow it.

    Attributes:
        words: From the program's name, without it, to this word; empty for the program.
        about: One line.
        children: Commands that may follow.
        options: Likewise.
        places: What stands without an option, in order.
    """

    words: tuple[str, ...]
    about: str
    children: "tuple[Node, ...]" = ()
    options: tuple[Option, ...] = ()
    places: tuple[Values, ...] = ()

    def all(self) -> "Iterator[Node]":
        """Yield this word and all below it."""
        yield self
        for child in self.children:
            yield from child.all()


HELP = Option("--help", "Show the help, and nothing else.", FLAG)


def described_command(
    words: tuple[str, ...], about: str, kind: type, flags: Sequence[Flag], robots: Sequence[str]
) -> Node:
    """Return a command as shells have to know it.

    Args:
        words: That start it.
        about: What it does, in one line.
        kind: Of its options.
        flags: That it takes besides.
        robots: Names of those that come with palpate.
    """
    hints = get_type_hints(kind, include_extras=True)
    lines = field_docstrings(kind)
    options: list[Option] = []
    places: list[Values] = []
    for each in fields(kind):
        plain, extras = _without_extras(hints[each.name])
        values = _values(each.name, plain, robots)
        if tyro.conf.Positional in extras:
            places.append(values)
            continue
        name = "--" + (_other_name(extras) or each.name).replace("_", "-")
        options.append(Option(name, lines.get(each.name, ""), values))
        if values.none and tyro.conf.FlagCreatePairsOff not in extras:
            options.append(Option("--no-" + name[2:], "", FLAG))
    known = {option.name for option in options}
    for flag in flags:
        name = "--" + flag.field.replace("_", "-")
        if name not in known:
            options.append(Option(name, flag.value, FLAG))
    return Node(words, about, (), (*options, HELP), tuple(places))


def field_docstrings(kind: type) -> Mapping[str, str]:
    """Return the first sentence that stands below each field of a class and its bases, by the field's name."""
    found: dict[str, str] = {}
    for base in reversed(kind.__mro__[:-1]):
        tree = ast.parse(textwrap.dedent(inspect.getsource(base))).body[0]
        assert isinstance(tree, ast.ClassDef)
        for field, line in zip(tree.body, tree.body[1:], strict=False):
            if (
                isinstance(field, ast.AnnAssign)
                and isinstance(field.target, ast.Name)
                and isinstance(line, ast.Expr)
                and isinstance(line.value, ast.Constant)
                and isinstance(line.value.value, str)
            ):
                found[field.target.id] = first_sentence(line.value.value)
    return found


def first_sentence(text: str) -> str:
    """Return the first sentence, in one line, cut if it is long."""
    line = " ".join(text.split())
    end = line.find(". ")
    return textwrap.shorten(line if end < 0 else line[: end + 1], LONGEST, placeholder=" ...")


def _without_extras(hint: Any) -> tuple[Any, tuple[Any, ...]]:
    if get_origin(hint) is Annotated:
        plain, *extras = get_args(hint)
        return plain, tuple(extras)
    return hint, ()


def _other_name(extras: tuple[Any, ...]) -> str:
    """Another name than the field's, if the command line has one."""
    names = (getattr(each, "name", None) for each in extras)
    return next((name for name in names if isinstance(name, str)), "")


def _values(name: str, hint: Any, robots: Sequence[str]) -> Values:
    hint, _ = _without_extras(hint)
    if name == NAMED_ROBOT:
        return Values(tuple(robots), files=True)
    if hint is bool:
        return FLAG
    if hint is Path:
        return Values(SIMULATED_LIBRARY.get(name, ()), files=True)
    if get_origin(hint) is Literal:
        return Values(tuple(map(str, get_args(hint))))
    if get_origin(hint) in (Union, UnionType):
        kept = [each for each in get_args(hint) if each is not type(None)]
        return _values(name, kept[0], robots) if len(kept) == 1 else Values()
    return Values()
