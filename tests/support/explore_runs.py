"""Explorations for tests: planned, carried out and found as the command does, without its files."""

import functools
from dataclasses import replace
from typing import Any

import numpy as np

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.exploration import ExplorationResult, evaluate
from palpate.experiments.explore.plan import ExplorationPlan, plan
from palpate.experiments.explore.reachable_surface import ReachableSurface
from palpate.experiments.kit.recorded_periods import ContactTruth
from palpate.experiments.kit.recorded_run import carry_out
from palpate.robots.values import load_named_robot
from palpate.runtime import Command, Ending
from palpate.runtime.truth import TruthTable
from support.run_bounds import check_bounds


def plan_of(config, robot=None) -> ExplorationPlan:
    return plan(config, robot or load_named_robot(config.robot), {})


def planned_again(planned) -> ExplorationPlan:
    """As from the log of a run."""
    return plan(planned.config, planned.robot, planned.attachments())


def carried_out(planned) -> ExplorationResult:
    return evaluate(planned, carry_out(planned))


def check_held(found, bounds) -> None:
    """Check that a run finished at rest, never left the surface, landed softly, and kept its bounds."""
    check_bounds(found, bounds, run__ending=Ending.DONE, run__at_rest=True)
    assert found.truth.touching[found.scanning].all()
    assert np.nanmax(found.true_normal_force[~found.scanning]) < found.config.force + 1.5


def felt_while_lowered(planned, periods=80):
    """Return every sample of a back end whose tip goes down."""
    backend = planned.backend()
    return [backend.start(), *(backend.step(Command((0.001, 0.0, -0.02))) for _ in range(periods))]


def section(report, heading) -> Any:
    """The section of a report; None if there is none."""
    return next((each for each in report.sections if each.heading == heading), None)


def pictures(report, heading):
    """What is drawn in a section, by title."""
    parts = section(report, heading).parts
    drawn = [each for part in parts if hasattr(part, "drawn") for each in part.drawn(heading)]
    return {each.title: each for each in drawn}


@functools.cache
def small() -> ExplorationResult:
    """Three seconds on a ball, with everything that a report can show."""
    config = ExploreConfig(
        object="sphere", size=(0.012,), speed=0.04, width=0.008, depth=0.006, force_noise=0.01, moment_noise=1e-5
    )
    return carried_out(plan_of(config))


def unfelt(found) -> ExplorationResult:
    """The same with nothing felt."""
    nothing = found.cloud.select(np.zeros(len(found.cloud), bool))
    return replace(found, cloud=nothing, point_error=np.zeros(0), map=None)


def untrue(found) -> ExplorationResult:
    """The same with nothing known of the truth, as on a robot."""
    count, mapped = len(found.record), found.map
    return replace(
        found,
        truth=ContactTruth.of(TruthTable((), np.zeros((count, 0))), count),
        point_error=np.full(len(found.cloud), np.nan),
        map=replace(mapped, truth_known=False, error=np.full(len(mapped.error), np.nan),
                    reachable=ReachableSurface.unknown(), found=np.zeros(0, bool)),
    )  # fmt: skip
