"""From YAML text to frozen types, strictly: what is misspelt, in another unit or impossible is refused.

Every error names the place (`fingers[0].surface.radius_mm`, line and column), what is wrong, and what is expected.
Types are `msgspec.Struct`s, whose keys carry units (`mass_kg`), or dataclasses, whose keys carry none.
"""

import os
import typing
from collections.abc import Callable, Mapping
from pathlib import Path

import msgspec

from palpate.bounded_file import read_text
from palpate.errors import InvalidValueError, shown
from palpate.nearest_name import advice_on_key, nearest
from palpate.open_kinds import OpenKind, declared_in, kind_named
from palpate.strict_refusal import DecodeRefusal, not_among, parted, refusal, shown_path
from palpate.strict_types import family_of, item_type, known_keys, records, tags
from palpate.strict_yaml import BOUNDS, Key, place_of, read_yaml

T = typing.TypeVar("T")


def load_text(path: str | os.PathLike[str], what: str) -> str:
    """Return the text of a file that people write.

    Args:
        path: The file.
        what: It should be, for messages ("a sensor file").

    Raises:
        OSError: The file cannot be read.
        InvalidValueError: It is no regular file, not text, or far too long.
    """
    return read_text(path, BOUNDS, f"{what} is YAML text")


def load(path: str | os.PathLike[str], read: Callable[[str], T], what: str) -> T:
    """Return the decoded contents of a file.

    Args:
        path: The file.
        read: From its text.
        what: It should be, for messages ("a sensor file").

    Raises:
        OSError: The file cannot be read.
        InvalidValueError: As `read` raises it, with the file's name in front.
    """
    text = load_text(path, what)
    try:
        return read(text)
    except InvalidValueError as error:
        raise InvalidValueError(f"{path}: {error}") from None


def read_mapping(text: str, what: str) -> dict[str, object]:
    """Return the keys and values of a YAML document; an empty one has none.

    Raises:
        InvalidValueError: No YAML as `read_yaml` takes it, or no mapping.
    """
    found = read_yaml(text)
    if found is None:
        return {}
    if not isinstance(found, dict):
        raise InvalidValueError(f"{what} is a list of `key: value` lines, not {shown(found)}")
    return found


def decode_file(text: str, kind: type[T], what: str, version_key: str, version: int) -> T:
    """Return the decoded contents of a file that states a version.

    Args:
        text: YAML.
        kind: Struct or dataclass that it describes.
        what: It should be, without article ("sensor file").
        version_key: Key that tells this kind of file from others, and
        version: its value.

    Raises:
        InvalidValueError: Something is wrong; the message names the place and what is expected.
    """
    found = read_yaml(text)
    if not isinstance(found, dict) or version_key not in found:
        near = nearest(version_key, list(found)) if isinstance(found, dict) else None
        hint = f"; is {near!r} misspelt?" if near else ""
        raise InvalidValueError(f"no {what}: it must be a mapping with the line `{version_key}: {version}`{hint}")
    given = found[version_key]
    if type(given) is not int or given != version:
        where = place_of(text, [version_key])
        raise InvalidValueError(f"{version_key} = {shown(given)}: this palpate reads version {version}{where}")
    return decode(found, kind, text)


def decode(found: object, kind: type[T], text: str = "") -> T:
    """Return a value of a type from decoded YAML.

    Args:
        found: As `read_yaml` returns it.
        kind: Struct or dataclass.
        text: That `found` was read from, for lines and columns in messages.

    Raises:
        InvalidValueError: As in `decode_file`.
    """
    try:
        return typing.cast("T", _converted(found, kind, ()))
    except DecodeRefusal as found_wrong:
        raise InvalidValueError(found_wrong.located(text)) from None


def decode_some(found: Mapping[str, object], kind: type, text: str = "") -> dict[str, object]:
    """Return the fields of a dataclass that a mapping gives, each of the right type.

    Their combination is not checked: other values may still be merged.

    Raises:
        InvalidValueError: A key is no field, or its value of another type.
    """
    try:
        types = known_keys(kind)
        values: dict[str, object] = {}
        for key, value in _with_kinds(dict(found), kind, ()).items():
            try:
                values[key] = msgspec.convert(value, types[key], strict=True, dec_hook=_custom)
            except msgspec.ValidationError as error:
                message, path = parted(str(error))
                raise refusal(message, (key, *path), found, kind) from None
        return values
    except DecodeRefusal as found_wrong:
        raise InvalidValueError(found_wrong.located(text)) from None


def _converted(found: object, kind: object, path: tuple[Key, ...]) -> object:
    """Return a value of a type from decoded YAML.

    Raises:
        DecodeRefusal: Something is wrong.
    """
    return _made(_with_kinds(found, kind, path), found, kind, path)


def _made(resolved: object, found: object, kind: object, path: tuple[Key, ...]) -> object:
    """Return a value of a type from decoded YAML in which open kinds are resolved; `found` is as it was before."""
    try:
        return msgspec.convert(resolved, typing.cast("type", kind), strict=True, dec_hook=_custom)
    except msgspec.ValidationError as error:
        wrong = refusal(*parted(str(error)), found, kind)
        raise DecodeRefusal((*path, *wrong.path), wrong.message) from None


def _with_kinds(found: typing.Any, kind: object, path: tuple[Key, ...]) -> typing.Any:
    """Return decoded YAML in which settings of open kinds are instances of their classes.

    Other values of a wrong type are left to msgspec.

    Raises:
        DecodeRefusal: A key or `kind:` is unknown, wherever it stands, or settings are wrong.
    """
    if isinstance(found, list):
        return [_with_kinds(value, item_type(kind), (*path, i)) for i, value in enumerate(found)]
    if not isinstance(found, dict):
        return found
    family, kinds = family_of(kind), records(kind)
    tag: str | None
    if family is not None:
        tag, record = "kind", _kind_in(found, family, path)
    elif kinds:
        tag, named = tags(kinds)
        record = kinds[0] if tag is None else named[_checked_tag(found, tag, list(named), path)]
    else:
        return found
    known = known_keys(record)
    resolved = {}
    for key, value in found.items():
        if key != tag and key not in known:
            names = [*known, *([tag] if tag else [])]
            raise DecodeRefusal((*path, key), ": " + advice_on_key(key, names))
        resolved[key] = value if key == tag else _with_kinds(value, known[key], (*path, key))
    if family is None:
        return resolved
    del resolved["kind"]
    return _made(resolved, found, record, path)


def _kind_in(found: dict[str, object], family: type[OpenKind], path: tuple[Key, ...]) -> type:
    """Return the class that `kind:` names, of a family that other packages may add to."""
    given = found.get("kind")
    if not isinstance(given, str):
        given = _checked_tag(found, "kind", [*declared_in(family.GROUP), "module:Class"], path)
    try:
        return kind_named(family, given)
    except InvalidValueError as error:
        raise DecodeRefusal((*path, "kind"), str(error).removeprefix("kind")) from error


def _checked_tag(found: dict[str, object], tag: str, known: list[str], path: tuple[Key, ...]) -> str:
    given = found.get(tag)
    if isinstance(given, str) and given in known:
        return given
    if tag not in found:
        near = nearest(tag, [key for key in found if isinstance(found[key], str)])
        hint = f"; is {shown_path((near,))} misspelt?" if near else ""
        raise DecodeRefusal((*path, tag), f": missing; write {tag}: and one of {', '.join(known)}{hint}")
    raise DecodeRefusal((*path, tag), not_among(given, known))


def _custom(kind: type, value: object) -> object:
    """Return what msgspec itself cannot make: a path; an instance of an open kind is one already."""
    if kind is Path and isinstance(value, str) and value and "\0" not in value:
        return Path(value)
    if isinstance(value, kind):
        return value
    expected = "path" if kind is Path else "object"
    raise InvalidValueError(f"Expected `{expected}`, got `str`")  # msgspec's own wording; it adds the place
