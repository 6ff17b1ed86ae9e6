"""Hold an object so that it neither slips nor spins."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.experiments.grasp.config import GraspConfig

if TYPE_CHECKING:
    from palpate.experiments.grasp.result import GraspResult
    from palpate.runtime import Observer

__all__ = ["GraspConfig", "grasp_object"]


def grasp_object(
    config: GraspConfig,
    out: str | Path | None = None,
    observers: "Sequence[Observer]" = (),
    *,
    progress: bool = False,
) -> "GraspResult":
    """Hold an object, lift it, set it down, and return the result.

    Args:
        config: Options of the grasp.
        out: Folder for log, report and files; nothing is written if not given.
        observers: Functions of sample, observation and command, called every period.
        progress: Whether a bar shows the progress, on a terminal or in a notebook.

    Raises:
        InvalidValueError: If the grasp cannot be carried out.
        OSError: If a file cannot be written.
    """
    from palpate.experiments.grasp.experiment import GraspObject  # what runs and draws is imported only now
    from palpate.experiments.kit.script import perform

    found: GraspResult = perform(GraspObject(), config, out, observers, progress=progress)
    return found
