"""Where the values of a grasp come from: default < experiment file < command line."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from palpate.commands.typed_options import from_file, settled
from palpate.experiments.grasp.config import GraspConfig


@dataclass(frozen=True, slots=True)
class GraspOptions(GraspConfig):
    """What people can type for a grasp: its values, and a file with more of them."""

    config: Annotated[Path | None, tyro.conf.arg(metavar="FILE.YAML")] = None
    """Experiment file: lines like `pull: 3`, with the names of these options. What is typed here goes before what
    it says."""

    @property
    def settled(self) -> GraspConfig:
        """The values alone, wherever they came from."""
        return settled(GraspConfig, self)


def default_options(arguments: Sequence[str]) -> GraspOptions:
    """Return what holds if nothing more is typed than the file that is named."""
    return from_file(GraspOptions, GraspConfig, arguments)
