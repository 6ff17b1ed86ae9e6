"""Measurement of friction by rubbing a surface."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.experiments.friction.config import FrictionConfig

if TYPE_CHECKING:
    from palpate.experiments.friction.result import FrictionResult
    from palpate.runtime import Observer

__all__ = ["FrictionConfig", "measure_friction"]


def measure_friction(
    config: FrictionConfig,
    out: str | Path | None = None,
    observers: "Sequence[Observer]" = (),
    *,
    progress: bool = False,
) -> "FrictionResult":
    """Rub a surface, and return its friction and limit surface.

    Args:
        config: Configuration of the run.
        out: Folder for log, report and files; nothing is written if not given.
        observers: Observers that are called every period with sample, observation and command.
        progress: Whether a progress bar is shown, on a terminal or in a notebook.

    Raises:
        InvalidValueError: If the run cannot be carried out or evaluated.
        OSError: If a file cannot be written.
    """
    from palpate.experiments.friction.experiment import FindFriction  # imported here: heavy
    from palpate.experiments.kit.script import perform

    found: FrictionResult = perform(FindFriction(), config, out, observers, progress=progress)
    return found
