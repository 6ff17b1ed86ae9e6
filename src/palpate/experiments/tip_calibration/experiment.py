"""Calibration of a fingertip by touches, as an experiment."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from palpate.experiments.kit.experiment import Writer
from palpate.experiments.kit.experiment_defaults import ExperimentDefaults
from palpate.experiments.tip_calibration.config import TipConfig
from palpate.experiments.tip_calibration.figures import FIGURES

if TYPE_CHECKING:
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.experiments.tip_calibration.plan import TipPlan
    from palpate.experiments.tip_calibration.result import TipCalibration
    from palpate.experiments.tip_calibration.still_plan import StillPlan
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot


class CalibrateTip(ExperimentDefaults):
    """See `palpate.experiments.kit.experiment.Experiment`."""

    name = "calibrate.tip"
    summary = "Calibrate a fingertip by touching a plate, a rod and a ball."
    Config = TipConfig
    figures = FIGURES

    def plan(self, config: TipConfig, robot: "Robot | None", texts: Mapping[str, str]) -> "TipPlan | StillPlan":
        """Check and build everything."""
        assert robot is not None  # there always is one: TipConfig.robot is never None
        if config.moves:
            from palpate.experiments.tip_calibration.plan import plan_touches

            return plan_touches(config, robot, texts)
        from palpate.experiments.tip_calibration.still_plan import plan_still

        return plan_still(config, robot, texts)

    def found(self, plan: "TipPlan | StillPlan", recorded: "Recorded") -> "TipCalibration":
        """Return what came of a run."""
        from palpate.experiments.tip_calibration.result import calibration_in

        return calibration_in(plan, recorded)

    def report(self, result: "TipCalibration") -> "Report":
        """Return the report."""
        from palpate.experiments.tip_calibration.report import calibration_report

        return calibration_report(result)

    def files(self, result: "TipCalibration") -> Mapping[str, Writer]:
        """Return touches made and to be made, the tip, and the robot file with it."""
        from palpate.experiments.tip_calibration.files import calibration_files

        return calibration_files(result)
