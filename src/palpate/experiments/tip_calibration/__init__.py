"""Calibrate a fingertip by touching things."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.experiments.tip_calibration.config import TipCalibrationConfig

if TYPE_CHECKING:
    from palpate.experiments.tip_calibration.result import TipCalibrationResult
    from palpate.runtime import Observer

__all__ = ["TipCalibrationConfig", "calibrate_tip"]


def calibrate_tip(
    config: TipCalibrationConfig,
    out: str | Path | None = None,
    observers: "Sequence[Observer]" = (),
    *,
    progress: bool = False,
) -> "TipCalibrationResult":
    """Calibrate a fingertip, and return what was found.

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
    from palpate.experiments.tip_calibration.experiment import CalibrateTip  # what runs is imported only now

    found: TipCalibrationResult = perform(CalibrateTip(), config, out, observers, progress=progress)
    return found
