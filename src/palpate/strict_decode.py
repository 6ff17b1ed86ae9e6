"""From YAML text to frozen types, strictly: what is misspelt, in another unit or impossible is refused.

Every refusal says where (`fingers[0].surface.radius_mm`, line and column), what is wrong, and what would be right.
Types are `msgspec.Struct`s, whose keys carry units (`mass_kg`), or dataclasses, whose keys carry none.
"""

import dataclasses
import functools
import os
import re
import typing
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import msgspec

from palpate.errors import InvalidValueError
from palpate.nearest_name import advice_on_key, nearest
from palpate.strict_yaml import LONGEST, Key, place_of, read_yaml

LONGEST_SHOWN = 60
"""Characters of a wrong value that a message repeats."""

T = typing.TypeVar("T")


def load_text(path: str | os.PathLike[str], what: str) -> str:
    """Return the text of a file that people write.

    Args:
        path: The file.
        what: It should be, for messages ("a sensor file").

    Raises:
        OSError: The file cannot be read.
        InvalidValueError: It is not text, or far too long.
    """
    file = Path(path)
    with file.open("rb") as opened:
        raw = opened.read(4 * LONGEST + 1)
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InvalidValueError(
            f"{file}: not text (byte {error.start} is no UTF-8): {what} is YAML text"
        ) from None


def read_mapping(text: str, what: str) -> dict[str, object]:
    """Return the keys and values of a YAML document; an empty one has none.

    Raises:
        InvalidValueError: No YAML as `read_yaml` takes it, or no mapping.
    """
    found = read_yaml(text)
    if found is None:
        return {}
    if not isinstance(found, dict):
        raise InvalidValueError(f"{what} is a list of `key: value` lines, not {_shown(found)}")
    return found


def decode_file(text: str, kind: type[T], what: str, version_key: str, version: int) -> T:
    """Return what the text of a file with a version says.

    Args:
        text: YAML.
        kind: Struct or dataclass that it describes.
        what: It should be, without article ("sensor file").
        version_key: Key that tells this kind of file from others, and
        version: its value.

    Raises:
        InvalidValueError: Something is wrong; the message says where, and what would be right.
    """
    found = read_yaml(text)
    if not isinstance(found, dict) or version_key not in found:
        near = nearest(version_key, list(found)) if isinstance(found, dict) else None
        hint = f"; is {near!r} misspelt?" if near else ""
        raise InvalidValueError(f"no {what}: it must be a mapping with the line `{version_key}: {version}`{hint}")
    given = found[version_key]
    if type(given) is not int or given != version:
        where = place_of(text, [version_key])
        raise InvalidValueError(f"{version_key} = {_shown(given)}: this palpate reads version {version}{where}")
    return decode(found, kind, text)


def decode(found: object, kind: type[T], text: str = "") -> T:
    """Return a value of a type from what YAML said.

    Args:
        found: As `read_yaml` returns it.
        kind: Struct or dataclass.
        text: That `found` was read from, for lines and columns in messages.

    Raises:
        InvalidValueError: As in `decode_file`.
    """
    try:
        refuse_unknown(found, kind, ())
        try:
            return msgspec.convert(found, kind, strict=True, dec_hook=_decode_path)
        except msgspec.ValidationError as error:
            raise _refusal(*_parted(str(error)), found, kind) from None
    except Refusal as refusal:
        raise InvalidValueError(refusal.told(text)) from None


def decode_some(found: Mapping[str, object], kind: type, text: str = "") -> dict[str, object]:
    """Return the fields of a dataclass that a mapping gives, each of the right type.

    What the values are together is not judged here: others may still come on top.

    Raises:
        InvalidValueError: A key is no field, or its value of another type.
    """
    try:
        refuse_unknown(found, kind, ())
        types = known_keys(kind)
        values: dict[str, object] = {}
        for key, value in found.items():
            try:
                values[key] = msgspec.convert(value, types[key], strict=True, dec_hook=_decode_path)
            except msgspec.ValidationError as error:
                message, path = _parted(str(error))
                raise _refusal(message, (key, *path), found, kind) from None
        return values
    except Refusal as refusal:
        raise InvalidValueError(refusal.told(text)) from None


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
    shown = ""
    for step in path:
        if isinstance(step, int):
            shown += f"[{step}]"
        else:
            name = step[:LONGEST_SHOWN] if step.isprintable() else ascii(step[:LONGEST_SHOWN])
            shown += f".{name}" if shown else name
    return shown


def refuse_unknown(found: object, kind: object, path: tuple[Key, ...]) -> None:
    """Raise for the first key or `kind:` that a type does not know, wherever it stands.

    Only these are judged here; values of the wrong type are left to msgspec.

    Raises:
        Refusal: There is one.
    """
    if isinstance(found, list):
        for i, value in enumerate(found):
            refuse_unknown(value, _item_type(kind), (*path, i))
    if not isinstance(found, dict):
        return
    options = [option for option in _options(kind) if is_record(option)]
    if not options:
        return
    tag, tags = _tags(options)
    record = options[0]
    if tag is not None:
        record = tags[_checked_tag(found, tag, list(tags), path)]
    known = known_keys(record)
    for key, value in found.items():
        if key == tag:
            continue
        if key not in known:
            names = [*known, *([tag] if tag else [])]
            raise Refusal((*path, key), ": " + advice_on_key(key, names))
        refuse_unknown(value, known[key], (*path, key))


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


def _checked_tag(found: dict[str, object], tag: str, tags: list[str], path: tuple[Key, ...]) -> str:
    given = found.get(tag)
    if isinstance(given, str) and given in tags:
        return given
    if tag not in found:
        near = nearest(tag, [key for key in found if isinstance(found[key], str)])
        hint = f"; is {near} misspelt?" if near else ""
        raise Refusal((*path, tag), f": missing; write {tag}: and one of {', '.join(tags)}{hint}")
    raise Refusal((*path, tag), _not_among(given, tags))


def _not_among(given: object, known: Sequence[str]) -> str:
    near = nearest(given, known) if isinstance(given, str) else None
    meant = f"did you mean {near}? " if near else ""
    return f" = {_shown(given)}: {meant}known: {', '.join(known)}"


def _tags(options: list[typing.Any]) -> tuple[str | None, dict[str, typing.Any]]:
    """The key that tells several structs apart, and what it says for each."""
    tag: str | None = None
    tags: dict[str, typing.Any] = {}
    for option in options:
        config = getattr(option, "__struct_config__", None)
        if config is not None and config.tag is not None:
            tag = config.tag_field
            tags[str(config.tag)] = option
    return tag, tags


def _options(kind: object) -> list[typing.Any]:
    """The types that a value may be: of a union, each."""
    if typing.get_origin(kind) is typing.Annotated:
        return _options(typing.get_args(kind)[0])
    arguments = [option for option in typing.get_args(kind) if is_record(option)]
    return arguments if arguments and not is_record(kind) and not _item_type(kind) else [kind]


def _item_type(kind: object) -> object:
    if typing.get_origin(kind) is typing.Annotated:
        kind = typing.get_args(kind)[0]
    arguments = typing.get_args(kind)
    return arguments[0] if arguments and typing.get_origin(kind) in (tuple, list) else None


_PLACE = re.compile(r" - at `\$([^`]*)`$")
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+)\]")
_MISSING = re.compile(r"Object missing required field `(.*)`")
_NAME_IN_FRONT = re.compile(r"([A-Za-z_]\w*)(?= |,|\[|:)")


def _parted(message: str) -> tuple[str, tuple[Key, ...]]:
    """What msgspec says, and where (it writes "... - at `$.payload.mass_kg`")."""
    found = _PLACE.search(message)
    if found is None:
        return message, ()
    steps = (int(index) if index else name for name, index in _STEP.findall(found[1]))
    return message[: found.start()], tuple(steps)


def _refusal(message: str, path: tuple[Key, ...], found: object, kind: object) -> Refusal:
    """Make what msgspec says, or a type's own check, into a refusal with its full path."""
    value = _at(found, path)
    missing = _MISSING.fullmatch(message)
    if missing:
        return Refusal((*path, missing[1]), f": missing; give a line `{missing[1]}: ...`")
    if message.startswith("Invalid enum value"):
        return Refusal(path, _not_among(value, [str(choice) for choice in _choices(kind, path)]))
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


def _choices(kind: object, path: Sequence[Key]) -> tuple[typing.Any, ...]:
    """The words that a `Literal` allows, where a path leads."""
    for step in path:
        if isinstance(step, int):
            kind = _item_type(kind)
        else:
            kind = next((known_keys(option).get(step) for option in _options(kind) if is_record(option)), None)
    return typing.get_args(kind)


def _given(message: str, value: object) -> str:
    return f" ({_shown(value)})" if isinstance(value, str) and "got `str`" in message else ""


def _advice(message: str, value: object) -> str:
    if message.startswith("Expected `str`"):
        return "; put it in quotes"
    if isinstance(value, str) and re.match(r"\s*[-+]?\.?\d", value):
        return "; write a plain number in SI units, with a decimal point and nothing behind it"
    if "got `null`" in message:
        return "; write a value, or leave the key out if it has a default"
    return ""


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= LONGEST_SHOWN else f"{text[:LONGEST_SHOWN]}..."


def _decode_path(kind: type, value: object) -> object:
    if kind is Path and isinstance(value, str) and value and "\0" not in value:
        return Path(value)
    raise InvalidValueError(f"Expected a path, got {_shown(value)}")


Reader = Callable[[str], T]


def load(path: str | os.PathLike[str], read: Reader[T], what: str) -> T:
    """Return what a file says.

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
