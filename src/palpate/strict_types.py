"""Introspection of the types that YAML is decoded into: their keys, kinds and choices."""

import dataclasses
import enum
import functools
import typing
from collections.abc import Sequence

import msgspec

from palpate.open_kinds import OpenKind
from palpate.strict_yaml import Key


def is_record(kind: object) -> bool:
    """Whether a type has named fields."""
    return isinstance(kind, type) and (issubclass(kind, msgspec.Struct) or dataclasses.is_dataclass(kind))


@functools.cache
def known_keys(kind: type) -> dict[str, typing.Any]:
    """Return the keys of a struct or dataclass in a file, and the types of their values."""
    if issubclass(kind, msgspec.Struct):
        return {field.encode_name: field.type for field in msgspec.structs.fields(kind)}
    hints = typing.get_type_hints(kind, include_extras=True)
    assert dataclasses.is_dataclass(kind)
    return {field.name: hints[field.name] for field in dataclasses.fields(kind) if field.init}


def tags(kinds: Sequence[typing.Any]) -> tuple[str | None, dict[str, typing.Any]]:
    """Return the key that discriminates a union of structs, and the struct for each of its values."""
    tag: str | None = None
    named: dict[str, typing.Any] = {}
    for option in kinds:
        config = getattr(option, "__struct_config__", None)
        if config is not None and config.tag is not None:
            tag = config.tag_field
            named[str(config.tag)] = option
    return tag, named


def records(kind: object) -> list[typing.Any]:
    """The types with named fields that a value may be: of a union, each of them."""
    if is_record(kind):
        return [kind]
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return records(arguments[0])
    return [] if origin in (tuple, list) else [record for option in arguments for record in records(option)]


def family_of(kind: object) -> type[OpenKind] | None:
    """The family of kinds of which a value may be one; None if it is of a type that is known."""
    if isinstance(kind, type):
        return kind if issubclass(kind, OpenKind) and not issubclass(kind, msgspec.Struct) else None
    if typing.get_origin(kind) in (tuple, list):
        return None
    return next((family_of(option) for option in typing.get_args(kind) if family_of(option)), None)


def item_type(kind: object) -> object:
    """The type of a list's items; None if it is no list. Of a union, the list in it."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if origin is typing.Annotated:
        return item_type(arguments[0])
    if origin in (tuple, list):
        return arguments[0] if arguments else None
    return next((item_type(option) for option in arguments if item_type(option) is not None), None)


def type_at(kind: object, path: Sequence[Key]) -> object:
    """The type where a path leads; None if unknown."""
    for step in path:
        if isinstance(step, int):
            kind = item_type(kind)
        else:
            kind = next((known_keys(record)[step] for record in records(kind) if step in known_keys(record)), None)
    return kind


def choices(kind: object, path: Sequence[Key]) -> tuple[typing.Any, ...]:
    """The words that a `Literal` or an enumeration allows, where a path leads."""
    kind = type_at(kind, path)
    if isinstance(kind, type) and issubclass(kind, enum.Enum):
        return tuple(member.value for member in kind)
    return typing.get_args(kind)
