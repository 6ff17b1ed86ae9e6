"""The experiment `explore`; imports nothing heavy before it is planned."""

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.findings import FINDINGS
from palpate.experiments.explore.metrics import METRICS
from palpate.experiments.kit.experiment import ExperimentDefaults

if TYPE_CHECKING:
    from palpate.experiments.explore.exploration import ExplorationResult
    from palpate.experiments.explore.plan import ExplorationPlan
    from palpate.experiments.kit.experiment import Writer
    from palpate.experiments.kit.recorded_run import Recorded
    from palpate.reporting.report import Report
    from palpate.robots.robot import Robot
    from palpate.runtime.log.standard.cloud import Cloud

FILE_NAMES = ("contacts.ply", "contacts.csv", "marks.csv", "map.ply", "map.stl", "height_map.csv")
"""Files of an exploration with enough contacts for a map."""

_SMALL = {"width": 0.006, "depth": 0.002, "speed": 0.05}
"""Options of a small exploration."""


class Explore(ExperimentDefaults):
    """Explores a surface by touch. An `Experiment`."""

    name = "explore"
    summary = "Explore the surface of a simulated object by touch, and draw it."
    Config = ExploreConfig
    metrics = METRICS
    findings = FINDINGS
    warm_up = (_SMALL, {**_SMALL, "robot": "ur5e-nano17"}, {**_SMALL, "object": "torus"})

    def plan(
        self, config: ExploreConfig, robot: "Robot | None", attachments: Mapping[str, str]
    ) -> "ExplorationPlan":
        """See `Experiment`."""
        from palpate.experiments.explore.plan import plan

        assert robot is not None  # the configuration names one
        return plan(config, robot, attachments)

    def evaluate(self, plan: "ExplorationPlan", recorded: "Recorded") -> "ExplorationResult":
        """See `Experiment`."""
        from palpate.experiments.explore.exploration import evaluate

        return evaluate(plan, recorded)

    def report(self, result: "ExplorationResult") -> "Report":
        """See `Experiment`."""
        from palpate.experiments.explore.report import exploration_report

        return exploration_report(self, result)

    def files(self, result: "ExplorationResult") -> "Mapping[str, Writer]":
        """See `Experiment`."""
        from palpate.experiments.explore.exploration import write_marks_csv
        from palpate.mapping import write_cloud_csv, write_cloud_ply, write_height_map_csv, write_mesh
        from palpate.mapping.layers import write_layered_mesh

        files: dict[str, Writer] = {
            "contacts.ply": partial(write_cloud_ply, result.cloud),
            "contacts.csv": partial(write_cloud_csv, result.cloud),
            "marks.csv": partial(write_marks_csv, result.marks),
        }
        if result.map is not None and len(result.map.mesh.triangles):
            files["map.ply"] = partial(write_layered_mesh, result.map.mesh, result.map.layers)
            files["map.stl"] = partial(write_mesh, result.map.mesh)
        if result.height_map is not None:
            files["height_map.csv"] = partial(write_height_map_csv, result.height_map)
        return files

    def cloud(self, result: "ExplorationResult") -> "Cloud | None":
        """See `Experiment`: the vertices of the map."""
        return None if result.map is None else result.map.cloud
