"""Surfaces that are planned to be rubbed, and rubbed, as tests do it."""

from palpate.experiments.friction.experiment import FindFriction
from palpate.experiments.kit.recorded_run import carry_out
from palpate.friction.friction_file import How
from palpate.reporting.report import Paragraph
from palpate.robots.values import load_named_robot

FRICTION = FindFriction()


def planned(**options):
    """The plan of a new run with these options."""
    config = FRICTION.Config(**options)
    return FRICTION.plan(config, load_named_robot(config.robot), {})


def rubbed(**options):
    """What a run with these options finds."""
    plan = planned(**options)
    return FRICTION.evaluate(plan, carry_out(plan))


def check_measured(estimate, true, relative):
    """Check that an estimate was measured, lies near the truth, and has it within its interval."""
    assert estimate.how is How.MEASURED
    assert estimate.lower <= true <= estimate.upper
    assert abs(estimate.value / true - 1.0) <= relative


def texts_of(result, heading):
    """Everything that a section of the report says in words; nothing if there is no such section."""
    parts = [p for s in FRICTION.report(result).sections if s.heading == heading for p in s.parts]
    rows = [" | ".join(row) for part in parts for row in getattr(part, "rows", ())]
    return "\n".join([*(part.text for part in parts if isinstance(part, Paragraph)), *rows])
