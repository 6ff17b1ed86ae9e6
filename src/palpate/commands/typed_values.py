"""Options and their values as they are typed: `speed=0.01,0.02`, `force=1:5:5`, `tip=[0.008]`."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from palpate.errors import InvalidValueError
from palpate.experiments.kit.options import option_of_symbol
from palpate.nearest_name import nearest, without_unit
from palpate.strict_decode import decode_some
from palpate.strict_types import item_type, known_keys
from palpate.strict_yaml import read_yaml

VARY_FORM = "NAME=VALUE,VALUE or NAME=FIRST:LAST:COUNT, as speed=0.01,0.02"
"""Form of a word behind --vary."""

_MAX_VALUES = 10_000
"""Largest number of values of one option: more means a range with a wrong count."""

_NUMBER = r"\s*([-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)\s*"
_RANGE = re.compile(f"{_NUMBER}:{_NUMBER}:{_NUMBER}")


@dataclass(frozen=True, slots=True)
class Varied:
    """An option that is varied.

    Attributes:
        name: Name of the option.
        values: Its values, of its type, each once, in the order in which they were typed.
    """

    name: str
    values: tuple[object, ...]


def varied_options(words: Sequence[str], kind: type, own: Mapping[str, str]) -> tuple[Varied, ...]:
    """Return the options to vary.

    Args:
        words: Words typed behind --vary.
        kind: Class of the experiment's configuration.
        own: Remedies for names that cannot be varied, by name.

    Raises:
        InvalidValueError: If a name is unknown or stands twice, or a value does not fit its option.
    """
    found: dict[str, Varied] = {}
    for word in words:
        name, text = _parted("--vary", word, VARY_FORM, kind, own)
        if name in found:
            raise InvalidValueError(f"--vary {word}: {name} is varied twice; give all of its values at once")
        values = tuple(_decoded(f"--vary {word}", name, value, kind) for value in _several(word, text))
        for i, value in enumerate(values):
            if value in values[:i]:
                raise InvalidValueError(
                    f"--vary {word}: {shown_value(value)} stands there twice; for more runs of each give --seeds"
                )
        found[name] = Varied(name, values)
    return tuple(found.values())


def set_options(words: Sequence[str], kind: type, own: Mapping[str, str]) -> dict[str, object]:
    """Return the values of options by name, of their types; their combination is not checked.

    Args:
        words: Words typed behind --set.
        kind: Class of the experiment's configuration.
        own: Remedies for names that cannot be set, by name.

    Raises:
        InvalidValueError: If a name is unknown or stands twice, or a value does not fit its option.
    """
    fixed: dict[str, object] = {}
    for word in words:
        name, text = _parted("--set", word, "NAME=VALUE, as force=3", kind, own)
        if name in fixed:
            raise InvalidValueError(f"--set {word}: {name} is set twice")
        several = item_type(known_keys(kind)[name]) is not None and not text.startswith("[")
        fixed[name] = _decoded(
            f"--set {word}", name, _read(f"--set {word}", f"[{text}]" if several else text), kind
        )
    return fixed


def shown_value(value: object, digits: int = 12) -> str:
    """Return a value as it is typed, numbers with at most `digits` digits."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return f"{value:.{digits}g}"
    if isinstance(value, tuple | list):
        return " ".join(shown_value(each, digits) for each in value)
    return str(value)


def plain(value: object) -> float | int | bool | str | None:
    """Return a value as tables hold it: several numbers as a text."""
    return value if value is None or isinstance(value, bool | int | float) else shown_value(value)


def _parted(option: str, word: str, form: str, kind: type, own: Mapping[str, str]) -> tuple[str, str]:
    """Return name and text of a word."""
    typed, equals, text = word.partition("=")
    if not (typed and equals and text.strip()):
        raise InvalidValueError(f"{option} {word}: write {form}, without spaces")
    name = typed.strip().lstrip("-").replace("-", "_")
    known = known_keys(kind)
    if name not in known:
        name = option_of_symbol(kind, name) or name
    if name in own:
        raise InvalidValueError(f"{option} {word}: {own[name]}")
    if name not in known:
        advice = _advice(name, [key for key in known if key not in own])
        raise InvalidValueError(f"{option} {word}: there is no option {typed}; {advice}")
    return name, text.strip()


def _advice(name: str, names: Sequence[str]) -> str:
    """Return advice on an unknown name: landing_speed for speed_mm."""
    stem = without_unit(name)
    akin = [stem] if stem in names else [each for each in names if stem in each.split("_")]
    near = nearest(name, names) or nearest(stem, names)
    if akin or near:
        return f"did you mean {' or '.join(akin or [str(near)])}?"
    return f"there are {', '.join(names)}"


def _several(word: str, text: str) -> list[object]:
    """Return the values of a list or a range, before their type is known."""
    spread = _RANGE.fullmatch(text)
    if spread:
        return _evenly(word, *spread.groups())
    if text.count(":") in (1, 2) and re.match(r"\s*[-+.0-9]", text) and "," not in text:
        raise InvalidValueError(
            f"--vary {word}: write a range as FIRST:LAST:COUNT, three numbers, as in 0.1:0.5:5"
        )
    values = _read(f"--vary {word}", f"[{text}]")
    assert isinstance(values, list)
    return values


def _evenly(word: str, first: str, last: str, count: str) -> list[object]:
    """Return values evenly from first to last, each the float nearest to the true number."""
    number = Fraction(count)
    if number.denominator != 1 or not 2 <= number <= _MAX_VALUES:
        raise InvalidValueError(
            f"--vary {word}: the third number is how many values there are, a whole one from 2 to {_MAX_VALUES}"
        )
    low, high, steps = Fraction(first), Fraction(last), int(number) - 1
    return [float(low + (high - low) * i / steps) for i in range(steps + 1)]


def _read(typed: str, text: str) -> object:
    try:
        return read_yaml(text)
    except InvalidValueError as error:
        raise InvalidValueError(f"{typed}: {error}") from None


def _decoded(typed: str, name: str, value: object, kind: type) -> object:
    """Return a value of an option's type."""
    wanted = known_keys(kind)[name]
    if item_type(wanted) is not None and not isinstance(value, list):
        value = [value]
    if isinstance(value, float) and value.is_integer() and wanted is int:
        value = int(value)
    try:
        return decode_some({name: value}, kind)[name]
    except InvalidValueError as error:
        raise InvalidValueError(f"{typed}: {error}") from None
