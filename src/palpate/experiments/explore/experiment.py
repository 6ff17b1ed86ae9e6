"""The experiment `explore`; imports nothing heavy before it is planned."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.metrics import METRICS

if TYPE_CHECKING:
    from palpate.experiments.explore.exploration import ExplorationResult
    from palpate.experiments.explore.plan import ExplorationPlan
    from palpate.experiments.kit.experiment import Writer
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot
    from palpate.runtime.log.standard.cloud import Cloud


class Explore:
    """Explores a surface by touch. An `Experiment`."""

    name = "explore"
    summary = "Explore the surface of a simulated object by touch, and draw it."
    Config = ExploreConfig
    metrics = METRICS

    def plan(
        self, config: ExploreConfig, robot: "Robot | None", attachments: Mapping[str, str]
    ) -> "ExplorationPlan":
        """See `Experiment`."""
        from palpate.experiments.explore.plan import plan

        assert robot is not None  # the configuration names one
        return plan(config, robot, attachments)

    def evaluate(self, plan: "ExplorationPlan", recorded: "Recorded") -> "ExplorationResult":
        """See `Experiment`."""
        from palpate.experiments.explore.exploration import found_by

        return found_by(plan, recorded)

    def report(self, result: "ExplorationResult") -> "Report":
        """See `Experiment`."""
        from palpate.experiments.explore.report import exploration_report

        return exploration_report(result)

    def files(self, result: "ExplorationResult") -> "Mapping[str, Writer]":
        """See `Experiment`."""
        from palpate.experiments.explore.files import exploration_files

        return exploration_files(result)

    def cloud(self, result: "ExplorationResult") -> "Cloud | None":
        """See `Experiment`: the map, as far as there is one."""
        from palpate.experiments.explore.map_cloud import map_cloud

        return None if result.map is None else map_cloud(result.map)
