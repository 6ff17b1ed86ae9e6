"""Where the values of finding friction come from: default < robot file < experiment file < command line.

What a robot file says of fingertip, noise and period, the plan takes from there where nothing else is said.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from palpate.commands.typed_options import from_file, settled
from palpate.experiments.friction.config import FrictionConfig


@dataclass(frozen=True, slots=True)
class FrictionOptions(FrictionConfig):
    """What people can type to find out about friction: its values, and a file with more of them."""

    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.YAML")] = None
    """Experiment file: lines like `speed: 0.02`, with the names of these options. What is typed here goes before
    what it says, and that before what the robot file says."""

    @property
    def settled(self) -> FrictionConfig:
        """The values alone, wherever they came from."""
        return settled(FrictionConfig, self)


def default_options(arguments: Sequence[str]) -> FrictionOptions:
    """Return what holds if nothing more is typed than the file that is named."""
    return from_file(FrictionOptions, FrictionConfig, arguments)
