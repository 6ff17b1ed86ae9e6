"""A strict subset of YAML: what looks like a number is one, and every other word is a string.

PyYAML follows YAML 1.1, in which `1e-3` is a string, `12:30` is 750, `010` is 8 and `no` is false, and in which a
repeated key silently wins. Here plain words are null, true, false, decimal numbers, or strings (the core schema
of YAML 1.2 without octal and hexadecimal), and repeated keys, aliases and tags are refused.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import yaml

from palpate.bounded_file import Bounds
from palpate.errors import InvalidValueError

BOUNDS = Bounds(size=1 << 18)
"""A calibration has some thousand characters; more is no file of ours."""

MOST_EVENTS = 50_000
"""Keys, values, beginnings and ends of a document: a robot with its calibrations has below 1000."""

DEEPEST = 16
"""Levels of nesting. Ours has four."""

LARGEST_INTEGER = 2**63 - 1
"""Whole numbers beyond it are read as floats."""

_MOST_DIGITS = 20
"""Of a word that may be an integer of that size, with its sign; `int` of thousands of digits is slow."""

Key = str | int
"""A key of a mapping, or the index of an item of a list."""

_NUMBER = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_WORDS: dict[str, object] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), float("inf")),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -float("inf")),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), float("nan")),
}
_PLAIN_TAGS = {f"tag:yaml.org,2002:{name}" for name in ("str", "seq", "map")}


def read_yaml(text: str) -> object:
    """Return the contents of a YAML document as dict, list, str, int, float, bool and None.

    Raises:
        InvalidValueError: No YAML, several documents, repeated keys, aliases, tags, keys that are no text, too
            long or too deep; the message names the place.
    """
    BOUNDS.check("YAML", text)
    try:
        _refuse_beyond(text)
        root = _composed(text)
    except UnicodeEncodeError:
        raise InvalidValueError("no valid YAML: half a character; remove it") from None
    except yaml.MarkedYAMLError as error:
        raise InvalidValueError(f"no valid YAML: {error.problem}{_place(error.problem_mark)}") from None
    except yaml.YAMLError as error:
        raise InvalidValueError(f"no valid YAML: {' '.join(str(error).split())}") from None
    return None if root is None else _value(root, set(), 0)


def place_of(text: str, path: Sequence[Key]) -> str:
    """Return where something stands in a document that `read_yaml` has read, as " (line 3, column 5)".

    Args:
        text: The document.
        path: Keys and indices that lead to it; as far as they exist.
    """
    node, mark = _composed(text), None
    for step in path:
        found = _child(node, step)
        if found is None:
            break
        node, mark = found
    return _place(mark)


@dataclass(frozen=True, slots=True)
class ValueSpan:
    """Where a value stands in a document.

    Attributes:
        begin: Of its first letter.
        end: Behind its last one; a comment behind it does not belong to it.
        column: Of its key, or of the item that it is.
        flow: Whether what holds it is written in brackets.
    """

    begin: int
    end: int
    column: int
    flow: bool


def span_of(text: str, path: Sequence[Key]) -> ValueSpan | None:
    """Return where a value stands in a document that `read_yaml` has read; None if there is none.

    Args:
        text: The document.
        path: Keys and indices that lead to it, one at least.
    """
    node = _composed(text)
    for step in path[:-1]:
        found = _child(node, step)
        if found is None:
            return None
        node = found[0]
    found = _child(node, path[-1])
    if node is None or found is None:
        return None
    value, mark = found
    return ValueSpan(value.start_mark.index, _end(value), mark.column, bool(getattr(node, "flow_style", False)))


def _end(node: yaml.Node) -> int:
    """Behind the last letter of a value: PyYAML has what is in no brackets end where the next one begins."""
    if isinstance(node, yaml.CollectionNode) and not node.flow_style and node.value:
        last = node.value[-1]
        return _end(last[1] if isinstance(last, tuple) else last)
    end: int = node.end_mark.index
    return end


def _child(node: yaml.Node | None, step: Key) -> tuple[yaml.Node, yaml.Mark] | None:
    if isinstance(node, yaml.MappingNode):
        for key, value in node.value:
            if key.value == step:
                return value, key.start_mark
    if isinstance(node, yaml.SequenceNode) and isinstance(step, int) and 0 <= step < len(node.value):
        item = node.value[step]
        return item, item.start_mark
    return None


_Loader: Any = getattr(yaml, "CBaseLoader", yaml.BaseLoader)
"""The base loader resolves nothing: every word comes as text, and explicit tags show. The one in C takes 0.2 s for
the longest document, that in Python 7 s."""


def _composed(text: str) -> yaml.Node | None:
    found: yaml.Node | None = yaml.compose(text, Loader=_Loader)
    return found


def _refuse_beyond(text: str) -> None:
    """Read a document without keeping it: composing it takes stack for each level."""
    depth = 0
    for count, event in enumerate(yaml.parse(text, Loader=_Loader)):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST + 1:
            raise _too_deep(event.start_mark)
        if count > MOST_EVENTS:
            raise InvalidValueError(
                f"more than {MOST_EVENTS // 2} values{_place(event.start_mark)}: is it the right file?"
            )


def _too_deep(mark: Any) -> InvalidValueError:
    return InvalidValueError(f"nested too deep{_place(mark)}: at most {DEEPEST} levels; write it flatter")


def _value(node: yaml.Node, seen: set[int], depth: int) -> object:
    if id(node) in seen:
        raise InvalidValueError(f"an alias (*name) of the value{_place(node.start_mark)}: write it out")
    seen.add(id(node))
    if depth > DEEPEST:
        raise _too_deep(node.start_mark)
    if node.tag not in _PLAIN_TAGS:
        raise InvalidValueError(f"a tag ({node.tag}){_place(node.start_mark)}: write the value without it")
    if isinstance(node, yaml.MappingNode):
        return _mapping(node, seen, depth)
    if isinstance(node, yaml.SequenceNode):
        return [_value(item, seen, depth + 1) for item in node.value]
    if not isinstance(node, yaml.ScalarNode):
        raise InvalidValueError(f"neither text, list nor mapping{_place(node.start_mark)}")
    text = _text(node)
    return text if node.style else _scalar(text)


def _mapping(node: yaml.MappingNode, seen: set[int], depth: int) -> dict[str, object]:
    result: dict[str, object] = {}
    for key_node, value_node in node.value:
        place = _place(key_node.start_mark)
        if not isinstance(key_node, yaml.ScalarNode):
            raise InvalidValueError(f"a key that is no word{place}")
        key = _text(key_node)
        if key in result:
            raise InvalidValueError(f"the key {key!r} appears a second time{place}: keep one")
        result[key] = _value(value_node, seen, depth + 1)
    return result


def _text(node: yaml.ScalarNode) -> str:
    text = str(node.value)
    # An escape like "\ud83d" makes half a character, which can be neither written nor shown.
    if any("\ud800" <= letter <= "\udfff" for letter in text):
        raise InvalidValueError(f"half a character{_place(node.start_mark)}: remove the escape")
    return text


def _scalar(word: str) -> object:
    if word in _WORDS:
        return _WORDS[word]
    if not _NUMBER.fullmatch(word):
        return word
    if word.lstrip("+-").isdigit() and len(word) <= _MOST_DIGITS and abs(int(word)) <= LARGEST_INTEGER:
        return int(word)
    return float(word)


def _place(mark: Any) -> str:
    return "" if mark is None else f" (line {mark.line + 1}, column {mark.column + 1})"
