"""Calibration of a fingertip by touches, as an experiment."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

from palpate.experiments.kit.experiment import ExperimentDefaults, Writer
from palpate.experiments.kit.metric import Metric, MetricValue
from palpate.experiments.tip_calibration.config import TipCalibrationConfig

if TYPE_CHECKING:
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.experiments.tip_calibration.plan import TipPlan
    from palpate.experiments.tip_calibration.result import TipCalibrationResult
    from palpate.experiments.tip_calibration.still_plan import StillPlan
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot


MICRO = 1e6


def _true(column: str, meaning: str, unit: str, value: Callable[[Any, Any], MetricValue]) -> Metric:
    """An error against the simulated tip; None if nobody knows it."""
    return Metric(
        column, meaning, unit, lambda found: None if found.judged is None else value(found.judged, found.fit)
    )


def _found(column: str, meaning: str, unit: str, value: Callable[[Any], MetricValue]) -> Metric:
    """A metric of what was found; None if nothing was touched."""
    return Metric(column, meaning, unit, lambda found: None if found.fit is None else value(found.fit))


METRICS = (
    Metric("usable", "whether the tip is to be used", "", lambda found: found.usable),
    _true("size_error_m", "error of the worst length", "m", lambda true, fit: true.size_error(fit)),
    _true("center_error_m", "error of the centre", "m", lambda true, fit: true.center_error(fit)),
    _true("turn_error_rad", "error of the orientation", "rad", lambda true, fit: true.turn_error(fit)),
    _true("stiffness_error", "error of the stiffness, a share", "", lambda true, fit: true.stiffness_error(fit)),
    Metric("center_sd_m", "SD of the centre, worst axis", "m", lambda found: found.largest_sd),
    _found("scatter_m", "scatter of the arm's places", "m", lambda fit: fit.scatter),
    _found("rows", "touches evaluated, each force one", "", lambda fit: len(fit.touches)),
    _found("broken", "assumptions that do not hold", "", lambda fit: len(fit.verdict.broken)),
    Metric("simulated_s", "duration of the planned touches", "s", lambda found: found.run.duration),
)
"""Those that matter most first."""


class CalibrateTip(ExperimentDefaults):
    """See `palpate.experiments.kit.experiment.Experiment`."""

    name = "calibrate.tip"
    summary = "Calibrate a fingertip by touching a plate, a rod and a ball."
    Config = TipCalibrationConfig
    metrics = METRICS

    def plan(
        self, config: TipCalibrationConfig, robot: "Robot | None", attachments: Mapping[str, str]
    ) -> "TipPlan | StillPlan":
        """Check and build everything."""
        assert robot is not None  # there always is one: TipCalibrationConfig.robot is never None
        if config.moves:
            from palpate.experiments.tip_calibration.plan import plan_touches

            return plan_touches(config, robot, attachments)
        from palpate.experiments.tip_calibration.still_plan import plan_still

        return plan_still(config, robot, attachments)

    def evaluate(self, plan: "TipPlan | StillPlan", recorded: "Recorded") -> "TipCalibrationResult":
        """Return what came of a run."""
        from palpate.experiments.tip_calibration.result import calibration_in

        return calibration_in(plan, recorded)

    def report(self, result: "TipCalibrationResult") -> "Report":
        """Return the report."""
        from palpate.experiments.tip_calibration.report import calibration_report

        return calibration_report(result)

    def files(self, result: "TipCalibrationResult") -> Mapping[str, Writer]:
        """Return touches made and to be made, the tip, and the robot file with it."""
        from palpate.experiments.tip_calibration.files import calibration_files

        return calibration_files(result)
