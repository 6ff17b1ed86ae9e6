"""The experiment `grasp`."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.findings import FINDINGS
from palpate.experiments.grasp.metrics import METRICS
from palpate.experiments.kit.experiment import ExperimentDefaults

if TYPE_CHECKING:
    from palpate.experiments.grasp.plan import GraspPlan
    from palpate.experiments.grasp.result import GraspResult
    from palpate.experiments.kit.experiment import Writer
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot


class GraspObject(ExperimentDefaults):
    """Holds an object with two or three fingers."""

    name = "grasp"
    summary = "Hold an object that is pulled at so that it neither slips nor spins, and show what grip it took."
    Config = GraspConfig
    metrics = METRICS
    findings = FINDINGS
    warm_up = ({"rise": 0.1, "lift_height": 0.01},)

    def plan(self, config: GraspConfig, robot: "Robot | None", attachments: Mapping[str, str]) -> "GraspPlan":
        """Check and build everything; nothing moves."""
        from palpate.experiments.grasp.plan import plan

        return plan(config, robot, attachments)

    def evaluate(self, plan: "GraspPlan", recorded: "Recorded") -> "GraspResult":
        """Return the result of a run."""
        from palpate.experiments.grasp.result import grasp_of

        return grasp_of(plan, recorded)

    def report(self, result: "GraspResult") -> "Report":
        """Return the report."""
        from palpate.experiments.grasp.report import grasp_report

        return grasp_report(self, result)

    def files(self, result: "GraspResult") -> "Mapping[str, Writer]":
        """Return grip, slip and spin over time as a table."""
        from palpate.experiments.grasp.result import write_table

        return {"grasp.csv": lambda path: write_table(result, path)}
