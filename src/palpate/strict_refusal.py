"""What is wrong in a YAML file: where, what, and what would be right."""

import re
from collections.abc import Sequence

from palpate.errors import shown
from palpate.nearest_name import nearest
from palpate.strict_types import choices
from palpate.strict_yaml import Key, place_of

LONGEST_SHOWN = 60
"""Characters of a wrong key that a message repeats."""


class Refusal(Exception):  # noqa: N818  # becomes an InvalidValueError once the place is known
    """What is wrong at a place, before the line is looked up."""

    def __init__(self, path: Sequence[Key], message: str) -> None:
        """Take where it is, and what is wrong there."""
        super().__init__(message)
        self.path = tuple(path)
        self.message = message

    def told(self, text: str) -> str:
        """Return it in one line."""
        place = place_of(text, self.path) if text else ""
        where = shown_path(self.path)
        return (where + self.message if where else self.message.removeprefix(": ")) + place


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
    """Return what is wrong with a word that is none of those that are known."""
    near = nearest(given, known) if isinstance(given, str) else None
    meant = f"did you mean {near}? " if near else ""
    return f" = {shown(given)}: {meant}known: {', '.join(known)}"


_PLACE = re.compile(r" - at `\$([^`]*)`$")
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")
_MISSING = re.compile(r"Object missing required field `(.*)`")
_NAME_IN_FRONT = re.compile(r"([A-Za-z_]\w*)(?= |,|\[|:)")


def parted(message: str) -> tuple[str, tuple[Key, ...]]:
    """Part what msgspec says from where (it writes "... - at `$.payload.mass_kg`")."""
    found = _PLACE.search(message)
    if found is None:
        return message, ()
    steps = (int(index) if index else name for name, index in _STEP.findall(found[1]))
    return message[: found.start()], tuple(steps)


def refusal(message: str, path: tuple[Key, ...], found: object, kind: object) -> Refusal:
    """Make what msgspec says, or a type's own check, into a refusal with its full path."""
    value = _at(found, path)
    missing = _MISSING.fullmatch(message)
    if missing:
        return Refusal((*path, missing[1]), f": missing; give a line `{missing[1]}: ...`")
    if message.startswith("Invalid enum value"):
        return Refusal(path, not_among(value, [str(choice) for choice in choices(kind, path)]))
    if message.startswith(("Expected ", "Invalid ")):
        return Refusal(path, f": {message}{_given(message, value)}{_advice(message, value)}")
    name = _NAME_IN_FRONT.match(message)
    if name and isinstance(value, dict) and name[1] in value:
        # a type's own check starts with the key: "mass_kg = -1 kg: must be ..."
        return Refusal((*path, name[1]), message[name.end() :])
    return Refusal(path, f": {message}")


def _at(found: object, path: Sequence[Key]) -> object:
    for step in path:
        try:
            found = found[step]  # type: ignore[index]  # whatever msgspec named, it has walked through
        except (KeyError, IndexError, TypeError):
            return None
    return found


def _given(message: str, value: object) -> str:
    return f" ({shown(value)})" if isinstance(value, str) and "got `str`" in message else ""


def _advice(message: str, value: object) -> str:
    if message.startswith("Expected `str`"):
        return "; put it in quotes"
    if isinstance(value, str) and re.match(r"\s*[-+]?\.?\d", value):
        return "; write a plain number in SI units, with a decimal point and nothing behind it"
    if "got `null`" in message:
        return "; write a value, or leave the key out if it has a default"
    return ""
