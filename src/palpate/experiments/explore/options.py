"""Where the values of an exploration come from: default < robot file < experiment file < command line.

What a robot file says of fingertip, noise and period, the plan takes from there where nothing else is said.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from palpate.commands.typed_options import from_file, settled
from palpate.experiments.explore.config import ExploreConfig


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
    """Return what holds if nothing more is typed than the file that is named."""
    return from_file(ExploreOptions, ExploreConfig, arguments)
