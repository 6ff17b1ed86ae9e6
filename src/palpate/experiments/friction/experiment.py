"""Measurement of a surface's friction by rubbing it, as an experiment."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.findings import FINDINGS
from palpate.experiments.friction.metrics import METRICS
from palpate.experiments.kit import ExperimentDefaults, Writer

if TYPE_CHECKING:  # commands import this module for --help, which must be quick
    from palpate.experiments.friction.plan import FrictionPlan
    from palpate.experiments.friction.result import FrictionResult
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot


class FindFriction(ExperimentDefaults):
    """Measurement of mu, e and their dependence on load and speed by strokes and twists of a fingertip."""

    name = "friction"
    summary = "Rub a surface: its friction, how it bears torque, with intervals."
    Config = FrictionConfig
    metrics = METRICS
    findings = FINDINGS
    warm_up = ({"quick": True},)

    def plan(
        self, config: FrictionConfig, robot: "Robot | None", attachments: Mapping[str, str]
    ) -> "FrictionPlan":
        """Check and build everything."""
        from palpate.experiments.friction.plan import plan

        assert robot is not None  # FrictionConfig.robot is never None
        return plan(config, robot, attachments)

    def evaluate(self, plan: "FrictionPlan", recorded: "Recorded") -> "FrictionResult":
        """Return the result of a run."""
        from palpate.experiments.friction.result import friction_result

        return friction_result(plan, recorded)

    def report(self, result: "FrictionResult") -> "Report":
        """Return the report."""
        from palpate.experiments.friction.report import friction_report

        return friction_report(self, result)

    def files(self, result: "FrictionResult") -> Mapping[str, Writer]:
        """Return the writer of friction.yaml; nothing if nothing was rubbed."""
        from palpate.experiments.friction.plan import FILE_NAME
        from palpate.friction.friction_file import friction_file_text

        file = result.file
        if file is None:
            return {}
        return {FILE_NAME: lambda path: path.write_text(friction_file_text(file), encoding="utf-8")}
