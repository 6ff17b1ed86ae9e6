"""Pressing before an exploration: what is met where it begins tells stiffness and delay."""

from typing import TYPE_CHECKING

from palpate.controllers import IdentifyController, IdentifyParameters
from palpate.errors import InvalidValueError
from palpate.experiments.explore.identified import IdentifiedForce
from palpate.experiments.kit.pressing import pressing
from palpate.runtime import Supervisor, Touch, run

if TYPE_CHECKING:  # which presses by what is here
    from palpate.experiments.explore.plan import ExplorationPlan

PRESSING = 60.0
"""[s] It takes about 30 once it has landed."""


def pressed(planned: "ExplorationPlan") -> IdentifiedForce:
    """Press where an exploration begins, with a robot and scene of its own, and return what that tells.

    Raises:
        InvalidValueError: It did not get so far.
    """
    wanted = pressing_of(planned)
    controller = IdentifyController(wanted, planned.period)
    longest = wanted.approach_distance / wanted.landing_speed + PRESSING
    result = run(
        planned.backend(),
        Touch(planned.finger),
        controller,
        Supervisor(planned.limits),
        duration=longest,
    )
    try:
        return IdentifiedForce.of(controller.result())
    except InvalidValueError as error:
        raise InvalidValueError(f"identify: {error} (the run: {result})") from None


def pressing_of(planned: "ExplorationPlan") -> IdentifyParameters:
    """Return how it is pressed."""
    return pressing(
        planned.config.force,
        limit=planned.limits.force,
        touch_force=planned.touch_force,
        sensing_delay=planned.finger.pipeline().delay,
        approach_distance=planned.parameters.approach_distance,
    )
