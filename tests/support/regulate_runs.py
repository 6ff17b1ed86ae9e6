"""Regulations of force, planned and carried out."""

from dataclasses import replace

from palpate.experiments.kit.config_file import EXPERIMENT_TEXT, config_text
from palpate.experiments.kit.recorded_run import carry_out
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.experiment import Regulate
from palpate.robots.values import load_named_robot
from palpate.runtime.log import LogWriter

REGULATE = Regulate()


def planned(**fields):
    """The plan of a regulation."""
    config = RegulateConfig(**fields)
    return REGULATE.plan(config, load_named_robot(config.robot), {})


def touching(plan, target):
    """A plan with another object."""
    return replace(plan, setup=replace(plan.setup, task=replace(plan.setup.task, target=target)))


def carried_out(plan):
    """What came of a plan."""
    return REGULATE.evaluate(plan, carry_out(plan))


def regulated(**fields):
    """What came of a regulation; it presses first if it is to."""
    return carried_out(planned(**fields).prepared())


def logged(plan, path):
    """What came of a plan that was recorded at a path."""
    texts = {EXPERIMENT_TEXT: config_text(REGULATE.name, plan.config), **plan.robot.texts, **plan.attachments()}
    return REGULATE.evaluate(plan, carry_out(plan, sinks=(LogWriter(path, texts),)))
