"""Regulation of a force, as an experiment."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from palpate.experiments.kit.experiment import ExperimentDefaults, Writer
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.findings import FINDINGS
from palpate.experiments.regulate.metrics import METRICS

if TYPE_CHECKING:
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.experiments.regulate.plan import RegulationPlan
    from palpate.experiments.regulate.result import RegulationResult
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot


class Regulate(ExperimentDefaults):
    """Regulation of the contact force on a surface: constant, in steps or as sines."""

    name = "regulate"
    summary = "Hold a force on a surface."
    Config = RegulateConfig
    metrics = METRICS
    findings = FINDINGS
    warm_up = ({"duration": 0.5},)

    def plan(
        self, config: RegulateConfig, robot: "Robot | None", attachments: Mapping[str, str]
    ) -> "RegulationPlan":
        """Check and build everything."""
        from palpate.experiments.regulate.plan import plan_regulation

        assert robot is not None  # RegulateConfig.robot is never None
        return plan_regulation(config, robot, attachments)

    def evaluate(self, plan: "RegulationPlan", recorded: "Recorded") -> "RegulationResult":
        """Return the result of a run."""
        from palpate.experiments.regulate.result import regulation_in

        return regulation_in(plan, recorded)

    def report(self, result: "RegulationResult") -> "Report":
        """Return the report."""
        from palpate.experiments.regulate.report import regulation_report

        return regulation_report(self, result)

    def files(self, result: "RegulationResult") -> Mapping[str, Writer]:
        """Return the writer of the forces over time."""
        from palpate.experiments.regulate.plan import FORCES_FILE
        from palpate.experiments.regulate.result import write_forces

        return {FORCES_FILE: partial(write_forces, result)}
