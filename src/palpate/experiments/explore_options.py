"""Where the values of an exploration come from: default < robot file < experiment file < command line."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated

import tyro

from palpate.experiments.explore_config import ExploreConfig


@dataclass(frozen=True, slots=True)
class ExploreOptions(ExploreConfig):
    """What people can type for an exploration: its values, and a file with more of them."""

    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.YAML")] = None
    """Experiment file: lines like `force: 3`, with the names of these options. What is typed here goes before what
    it says, and that before what the robot file says."""

    @property
    def settled(self) -> ExploreConfig:
        """The values alone, wherever they came from."""
        return ExploreConfig(**{field.name: getattr(self, field.name) for field in fields(ExploreConfig)})


def default_options(arguments: Sequence[str]) -> ExploreOptions:
    """Return what holds if nothing more is typed than the files that are named.

    It is not checked as a whole, for what is typed comes on top.

    Raises:
        InvalidValueError: A file cannot be read, or something in it is wrong.
    """
    values: dict[str, object] = {}
    config, robot = option("config", arguments), option("robot", arguments)
    overlay: dict[str, object] = {}
    if config is not None:
        from palpate.experiments.experiment_file import load_overlay

        overlay = load_overlay(Path(config), ExploreConfig)
        values["config"] = Path(config)
    robot = robot if robot is not None else overlay.get("robot")  # type: ignore[assignment]
    if isinstance(robot, str):
        # only now: it loads the compiled kernels, and the defaults are those of the default robot
        from palpate.experiments.robot_values import load_named_robot, values_of

        values |= values_of(load_named_robot(robot))
        overlay["robot"] = robot
    return unchecked({**values, **overlay})


def option(name: str, arguments: Sequence[str]) -> str | None:
    """Return what is typed for an option, without judging the rest."""
    found = None
    for i, word in enumerate(arguments):
        if word == f"--{name}" and i + 1 < len(arguments):
            found = arguments[i + 1]
        elif word.startswith(f"--{name}="):
            found = word.removeprefix(f"--{name}=")
    return found


def unchecked(values: Mapping[str, object]) -> ExploreOptions:
    """Return options with these values and defaults for the rest, before anybody has judged them together."""
    options = object.__new__(ExploreOptions)
    for field in fields(ExploreOptions):
        assert field.default is not MISSING  # every option has one
        object.__setattr__(options, field.name, values.get(field.name, field.default))
    return options
