"""Explore a surface by touch."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.experiments.explore.config import ExploreConfig

if TYPE_CHECKING:
    from palpate.experiments.explore.exploration import ExplorationResult
    from palpate.runtime import Observer

__all__ = ["ExploreConfig", "explore"]


def explore(
    config: ExploreConfig,
    out: str | Path | None = None,
    observers: "Sequence[Observer]" = (),
    *,
    progress: bool = False,
) -> "ExplorationResult":
    """Explore an object by touch, and return map, shape and errors.

    Args:
        config: How.
        out: Folder for log, report and files; nothing is written if not given.
        observers: Called every period with sample, observation and command.
        progress: Whether a bar shows how far it has got, on a terminal or in a notebook.

    Raises:
        InvalidValueError: It cannot be carried out, or what was felt tells nothing.
        OSError: A file cannot be written.
    """
    from palpate.experiments.explore.experiment import Explore  # what runs and draws is imported only now
    from palpate.experiments.kit.script import perform

    found: ExplorationResult = perform(Explore(), config, out, observers, progress=progress)
    return found
