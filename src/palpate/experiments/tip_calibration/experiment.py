"""The experiment `calibrate tip`."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from palpate.experiments.kit.experiment import ExperimentDefaults, Writer
from palpate.experiments.tip_calibration.config import TipCalibrationConfig
from palpate.experiments.tip_calibration.findings import FINDINGS
from palpate.experiments.tip_calibration.metrics import METRICS

if TYPE_CHECKING:
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.experiments.tip_calibration.plan import TipPlan
    from palpate.experiments.tip_calibration.result import TipCalibrationResult
    from palpate.experiments.tip_calibration.still_plan import StillPlan
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot


class CalibrateTip(ExperimentDefaults):
    """Calibrates a fingertip by touches."""

    name = "calibrate.tip"
    summary = "Calibrate a fingertip by touching a plate, a rod and a ball."
    Config = TipCalibrationConfig
    metrics = METRICS
    findings = FINDINGS

    def plan(
        self, config: TipCalibrationConfig, robot: "Robot | None", attachments: Mapping[str, str]
    ) -> "TipPlan | StillPlan":
        """Check and build everything; nothing moves."""
        assert robot is not None  # `TipCalibrationConfig.robot` is never None
        if config.moves:
            from palpate.experiments.tip_calibration.plan import plan_touches

            return plan_touches(config, robot, attachments)
        from palpate.experiments.tip_calibration.still_plan import plan_still

        return plan_still(config, robot, attachments)

    def evaluate(self, plan: "TipPlan | StillPlan", recorded: "Recorded") -> "TipCalibrationResult":
        """Return the result of a run."""
        from palpate.experiments.tip_calibration.result import calibration_in

        return calibration_in(plan, recorded)

    def report(self, result: "TipCalibrationResult") -> "Report":
        """Return the report."""
        from palpate.experiments.tip_calibration.report import calibration_report

        return calibration_report(self, result)

    def files(self, result: "TipCalibrationResult") -> Mapping[str, Writer]:
        """Return touches made and to be made, the tip, and the robot file with it."""
        from palpate.experiments.tip_calibration.found_tip import calibration_files

        return calibration_files(result)
