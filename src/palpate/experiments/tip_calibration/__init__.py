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
    """Calibrate a fingertip and return the result.

    Args:
        config: Options of the calibration.
        out: Folder for log, report and files; nothing is written if not given.
        observers: Functions of sample, observation and command, called every period.
        progress: Whether a bar shows the progress, on a terminal or in a notebook.

    Raises:
        InvalidValueError: If the calibration cannot be carried out, or its touches determine nothing.
        OSError: If a file cannot be written.
    """
    from palpate.experiments.kit.script import perform
    from palpate.experiments.tip_calibration.experiment import CalibrateTip  # what runs is imported only now

    found: TipCalibrationResult = perform(CalibrateTip(), config, out, observers, progress=progress)
    return found
