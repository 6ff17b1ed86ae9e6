"""Where the values of an exploration come from: default < robot file < experiment file < command line."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.typed_options import option, settled, unchecked


@dataclass(frozen=True, slots=True)
class ExploreOptions(ExploreConfig):
    """What people can type for an exploration: its values, and a file with more of them."""

    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.YAML")] = None
    """Experiment file: lines like `force: 3`, with the names of these options. What is typed here goes before what
    it says, and that before what the robot file says."""

    @property
    def settled(self) -> ExploreConfig:
        """The values alone, wherever they came from."""
        return settled(ExploreConfig, self)


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
        from palpate.experiments.robot.values import load_named_robot, values_of

        values |= values_of(load_named_robot(robot))
        overlay["robot"] = robot
    return unchecked(ExploreOptions, {**values, **overlay})
