"""Rub a surface: friction and how it bears torque."""

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
    """Rub a surface, and return its friction, and how it bears torque.

    Args:
        config: How.
        out: Folder for log, report and files; nothing is written if not given.
        observers: Called every period with sample, observation and command.
        progress: Whether a bar shows how far it has got, on a terminal or in a notebook.

    Raises:
        InvalidValueError: It cannot be carried out, or what was felt tells nothing.
        OSError: A file cannot be written.
    """
    from palpate.experiments.friction.experiment import FindFriction  # what runs and draws is imported only now
    from palpate.experiments.kit.script import perform

    found: FrictionResult = perform(FindFriction(), config, out, observers, progress=progress)
    return found
