"""What is sent to another process must pickle: packing, and finding out what it is that does not."""

import dataclasses
import functools
import types
from collections.abc import Iterator
from typing import Any

from joblib.externals.loky.backend.reduction import dumps

from palpate.errors import InvalidValueError, shown

DEEPEST = 12
"""Levels that are searched for what does not pickle: more than people nest, less than a recursion error."""


def packed(name: str, value: object) -> bytes:
    """Return a value as bytes for `pickle.loads`; what is defined in a script or notebook goes along.

    Args:
        name: What the caller calls it, for the message.
        value: What to pack.

    Raises:
        InvalidValueError: It does not pickle; the message names the part of it that does not.
    """
    try:
        return bytes(dumps(value))
    except Exception as error:
        part, culprit = _culprit(name, value)
        raise InvalidValueError(
            f"{part} = {shown(culprit)}: a {type(culprit).__name__} does not pickle, and so cannot go to or come "
            f"from another process ({type(error).__name__}: {error}); leave it out, and send what it is made from"
        ) from None


def _culprit(name: str, value: object) -> tuple[str, object]:
    """Return the innermost part that does not pickle, and its name."""
    for _ in range(DEEPEST):
        for part, inner in _parts(value):
            if not _pickles(inner):
                name, value = name + part, inner
                break
        else:
            break
    return name, value


def _pickles(value: object) -> bool:
    try:
        dumps(value)
    except Exception:
        return False
    return True


def _parts(value: Any) -> Iterator[tuple[str, object]]:
    """What a value is made of, each with what is to be appended to its name."""
    if isinstance(value, dict):
        yield from ((f"[{shown(key, 30)}]", inner) for key, inner in value.items())
    elif isinstance(value, list | tuple):
        yield from ((f"[{index}]", inner) for index, inner in enumerate(value))
    elif isinstance(value, functools.partial):
        yield from ((".func", value.func), (".args", value.args), (".keywords", value.keywords))
    elif isinstance(value, types.MethodType):
        yield ".__self__", value.__self__
    elif isinstance(value, types.FunctionType):
        free, cells = value.__code__.co_freevars, value.__closure__ or ()
        yield from (
            (f", {name}", cell.cell_contents) for name, cell in zip(free, cells, strict=True) if _full(cell)
        )
        used = (name for name in value.__code__.co_names if name in value.__globals__)
        yield from ((f", {name}", value.__globals__[name]) for name in used)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        yield from ((f".{field.name}", getattr(value, field.name, None)) for field in dataclasses.fields(value))
    else:
        yield from ((f".{name}", inner) for name, inner in getattr(value, "__dict__", {}).items())


def _full(cell: types.CellType) -> bool:
    """Whether a captured variable has a value yet."""
    try:
        return cell.cell_contents is not cell
    except ValueError:
        return False
