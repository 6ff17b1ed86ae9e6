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
    """Hold an object, lift it, and set it down; return how it was held.

    Args:
        config: How.
        out: Folder for log, report and files; nothing is written if not given.
        observers: Called every period with sample, observation and command.
        progress: Whether a bar shows how far it has got, on a terminal or in a notebook.

    Raises:
        InvalidValueError: It cannot be carried out.
        OSError: A file cannot be written.
    """
    from palpate.experiments.grasp.experiment import GraspObject  # what runs and draws is imported only now
    from palpate.experiments.kit.script import perform

    found: GraspResult = perform(GraspObject(), config, out, observers, progress=progress)
    return found
