"""Configuration of a run as YAML: the few values that users write, and every value, exactly, for a log."""

import os
import platform
from collections.abc import Mapping
from dataclasses import fields
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from palpate.errors import InvalidValueError, shown
from palpate.strict_decode import decode, decode_some, load, read_mapping
from palpate.yaml_text import yaml_text

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

EXPERIMENT_TEXT = "experiment.yaml"
"""Name of the configuration in every log."""

NAME_KEY = "experiment"
"""Key of the experiment's name or `module:Class`."""

_OTHER_FILES = {
    "palpate_robot": "this is a robot file: give it with --robot, or as `robot: FILE` in an experiment file",
    "palpate_sensor": "this is a sensor file: a robot file names it, as `sensor: FILE`",
}
"""Files that are mistaken for experiment files: the key that identifies them, and the remedy."""


def config_text(experiment: str, config: "DataclassInstance") -> str:
    """Return a configuration as YAML with every value; `read_config` restores it exactly.

    Args:
        experiment: Name of the experiment, or its `module:Class`.
        config: Configuration of the experiment.

    Raises:
        InvalidValueError: If a path cannot be written as text.
    """
    return yaml_text({NAME_KEY: experiment, **plain_values(config)})


def experiment_in(text: str) -> str:
    """Return the experiment that a text of `config_text` names.

    Raises:
        InvalidValueError: If the text names none.
    """
    found = read_mapping(text, "an experiment file").get(NAME_KEY)
    if not isinstance(found, str):
        raise InvalidValueError(f"{EXPERIMENT_TEXT}: no line `{NAME_KEY}: ...` that names an experiment")
    return found


def read_config(text: str, kind: type[Any]) -> Any:
    """Return the configuration in a text, written by `config_text` or by hand; missing values are defaults.

    Args:
        text: Text of the file.
        kind: Class `Config` of the experiment.

    Raises:
        InvalidValueError: If a key is misspelt, a value has the wrong type, or values contradict each other.
    """
    return decode(_without_name(read_mapping(text, "an experiment file")), kind, text)


def load_overlay(path: Path, experiment: str, kind: type[Any]) -> dict[str, object]:
    """Return the options in an experiment file; files that it names are searched beside it.

    Args:
        path: Path of the file.
        experiment: Experiment that the file must be for, if it names one.
        kind: Class `Config` of the experiment.

    Raises:
        InvalidValueError: If the file cannot be read, a key is misspelt, a value has the wrong type, or the file
            is for another experiment; the message names the file.
    """
    try:
        values = load(path, lambda text: _overlay(text, experiment, kind), "an experiment file")
    except OSError as error:
        raise InvalidValueError(f"config = {path}: cannot be read: {error.strerror}") from None
    for name, value in values.items():
        names_file = isinstance(value, Path) or (name == "robot" and isinstance(value, str))
        if name != "out" and names_file and os.path.isfile(path.parent / str(value)):
            values[name] = type(value)(path.parent / str(value))  # type: ignore[call-arg]  # a path or its text
    return values


def plain_values(config: "DataclassInstance") -> dict[str, object]:
    """Return every value of a configuration by its name, as YAML can hold it."""
    values = ((field.name, getattr(config, field.name)) for field in fields(config))
    return {name: str(value) if isinstance(value, Path) else value for name, value in values}


def _overlay(text: str, experiment: str, kind: type[Any]) -> dict[str, object]:
    found = read_mapping(text, "an experiment file")
    for other, advice in _OTHER_FILES.items():
        if other in found:
            raise InvalidValueError(f"{other}: {advice}")
    if found.get(NAME_KEY, experiment) != experiment:
        raise InvalidValueError(f"{NAME_KEY} = {shown(found[NAME_KEY])}: must be {experiment}")
    return decode_some(_without_name(found), kind, text)


def _without_name(found: Mapping[str, object]) -> dict[str, object]:
    return {key: value for key, value in found.items() if key != NAME_KEY}


VERSIONS_TEXT = "versions.yaml"
"""Attachment of a log with the versions of Python and `_PACKAGES`: with these a replay is bit for bit the same."""

_PACKAGES = ("palpate", "numpy", "scipy", "numba", "llvmlite", "mujoco", "casadi")
"""Packages whose arithmetic the numbers of a run depend on."""


@cache
def versions() -> dict[str, str]:
    """Return Python's and the packages' versions."""
    return {"python": platform.python_version(), **{name: _version(name) for name in _PACKAGES}}


def versions_text() -> str:
    """Return Python's, the machine's and the packages' versions as YAML."""
    python = {"python": platform.python_version()}
    return yaml_text(python | {"machine": platform.machine(), "system": platform.system()} | versions())


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed as a package"
