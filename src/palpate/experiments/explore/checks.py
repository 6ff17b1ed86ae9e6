"""What an exploration may not ask of fingertip, robot and simulation: refused before anything moves.

Forces and speeds beyond the robot's limits: see `palpate.experiments.kit.run_checks`.
"""

from palpate.errors import InvalidValueError
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.kit.contact_checks import LEAST_FORCE
from palpate.sim import PairParameters


def check_least_force(config: ExploreConfig, least: float) -> None:
    """Refuse forces that fall below what is felt for sure.

    Args:
        config: What was asked for.
        least: Force [N] that is.

    Raises:
        InvalidValueError: They do.
    """
    if config.least_force < least * (1.0 - 1e-12):
        swings = f" and force_swing = {config.force_swing:g} N: the force" if config.force_swing else ":"
        raise InvalidValueError(
            f"force = {config.force:g} N{swings} must be at least {least:g} N, {LEAST_FORCE:g} times what the "
            "robot's sensor file takes for a touch (touch_force_N)"
        )


def check_push(config: ExploreConfig, stiffness: float, following_error: float) -> None:
    """Refuse a force that the servos never reach within the limit of their following error.

    Args:
        config: What was asked for.
        stiffness: Of the servos [N/m].
        following_error: Its limit [m].

    Raises:
        InvalidValueError: It is such a force.
    """
    push = stiffness * following_error
    if config.greatest_force > push:
        raise InvalidValueError(
            f"force = {config.force:g} N: the robot pushes with at most {push:.2g} N, its servos' "
            f"{stiffness:.3g} N/m over a following error of {following_error:g} m (following_error_m, "
            "bandwidth_rad_per_s in the robot file); press with less, or allow more of either"
        )


def check_sliding(config: ExploreConfig, pair: PairParameters) -> None:
    """Refuse speeds at which the simulated friction is not Coulomb's, or the tip lifts off.

    Raises:
        InvalidValueError: It is such a speed.
    """
    creep = pair.creep_speed * config.greatest_force / config.touch_force  # grows with the force
    if not creep < config.speed < pair.lift_speed / 2.0:
        raise InvalidValueError(
            f"speed = {config.speed:g} m/s: must lie between {creep:.2g} m/s, below which the simulated friction "
            f"creeps, and {pair.lift_speed / 2.0:.2g} m/s, from which it may lift the tip"
        )
