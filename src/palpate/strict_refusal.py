"""Errors in a YAML file: the place, what is wrong, and what is expected."""

import re
from collections.abc import Sequence

from palpate.errors import shown
from palpate.nearest_name import nearest
from palpate.open_kinds import declared_in
from palpate.strict_types import choices, family_of, item_type, known_keys, records, tags, type_at
from palpate.strict_yaml import Key, place_of

LONGEST_SHOWN = 60
"""Characters of a wrong key that a message repeats."""


LONGEST_MESSAGE = 1000
"""Characters of a message."""


class DecodeRefusal(Exception):  # noqa: N818  # becomes an InvalidValueError once the place is known
    """An error at a place, before its line is looked up."""

    def __init__(self, path: Sequence[Key], message: str) -> None:
        """Take where it is, and what is wrong there."""
        super().__init__(message)
        self.path = tuple(path)
        self.message = message

    def located(self, text: str) -> str:
        """Return the message with its place, in one line."""
        place = place_of(text, self.path) if text else ""
        where = shown_path(self.path)
        message = where + self.message if where else self.message.removeprefix(": ")
        if len(message) > LONGEST_MESSAGE:  # it repeats a value of any length; what to do stands at its end
            message = f"{message[: LONGEST_MESSAGE // 2]} ... {message[-LONGEST_MESSAGE // 2 :]}"
        return message + place


def shown_path(path: Sequence[Key]) -> str:
    """Return a path as people write it: fingers[0].surface.radius_m."""
    written = ""
    for step in path:
        if isinstance(step, int):
            written += f"[{step}]"
        else:
            name = step[:LONGEST_SHOWN] if step.isprintable() else ascii(step[:LONGEST_SHOWN])
            written += f".{name}" if written else name
    return written


def not_among(given: object, known: Sequence[str]) -> str:
    """Return the message for a word that is not among the known ones."""
    near = nearest(given, known) if isinstance(given, str) else None
    meant = f"did you mean {near}? " if near else ""
    return f" = {shown(given)}: {meant}known: {', '.join(known)}"


_PLACE = re.compile(r" - at `\$([^`]*)`$")
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")
_MISSING = re.compile(r"Object missing required field `(.*)`")
_TYPE = re.compile(r"`([a-z]+(?: \| [a-z]+)*)`")
_MISTYPED = re.compile(rf"Expected {_TYPE.pattern}, got `[a-z]+`")
_NAME_IN_FRONT = re.compile(r"([A-Za-z_]\w*)(?= |,|\[|:)")


def parted(message: str) -> tuple[str, tuple[Key, ...]]:
    """Split msgspec's message into text and path (it writes "... - at `$.payload.mass_kg`")."""
    found = _PLACE.search(message)
    if found is None:
        return message, ()
    steps = (int(index) if index else name for name, index in _STEP.findall(found[1]))
    return message[: found.start()], tuple(steps)


def refusal(message: str, path: tuple[Key, ...], found: object, kind: object) -> DecodeRefusal:
    """Return the error of msgspec, or of a type's own check, with its full path."""
    value = _at(found, path)
    missing = _MISSING.fullmatch(message)
    if missing:
        return DecodeRefusal((*path, missing[1]), f": missing; give a line `{missing[1]}: ...`")
    if message.startswith("Invalid enum value"):
        return DecodeRefusal(path, not_among(value, [str(choice) for choice in choices(kind, path)]))
    mistyped = _MISTYPED.fullmatch(message)
    if mistyped:
        return DecodeRefusal(path, _mistyped(mistyped[1].split(" | "), path, value, kind))
    if message.startswith("Expected "):  # a size or a limit: "Expected `array` of length 3, got 2"
        expected = _TYPE.sub(lambda found: _alternatives(found[1].split(" | ")), message.removeprefix("Expected "))
        return DecodeRefusal(path, f": must be {expected}")
    if message.startswith("Invalid "):
        return DecodeRefusal(path, f": {message}")
    name = _NAME_IN_FRONT.match(message)
    if name and isinstance(value, dict) and name[1] in value:
        # a type's own check starts with the key: "mass_kg = -1 kg: must be ..."
        return DecodeRefusal((*path, name[1]), message[name.end() :])
    return DecodeRefusal(path, f": {message}")


def _at(found: object, path: Sequence[Key]) -> object:
    for step in path:
        try:
            found = found[step]  # type: ignore[index]  # whatever msgspec named, it has walked through
        except (KeyError, IndexError, TypeError):
            return None
    return found


_TYPES = {
    "float": "a number",
    "int": "a whole number",
    "bool": "true or false",
    "str": "text",
    "array": "a list",
    "object": "a mapping (`key: value` lines)",
    "path": "the path of a file",
}
"""msgspec's type names, in words for people who write YAML."""


def _alternatives(names: Sequence[str]) -> str:
    """Return one or several of msgspec's types in words, without null."""
    kept = [name for name in names if name != "null" and not (name == "int" and "float" in names)]
    return " or ".join(_TYPES.get(name, name) for name in kept)


def _mistyped(names: Sequence[str], path: Sequence[Key], value: object, kind: object) -> str:
    """Return the message for a value of the wrong type."""
    words = choices(kind, path)
    if words and value is not None and all(isinstance(word, str) for word in words):
        return not_among(value, words)
    given = "" if not path else ": no value" if value is None else f" = {_written(value)}"
    return f"{given}: must be {_wanted(names, value, type_at(kind, path))}{_advice(names, value)}"


def _wanted(names: Sequence[str], value: object, kind: object) -> str:
    """Return the expected type in words, with the keys of a mapping."""
    expected = _alternatives(names)
    family = family_of(kind)
    if "object" in names and family is not None:
        return f"{expected} with kind: and one of {', '.join(declared_in(family.GROUP))}"
    if "object" in names and records(kind):
        return f"{expected} with {_keys(records(kind))}"
    if "array" not in names:
        return expected
    if records(item_type(kind)):
        return f"{expected} of mappings with {_keys(records(item_type(kind)))}"
    return expected if value is None or isinstance(value, dict) else f"{expected}, as in [{_written(value)}]"


def _keys(kinds: Sequence[type]) -> str:
    tag, named = tags(kinds)
    return f"{tag}: and one of {', '.join(named)}" if tag else f"the keys {', '.join(known_keys(kinds[0]))}"


def _written(value: object) -> str:
    """Return a value as it is written in the file."""
    return str(value).lower() if isinstance(value, bool) else shown(value)


def _advice(names: Sequence[str], value: object) -> str:
    if value is None:
        return "; write one, or leave the key out if it has a default"
    if "str" in names and isinstance(value, bool | int | float):
        return "; put it in quotes"
    if {"int", "float"} & set(names) and isinstance(value, str) and re.match(r"\s*[-+]?\.?\d", value):
        return "; write a plain number in SI units, with a decimal point and nothing behind it"
    return ""
