"""The limits of a plan that commands more speed than its robot's limits allow by themselves."""

import math

from palpate.controllers import LandingModel
from palpate.errors import InvalidValueError
from palpate.runtime import Limits


def limits_allowing(limits: Limits, option: str, speed: float, landing: LandingModel) -> Limits:
    """Return the limits with a speed allowed.

    Args:
        limits: Of the robot.
        option: That asks for it, for people.
        speed: Largest that is commanded where something may be hit [m/s].
        landing: On the contact that is expected.

    Raises:
        InvalidValueError: Something unexpected would be hit too hard; the message names what to change.
    """
    force = landing.largest_force(speed, limits.force)
    if force > limits.largest_impact * (1.0 + 1e-9):
        fastest = landing.fastest(limits.force, limits.largest_impact)
        raise InvalidValueError(
            f"{option}: the tip is commanded at up to {speed:.3g} m/s, with which something unexpected of "
            f"{landing.contact_stiffness:g} N/m may be hit with {force:.3g} N; the limit is "
            f"{limits.largest_impact:g} N, up to {fastest:.2g} m/s; go slower, or write limits.impact_force_N: "
            f"{math.ceil(force)} in the robot file if sensor, tip and object bear that"
        )
    return limits.allowing(speed)
