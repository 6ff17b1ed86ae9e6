"""Metrics of a tip calibration, the most important first; imports nothing heavy."""

from typing import TYPE_CHECKING

from palpate.experiments.kit.metric import Metric

if TYPE_CHECKING:
    from palpate.experiments.tip_calibration.result import TipCalibrationResult


def _fitted(result: "TipCalibrationResult") -> bool:
    return result.fit is not None


def _judged(result: "TipCalibrationResult") -> bool:
    return result.errors is not None


METRICS = (
    Metric("usable", "tip is usable", "", lambda result: result.usable, applies=_fitted),
    Metric(
        "size_error_m",
        "error of the worst length",
        "m",
        lambda result: result.errors.size,
        "mm",
        applies=_judged,
        needs_truth=True,
    ),
    Metric(
        "center_error_m",
        "error of the centre",
        "m",
        lambda result: result.errors.center,
        "mm",
        applies=_judged,
        needs_truth=True,
    ),
    Metric(
        "turn_error_rad",
        "error of the orientation",
        "rad",
        lambda result: result.errors.turn,
        "degrees",
        applies=lambda result: _judged(result) and result.errors.turn is not None,
        needs_truth=True,
    ),
    Metric(
        "stiffness_error",
        "error of the stiffness",
        "",
        lambda result: result.errors.stiffness,
        "%",
        applies=_judged,
        needs_truth=True,
    ),
    Metric(
        "center_sd_m", "SD of the centre, worst axis", "m", lambda result: result.largest_sd, "mm", applies=_fitted
    ),
    Metric(
        "scatter_m",
        "scatter of the arm's places",
        "m",
        lambda result: result.fit.scatter,
        "mm",
        note="with errors that no model covers",
        applies=_fitted,
    ),
    Metric(
        "rows", "touches evaluated, each force one", "", lambda result: len(result.fit.touches), applies=_fitted
    ),
    Metric(
        "broken",
        "assumptions that do not hold",
        "",
        lambda result: len(result.fit.verdict.broken),
        applies=_fitted,
    ),
    Metric(
        "touches_planned",
        "touches planned",
        "",
        lambda result: len(result.next_touches),
        applies=lambda result: not _fitted(result),
    ),
    Metric(
        "simulated_s", "duration of the planned touches", "s", lambda result: result.run.duration, applies=_fitted
    ),
)
