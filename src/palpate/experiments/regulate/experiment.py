"""Regulation of a force, as an experiment."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from palpate.experiments.kit.experiment import Writer
from palpate.experiments.kit.experiment_defaults import ExperimentDefaults
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.figures import FIGURES

if TYPE_CHECKING:
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.experiments.regulate.plan import RegulationPlan
    from palpate.experiments.regulate.result import Regulation
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot


class Regulate(ExperimentDefaults):
    """See `palpate.experiments.kit.experiment.Experiment`."""

    name = "regulate"
    summary = "Hold a force on a surface."
    Config = RegulateConfig
    figures = FIGURES

    def plan(self, config: RegulateConfig, robot: "Robot | None", texts: Mapping[str, str]) -> "RegulationPlan":
        """Check and build everything."""
        from palpate.experiments.regulate.plan import plan_regulation

        assert robot is not None  # there always is one: RegulateConfig.robot is never None
        return plan_regulation(config, robot, texts)

    def found(self, plan: "RegulationPlan", recorded: "Recorded") -> "Regulation":
        """Return what came of a run."""
        from palpate.experiments.regulate.result import regulation_in

        return regulation_in(plan, recorded)

    def report(self, result: "Regulation") -> "Report":
        """Return the report."""
        from palpate.experiments.regulate.report import regulation_report

        return regulation_report(result)

    def files(self, result: "Regulation") -> Mapping[str, Writer]:
        """Return the file of the forces."""
        from palpate.experiments.regulate.plan import FORCES_FILE
        from palpate.experiments.regulate.result import write_forces

        return {FORCES_FILE: partial(write_forces, result)}
