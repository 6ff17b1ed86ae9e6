"""Regulations of force, planned and carried out."""

from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.experiment import Regulate
from palpate.robots.values import load_named_robot

REGULATE = Regulate()


def planned(texts=None, **fields):
    """The plan of a regulation, with what its log has kept."""
    config = RegulateConfig(**fields)
    return REGULATE.plan(config, load_named_robot(config.robot), texts or {})


def carried_out(plan):
    """What came of a plan."""
    return REGULATE.found(plan, carry_out(plan))


def regulated(**fields):
    """What came of a regulation; it presses first if it is to."""
    return carried_out(planned(**fields).prepared())
