"""What every experiment asks of a robot's limits before it begins, and how far from the object it does."""

from palpate.errors import InvalidValueError
from palpate.runtime import Limits

CLEARANCE = 0.003
"""How far above the object's top the tip starts [m]."""

LANDING_SHARE = 0.75
"""Of the robot's force limit: a larger set force could reach it on landing."""


def check_force(force: float, greatest: float, limits: Limits) -> None:
    """Refuse a set force that landing could carry beyond the limit.

    Args:
        force: As it was asked for [N].
        greatest: The largest that is wanted with it [N].
        limits: Of the robot.

    Raises:
        InvalidValueError: It could.
    """
    most = LANDING_SHARE * limits.force
    if greatest > most * (1.0 + 1e-12):
        goes = "" if greatest == force else f"the profile goes up to {greatest:g} N and "
        raise InvalidValueError(
            f"force = {force:g} N: {goes}must be at most {most:g} N, {LANDING_SHARE:.0%} of the robot's limit of "
            f"{limits.force:g} N (limits.force_N in the robot file), for landing may exceed it"
        )


def check_speed(name: str, speed: float, limits: Limits) -> None:
    """Refuse a speed [m/s] beyond the limit.

    Raises:
        InvalidValueError: It is.
    """
    if speed > limits.speed:
        raise InvalidValueError(
            f"{name} = {speed:g} m/s: must be at most the robot's limit, {limits.speed:g} m/s "
            "(limits.speed_m_per_s in the robot file)"
        )
