"""Reading sensor files, and saying what is wrong with them."""

import difflib
import os
import typing
from pathlib import Path

import msgspec

from palpate.errors import InvalidValueError
from palpate.sensing.ft.filter_specs import FilterSpec
from palpate.sensing.ft.sensor_file import VERSION, SensorFile
from palpate.sensing.ft.strict_yaml import LONGEST, read_yaml

UNITS = ("N_Nm_per_raw_unit", "raw_unit", "Nm", "N", "kg", "m", "Hz", "s")
"""Endings of keys that say a unit, the longer before those that they end in."""

FILTER_KINDS = tuple(str(spec.__struct_config__.tag) for spec in typing.get_args(FilterSpec))
"""What `filters[].kind` may be."""


def load_sensor_file(path: str | os.PathLike[str]) -> SensorFile:
    """Return the sensor described by a file.

    Raises:
        OSError: The file cannot be read.
        InvalidValueError: It is no sensor file, or something in it is wrong; the message names file and key.
    """
    file = Path(path)
    try:
        with file.open("rb") as opened:
            raw = opened.read(4 * LONGEST + 1)
        return read_sensor(raw.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise InvalidValueError(
            f"{file}: not text (byte {error.start} is no UTF-8): a sensor file is YAML text"
        ) from None
    except InvalidValueError as error:
        raise InvalidValueError(f"{file}: {error}") from None


def read_sensor(text: str) -> SensorFile:
    """Return the sensor described by the text of a sensor file.

    Raises:
        InvalidValueError: As in `load_sensor_file`.
    """
    found = read_yaml(text)
    if not isinstance(found, dict) or "palpate_sensor" not in found:
        raise InvalidValueError(f"no sensor file: it must be a mapping with the line `palpate_sensor: {VERSION}`")
    version = found["palpate_sensor"]
    if type(version) is not int or version != VERSION:
        raise InvalidValueError(f"palpate_sensor = {version!r}: this palpate reads version {VERSION}")
    _refuse_unknown_keys(found, SensorFile, "")
    try:
        return msgspec.convert(found, SensorFile, strict=True)
    except msgspec.ValidationError as error:
        raise InvalidValueError(_told(str(error))) from None


def _told(message: str) -> str:
    """Put msgspec's place (`- at `$.payload.mass_kg``) in front, and drop its symbols."""
    text, found, place = message.partition(" - at `$")
    where = place.rstrip("`").lstrip(".")
    advice = ""
    if text.startswith("Expected `str`"):
        advice = "; put it in quotes"
    elif text.startswith("Invalid value") and where.endswith(".kind"):
        advice = f"; filters are {', '.join(FILTER_KINDS)}"
    return f"{where}: {text}{advice}" if found and where else text + advice


def _refuse_unknown_keys(found: object, kind: object, path: str) -> None:
    """Raise for the first key that `kind` does not know, wherever it stands.

    Only keys are judged here; values of the wrong type are left to msgspec.
    """
    if isinstance(found, list):
        item = _item_type(kind)
        for i, value in enumerate(found):
            _refuse_unknown_keys(value, item, f"{path}[{i}]")
    if not isinstance(found, dict):
        return
    struct = _struct_for(found, kind)
    if struct is None:
        return
    known = {field.encode_name: field.type for field in msgspec.structs.fields(struct)}
    tag = struct.__struct_config__.tag_field
    for key, value in found.items():
        if key != tag and key not in known:
            raise InvalidValueError(f"{_below(path, key)}: {_advice(key, [*known, *([tag] if tag else [])])}")
        _refuse_unknown_keys(value, known.get(key), _below(path, key))


def _below(path: str, key: str) -> str:
    shown = key[:80] if key.isprintable() else ascii(key[:80])
    return f"{path}.{shown}" if path else shown


def _struct_for(found: dict[str, object], kind: object) -> type[msgspec.Struct] | None:
    """Return the struct that a mapping is meant to be; of several, the one that it names by its tag."""
    for option in (kind, *typing.get_args(kind)):
        if isinstance(option, type) and issubclass(option, msgspec.Struct):
            config = option.__struct_config__
            if config.tag is None or found.get(config.tag_field or "") == config.tag:
                return option
    return None


def _item_type(kind: object) -> object:
    if typing.get_origin(kind) is typing.Annotated:
        kind = typing.get_args(kind)[0]
    arguments = typing.get_args(kind)
    return arguments[0] if arguments else None


def _advice(key: str, known: list[str]) -> str:
    stem = _without_unit(key)
    for other in known:
        if _without_unit(other) == stem and other != key:
            return (
                f"unknown key; the unit stands in the key: write {other}, in {other[len(stem) + 1 :] or 'no unit'}"
            )
    near = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    return f"unknown key; did you mean {near[0]}?" if near else f"unknown key; known are {', '.join(known)}"


def _without_unit(key: str) -> str:
    for unit in UNITS:
        if key.endswith(f"_{unit}"):
            return key[: -len(unit) - 1]
    stem, _, last = key.rpartition("_")
    # Endings that no key of ours has but people write.
    return (
        stem
        if last in {"mN", "kN", "mNm", "Nmm", "g", "mm", "cm", "ms", "kHz", "lb", "lbf", "lbin", "us"}
        else key
    )
