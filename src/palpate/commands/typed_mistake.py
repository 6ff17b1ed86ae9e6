"""What people may have meant who typed something that the parser refuses."""

from collections.abc import Sequence
from dataclasses import fields
from inspect import getdoc
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import tyro

from palpate.experiments.kit.options import option_of_symbol
from palpate.nearest_name import nearest


def advice_on_mistake(kind: type, arguments: Sequence[str]) -> str:
    """Return a line on the first mistake that looks like a slip, or, if nothing is typed, what can be; or nothing.

    Args:
        kind: Of the command's options.
        arguments: That the parser has refused.
    """
    if not arguments:
        return "\n".join(line.strip() for line in (getdoc(kind) or "").splitlines() if line.startswith("Example"))
    plain, marked = get_type_hints(kind), get_type_hints(kind, include_extras=True)
    places = [each.name for each in fields(kind) if tyro.conf.Positional in get_args(marked[each.name])]
    hints = {"--" + each.name.replace("_", "-"): plain[each.name] for each in fields(kind)}
    for word, last in zip(arguments, ("", *arguments), strict=False):
        name, equals, value = word.partition("=")
        name, last = name.replace("_", "-"), last.replace("_", "-")  # the parser takes either
        near = None
        if word.startswith("--"):
            if name not in hints and (option := option_of_symbol(kind, name.removeprefix("--"))):
                near = "--" + option.replace("_", "-")
            elif equals:
                near = _nearest(value, hints.get(name))
        elif last.startswith("--") and "=" not in last and hints.get(last) is not bool:
            near = _nearest(word, hints.get(last))
        elif not places:
            for option, hint in hints.items():
                if word in _choices(hint):
                    return f"Options have names here: did you mean {option} {word}?"
        elif not last:
            near = _nearest(word, plain[places[0]])
        if near:
            return f"Did you mean {near}?"
    return ""


def _nearest(word: str, hint: Any) -> str | None:
    choices = _choices(hint)
    return None if word in choices else nearest(word, choices)


def _choices(hint: Any) -> tuple[str, ...]:
    """The words that a value of this type can be; empty if it can be any."""
    if get_origin(hint) is Literal:
        return get_args(hint)
    if get_origin(hint) in (Union, UnionType):
        return tuple(choice for each in get_args(hint) for choice in _choices(each))
    return ()
