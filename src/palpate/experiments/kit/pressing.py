"""How an experiment presses first, to find stiffness and delay: about the force that it is to hold."""

from palpate.controllers import IdentifyParameters

PRESSED_SHARE = 0.5
"""It presses between (1 - this) and (1 + this) of the set force, if the robot's limit has room for that."""

ROOM_BELOW_LIMIT = 0.9
"""Of the force limit: ramps turn a few periods after they have passed their upper force."""

ABOVE_TOUCH = 1.1
"""The lower force is at least so many times what counts as a touch: lifted off, the tip tells nothing."""

SWING_SHARE = 0.2
"""Amplitude of the sines, of what lies between the lower and the upper force."""


def pressing(
    force: float, *, limit: float, touch_force: float, sensing_delay: float, approach_distance: float
) -> IdentifyParameters:
    """Return how it is pressed.

    Args:
        force: To be held later [N].
        limit: Of the robot [N].
        touch_force: What counts as a touch [N].
        sensing_delay: From a load to the observation that shows it [s].
        approach_distance: How far down the surface is looked for [m].
    """
    high = min((1.0 + PRESSED_SHARE) * force, ROOM_BELOW_LIMIT * limit)
    low = max((1.0 - PRESSED_SHARE) * force, ABOVE_TOUCH * touch_force)
    return IdentifyParameters(
        low=low,
        high=high,
        swing=SWING_SHARE * (high - low),
        sensing_delay=sensing_delay,
        approach_distance=approach_distance,
    )
