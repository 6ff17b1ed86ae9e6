"""What a file names by `kind`: a built-in word, a word of an installed package, or somebody's class.

One rule for all: a kind is a class that an entry point declares, palpate's own included, or `module:Class`.
"""

from functools import cache
from importlib.metadata import EntryPoint, entry_points
from typing import Any, ClassVar

import msgspec

from palpate.errors import InvalidValueError, shown
from palpate.named_object import named_object, raised
from palpate.nearest_name import nearest


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What stands beside `kind` in a file, by key; each field says its key, with the unit (`name="radius_m"`).

    A wrong value is refused by `__post_init__`, as InvalidValueError with the key in front.
    """


class OpenKind:
    """Base of a family of kinds; a kind inherits from it and from `Settings`.

    Attributes:
        GROUP: Of entry points that declare kinds of this family: name = "module:Class".
        METHODS: What each kind implements; a base in between may name others.
    """

    __slots__ = ()

    GROUP: ClassVar[str]
    METHODS: ClassVar[tuple[str, ...]] = ()


@cache
def declared_in(group: str) -> dict[str, EntryPoint]:
    """Return what installed packages declare in a group of entry points, by name, palpate's own first."""
    found = {each.name: each for each in entry_points(group=group)}
    return dict(sorted(found.items(), key=lambda item: (item[1].module.partition(".")[0] != "palpate", item[0])))


def kind_named(family: type[OpenKind], name: str, option: str = "kind") -> type[Settings]:
    """Return the class of a kind.

    Args:
        family: Whose kind it is.
        name: A declared word, `module:Class`, or `file.py:Class`; the present folder is looked in first.

        option: That was typed, for messages.

    Raises:
        InvalidValueError: There is none, or it is no kind of this family; the message starts with `option`.
    """
    known = declared_in(family.GROUP)
    declared = known.get(name)
    if declared is not None:
        try:
            found = declared.load()
        except Exception as error:
            raise InvalidValueError(f"{option} = {name}: {raised(f'loading {declared.value}', error)}") from error
    elif ":" in name:
        found = named_object(option, name, "mine:Mine or mine.py:Mine for the class Mine in mine.py")
    else:
        near = nearest(name, list(known))
        meant = f"did you mean {near}? " if near else ""
        raise InvalidValueError(
            f"{option} = {shown(name)}: {meant}known: {', '.join(known)}; one of your own is named as module:Class"
        )
    if not (isinstance(found, type) and issubclass(found, family) and issubclass(found, Settings)):
        raise InvalidValueError(
            f"{option} = {name}: must be a class that inherits from {family.__module__}.{family.__name__} and "
            f"{Settings.__module__}.{Settings.__name__}"
        )
    for base in found.__mro__:
        missing = [each for each in vars(base).get("METHODS", ()) if getattr(found, each) is vars(base).get(each)]
        if missing:
            lacks = f"{found.__name__} lacks {', '.join(missing)}"
            raise InvalidValueError(f"{option} = {name}: {lacks}; see {base.__module__}.{base.__name__}")
    return found


def name_of_kind(value: object) -> str:
    """Return what names the kind of a value in a file: its declared word, or `module:Class`."""
    kind = type(value)
    family = next((base for base in kind.__mro__ if issubclass(base, OpenKind) and "GROUP" in vars(base)), None)
    whole = f"{kind.__module__}:{kind.__qualname__}"
    declared = {} if family is None else declared_in(family.GROUP)
    return next((name for name, each in declared.items() if each.value == whole), whole)


def as_written(value: object) -> Any:
    """Return settings as plain values, keyed as in a file; keys that say nothing are left out."""
    if isinstance(value, tuple):
        return [as_written(item) for item in value]
    if not isinstance(value, msgspec.Struct):
        return msgspec.to_builtins(value)
    config = value.__struct_config__
    kind: dict[str, object] = {config.tag_field: config.tag} if config.tag_field else {}
    if isinstance(value, OpenKind):
        kind = {"kind": name_of_kind(value)}
    fields = ((field.encode_name, getattr(value, field.name)) for field in msgspec.structs.fields(value))
    return kind | {key: as_written(item) for key, item in fields if item is not None}
