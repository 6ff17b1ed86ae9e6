"""Pressing before an exploration: what is met where it begins tells stiffness and delay."""

from palpate.controllers import IdentifyController, IdentifyParameters
from palpate.errors import InvalidValueError
from palpate.experiments.explore.identified import IdentifiedForce
from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.kit.pressing import pressing
from palpate.runtime import Supervisor, Touch, run

PRESSING = 60.0
"""[s] It takes about 30 once it has landed."""


def prepared(planned: ExplorationPlan) -> ExplorationPlan:
    """Press first, if that is asked for; return the plan with the force law that follows.

    Raises:
        InvalidValueError: Pressing has found nothing; the message says why.
    """
    return planned.with_identified(pressed(planned)) if planned.config.identify else planned


def pressed(planned: ExplorationPlan) -> IdentifiedForce:
    """Press where an exploration begins, with a robot and scene of its own, and return what that tells.

    Raises:
        InvalidValueError: It did not get so far.
    """
    wanted = pressing_of(planned)
    controller = IdentifyController(wanted, planned.period)
    longest = wanted.approach_distance / wanted.landing_speed + PRESSING
    result = run(
        planned.another_backend(),
        Touch(planned.finger),
        controller,
        Supervisor(planned.limits),
        duration=longest,
    )
    try:
        return IdentifiedForce.of(controller.result())
    except InvalidValueError as error:
        raise InvalidValueError(f"identify: {error} (the run: {result})") from None


def pressing_of(planned: ExplorationPlan) -> IdentifyParameters:
    """Return how it is pressed."""
    return pressing(
        planned.config.force,
        limit=planned.limits.force,
        touch_force=planned.touch_force,
        sensing_delay=planned.finger.pipeline().delay,
        approach_distance=planned.parameters.approach_distance,
    )
