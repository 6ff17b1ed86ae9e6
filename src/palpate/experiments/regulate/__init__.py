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
    """Hold a force on a surface, and return how it was held.

    Args:
        config: How.
        out: Folder for log, report and files; nothing is written if not given.
        observers: Called every period with sample, observation and command.
        progress: Whether a bar shows how far it has got, on a terminal or in a notebook.

    Raises:
        InvalidValueError: It cannot be carried out, or what was felt tells nothing.
        OSError: A file cannot be written.
    """
    from palpate.experiments.kit.script import perform
    from palpate.experiments.regulate.experiment import Regulate  # what runs and draws is imported only now

    found: RegulationResult = perform(Regulate(), config, out, observers, progress=progress)
    return found
