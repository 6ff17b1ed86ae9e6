"""Pressing before an exploration: what is met where it begins tells stiffness and delay."""

from palpate.controllers import IdentifyController, IdentifyParameters
from palpate.errors import InvalidValueError
from palpate.experiments.explore_identified import IdentifiedForce
from palpate.experiments.explore_plan import ExplorationPlan
from palpate.runtime import Supervisor, Touch, run

PRESSED_SHARE = 0.5
"""It presses between (1 - this) and (1 + this) of the set force, if the robot's limit has room for that."""

ROOM_BELOW_LIMIT = 0.9
"""Of the force limit: ramps turn a few periods after they have passed their upper force."""

ABOVE_TOUCH = 1.1
"""The lower force is at least so many times what counts as a touch: lifted off, the tip tells nothing."""

SWING_SHARE = 0.2
"""Amplitude of the sines, of what lies between the lower and the upper force."""

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
    pressing = pressing_of(planned)
    controller = IdentifyController(pressing, planned.config.period)
    longest = pressing.approach_distance / pressing.landing_speed + PRESSING
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
    force, limit = planned.config.force, planned.limits.force
    high = min((1.0 + PRESSED_SHARE) * force, ROOM_BELOW_LIMIT * limit)
    low = max((1.0 - PRESSED_SHARE) * force, ABOVE_TOUCH * planned.touch_force)
    return IdentifyParameters(
        low=low,
        high=high,
        swing=SWING_SHARE * (high - low),
        sensing_delay=planned.finger.pipeline().delay,
        approach_distance=planned.parameters.approach_distance,
    )
