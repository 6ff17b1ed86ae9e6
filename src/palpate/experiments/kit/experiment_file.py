"""Experiments as YAML: the few values that people write, and every value, exactly, for a log."""

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.regulate.config import RegulateConfig
from palpate.strict_decode import decode, decode_some, load, read_mapping
from palpate.yaml_text import yaml_text

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

EXPERIMENT_TEXT = "experiment.yaml"
"""Under this name a log keeps the text of its configuration."""

KIND_KEY = "experiment"
"""Which experiment a file is for."""

OTHER_FILES = {
    "palpate_robot": "this is a robot file: give it with --robot, or as `robot: FILE` in an experiment file",
    "palpate_sensor": "this is a sensor file: a robot file names it, as `sensor: FILE`",
}
"""Files that people take for experiment files, by the key that tells them."""

KINDS: Mapping[str, type[ExploreConfig]] = {"explore": ExploreConfig}
"""Every experiment whose log keeps its configuration as `EXPERIMENT_TEXT`."""

NAMED: Mapping[str, type] = {
    **KINDS,
    "regulate": RegulateConfig,
    "friction": FrictionConfig,
    "grasp": GraspConfig,
}
"""Every experiment that a file which people write can be for."""

NEIGHBOURS = ("file", "motion_file", "library", "friction_file")
"""Fields that name files, which are looked for next to the one that names them."""


def config_text(config: ExploreConfig) -> str:
    """Return a configuration as YAML, every value written out; `read_config` gives back the very same.

    Raises:
        InvalidValueError: A path in it cannot be written as text.
    """
    kind = next((name for name, kind in KINDS.items() if type(config) is kind), None)
    if kind is None:
        raise TypeError(f"{type(config).__name__} is no configuration of an experiment")
    return yaml_text({KIND_KEY: kind, **plain_values(config)})


def read_config(text: str) -> ExploreConfig:
    """Return the configuration that `config_text` wrote, or that somebody wrote by hand: the rest is default.

    Raises:
        InvalidValueError: A key is misspelt, a value of the wrong type, or they cannot be together.
    """
    found = read_mapping(text, "an experiment file")
    if KIND_KEY not in found:
        raise InvalidValueError(f"no line `{KIND_KEY}: ...`: write one of {', '.join(KINDS)}")
    kind = KINDS[_checked_kind(found, tuple(KINDS))]
    return decode(_without_kind(found), kind, text)


def read_overlay(text: str, kind: type) -> dict[str, object]:
    """Return the fields of an experiment's configuration that a text gives.

    Raises:
        InvalidValueError: A key is misspelt, a value of the wrong type, or it is for another experiment.
    """
    found = read_mapping(text, "an experiment file")
    for other, advice in OTHER_FILES.items():
        if other in found:
            raise InvalidValueError(f"{other}: {advice}")
    if KIND_KEY in found:
        _checked_kind(found, tuple(name for name, known in NAMED.items() if known is kind))
    return decode_some(_without_kind(found), kind, text)


def load_overlay(path: Path, kind: type) -> dict[str, object]:
    """Return the fields that an experiment file gives; files that it names are looked for next to it.

    Raises:
        InvalidValueError: The file cannot be read, or as in `read_overlay`; the message names the file.
    """
    try:
        values = load(path, lambda text: read_overlay(text, kind), "an experiment file")
    except OSError as error:
        raise InvalidValueError(f"config = {path}: cannot be read: {error.strerror}") from None
    robot = values.get("robot")
    if isinstance(robot, str) and (path.parent / robot).is_file():
        values["robot"] = str(path.parent / robot)
    for name in NEIGHBOURS:
        file = values.get(name)
        if isinstance(file, Path) and (path.parent / file).is_file():
            values[name] = path.parent / file
    return values


def _checked_kind(found: Mapping[str, object], wanted: tuple[str, ...]) -> str:
    given = found[KIND_KEY]
    if given not in wanted:
        raise InvalidValueError(f"{KIND_KEY} = {given!r}: must be {' or '.join(wanted)}")
    return str(given)


def _without_kind(found: Mapping[str, object]) -> dict[str, object]:
    return {key: value for key, value in found.items() if key != KIND_KEY}


def plain_values(config: "DataclassInstance") -> dict[str, object]:
    """Return every value of a configuration by its name, as YAML can hold it."""
    return {field.name: _plain(getattr(config, field.name)) for field in fields(config)}


def _plain(value: object) -> object:
    return str(value) if isinstance(value, Path) else value
