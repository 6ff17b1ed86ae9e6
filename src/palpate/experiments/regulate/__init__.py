"""Hold a force on a surface."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.experiments.regulate.config import RegulateConfig

if TYPE_CHECKING:
    from palpate.experiments.regulate.result import RegulationResult
    from palpate.runtime import Observer

__all__ = ["RegulateConfig", "regulate"]


def regulate(
    config: RegulateConfig,
    out: str | Path | None = None,
    observers: "Sequence[Observer]" = (),
    *,
    progress: bool = False,
) -> "RegulationResult":
    """Hold a force on a surface, and return the result.

    Args:
        config: Configuration of the run.
        out: Folder for log, report and files; nothing is written if not given.
        observers: Observers that are called every period with sample, observation and command.
        progress: Whether a progress bar is shown, on a terminal or in a notebook.

    Raises:
        InvalidValueError: If the run cannot be carried out or evaluated.
        OSError: If a file cannot be written.
    """
    from palpate.experiments.kit.script import perform
    from palpate.experiments.regulate.experiment import Regulate  # imported here: heavy

    found: RegulationResult = perform(Regulate(), config, out, observers, progress=progress)
    return found
