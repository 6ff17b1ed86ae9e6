"""Explorations for tests: planned, carried out and found as the command does, without its files."""

from palpate.experiments.explore.exploration import Exploration, found_by
from palpate.experiments.explore.plan import ExplorationPlan, plan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.robots.values import load_named_robot


def plan_of(config, robot=None) -> ExplorationPlan:
    return plan(config, robot or load_named_robot(config.robot), {})


def planned_again(planned) -> ExplorationPlan:
    """As from the log of a run."""
    return plan(planned.config, planned.robot, planned.texts())


def carried_out(planned) -> Exploration:
    return found_by(planned, carry_out(planned))


def section(report, heading):
    """The section of a report; None if there is none."""
    return next((each for each in report.sections if each.heading == heading), None)


def pictures(report, heading):
    """What is drawn in a section, by title."""
    parts = section(report, heading).parts
    drawn = [each for part in parts if hasattr(part, "draw") for each in part.draw() if each is not None]
    return {each.title: each for each in drawn}
