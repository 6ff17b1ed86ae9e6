"""Writing YAML that `palpate.strict_yaml` reads back to exactly the same values."""

import math
import re
from collections.abc import Mapping, Sequence

from palpate.errors import InvalidValueError
from palpate.strict_yaml import read_yaml

_PLAIN = re.compile(r"[A-Za-z_/][A-Za-z0-9_./-]*( [A-Za-z0-9_./-]+)*")
"""Words that need no quotes, unless they mean something else."""


def yaml_text(values: Mapping[str, object], comments: Mapping[str, str] | None = None) -> str:
    """Return a mapping as YAML text, one key to a line.

    Args:
        values: Of strings, numbers, booleans, None, lists and mappings; every float reads back to the same bits.
        comments: Of some of its keys, to stand behind their values.

    Raises:
        InvalidValueError: A text with half a character, which no file can hold.
    """
    notes = comments or {}
    lines: list[str] = []
    for key, value in values.items():
        first, *rest = _lines(key, value)
        lines += [f"{first}  # {notes[key]}" if key in notes else first, *rest]
    return "".join(f"{line}\n" for line in lines)


def _lines(key: str, value: object) -> list[str]:
    """A key and its value: on one line, but for mappings and lists of mappings."""
    name = _word(key)
    if isinstance(value, Mapping) and value:
        return [f"{name}:", *(f"  {line}" for k, v in value.items() for line in _lines(str(k), v))]
    if isinstance(value, list | tuple) and any(isinstance(item, Mapping) and item for item in value):
        return [f"{name}:", *(f"  {line}" for item in value for line in _item(item))]
    return [f"{name}: {_flow(value)}"]


def _item(item: object) -> list[str]:
    if not (isinstance(item, Mapping) and item):
        return [f"- {_flow(item)}"]
    first, *rest = (line for k, v in item.items() for line in _lines(str(k), v))
    return [f"- {first}", *(f"  {line}" for line in rest)]


def _flow(value: object) -> str:
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, str):
        return _word(value)
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_word(str(k))}: {_flow(v)}" for k, v in value.items()) + "}"
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(_flow, value)) + "]"
    raise TypeError(f"{value!r}: no YAML for a {type(value).__name__}")


def _number(value: float) -> str:
    if math.isfinite(value):
        return repr(value)  # the shortest digits that read back to the same bits
    return ".nan" if math.isnan(value) else ".inf" if value > 0.0 else "-.inf"


def _word(text: str) -> str:
    if _PLAIN.fullmatch(text) and read_yaml(text) == text:
        return text
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        raise InvalidValueError(f"{text!a}: has half a character, which cannot be written; give another name")
    return '"' + "".join(map(_escaped, text)) + '"'


def _escaped(letter: str) -> str:
    if letter in '"\\':
        return f"\\{letter}"
    if letter.isprintable():
        return letter
    return f"\\U{ord(letter):08x}"
