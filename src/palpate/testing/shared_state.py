"""What two instances share, and one of them changes."""

import enum
from collections import deque
from collections.abc import Iterator
from types import BuiltinFunctionType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np

MOST_OBJECTS = 5000
"""Looked at per instance: controllers have hundreds."""

_OPAQUE = (
    *(str, bytes, int, float, complex, bool, type(None), type, enum.Enum),
    *(ModuleType, FunctionType, MethodType, BuiltinFunctionType),
)
_MUTABLE = (list, dict, set, bytearray, deque, np.ndarray)


def mutable_parts(instance: object) -> dict[str, object]:
    """Return containers that can be changed, reachable from an instance or its class, by where they are."""
    parts: dict[str, object] = {}
    seen: set[int] = set()
    left: deque[tuple[str, object]] = deque([("", instance)])
    while left and len(seen) < MOST_OBJECTS:
        path, value = left.popleft()
        if id(value) in seen or isinstance(value, _OPAQUE):
            continue
        seen.add(id(value))
        if isinstance(value, _MUTABLE):
            parts[path] = value
        left.extend((f"{path}{step}", inner) for step, inner in _inside(value))
    return parts


def _inside(value: Any) -> Iterator[tuple[str, object]]:
    """Yield what a value holds: items of containers, attributes of all else, of its own class's, too."""
    if isinstance(value, np.ndarray):
        return
    if isinstance(value, dict):
        yield from ((f"[{key!r}]", inner) for key, inner in list(value.items()))
    elif isinstance(value, list | tuple | set | frozenset | deque):
        yield from ((f"[{i}]", inner) for i, inner in enumerate(list(value)))
    else:
        for kind in type(value).__mro__:
            for name in getattr(kind, "__slots__", ()):
                if hasattr(value, name):
                    yield f".{name}", getattr(value, name)
            if not kind.__module__.startswith(("builtins", "typing", "enum")):
                own = ((name, inner) for name, inner in vars(kind).items() if isinstance(inner, _MUTABLE))
                yield from ((f".{name}", inner) for name, inner in own if not name.startswith("__"))
        yield from ((f".{name}", inner) for name, inner in list(getattr(value, "__dict__", {}).items()))


def fingerprint(part: object) -> str:
    """Return what shows whether a container has changed."""
    return part.tobytes().hex() if isinstance(part, np.ndarray) else repr(part)
