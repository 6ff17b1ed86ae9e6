"""Checks of a force regulation against the limits of the robot."""

import math

from palpate.controllers.landing import LandingModel
from palpate.controllers.surface_motion import FASTEST_SURFACE
from palpate.controllers.tangent_motion import PathTable, TangentMotion, VelocityTable
from palpate.errors import InvalidValueError
from palpate.experiments.kit.contact_checks import MOST_FORCE
from palpate.experiments.kit.run_checks import LANDING_SHARE, check_force, check_speed
from palpate.experiments.regulate.config import LARGEST_MOTION, RegulateConfig
from palpate.experiments.regulate.landing import FASTEST_LANDING
from palpate.runtime import Limits

FARTHEST_MOTION = 1.8 * LARGEST_MOTION
"""How far from its beginning a motion from a file may lead along x or y [m]: the plate ends after 0.1 m."""

PUSH_SHARE = 1.25
"""Of the force limit, that a push may reach by the model of a landing. A sensor that is dead is noticed later than
one that shows the limit: with it all dead sensors kept to 1.5 (`benchmarks/wire dead`)."""


def check_limits(config: RegulateConfig, motion: TangentMotion, limits: Limits) -> None:
    """Refuse forces, speeds, distances and frequencies beyond what robot and loop can do.

    Raises:
        InvalidValueError: One is.
    """
    check_force(config.force, config.greatest, limits)
    check_speed("landing_speed", config.landing_speed or 0.0, limits)
    if isinstance(motion, PathTable | VelocityTable):
        check_speed(f"motion_file = {config.motion_file}: its fastest", motion.fastest, limits)
        if motion.farthest > FARTHEST_MOTION:
            raise InvalidValueError(
                f"motion_file = {config.motion_file}: it goes {motion.farthest:.3g} m away from where it begins: "
                f"must be at most {FARTHEST_MOTION:g} m, or the tip would leave the plate; metres are meant"
            )
    elif config.motion != "still":
        check_speed("motion_speed", config.motion_speed, limits)
    if config.profile == "sine" and max(config.frequencies) * 4.0 * (config.period or 1e-3) > 1.0:
        highest = 0.25 / (config.period or 1e-3)
        raise InvalidValueError(
            f"frequencies = {max(config.frequencies):g} Hz: must be at most {highest:g} Hz, four periods of "
            "control to each cycle"
        )


def fastest_along(config: RegulateConfig, motion: TangentMotion) -> float:
    """Return the largest speed of the motion along the surface [m/s]."""
    if isinstance(motion, PathTable | VelocityTable):
        return motion.fastest
    return 0.0 if config.motion == "still" else config.motion_speed


def fastest_push(config: RegulateConfig, along: float, limits: Limits, landing: LandingModel) -> float:
    """Return with which speed a force error or a surface that moves may have the tip pushed at most [m/s].

    Onto what stands still no faster than the force limit is kept with, were the sensor dead.
    """
    if config.surface == "sine":
        return FASTEST_SURFACE
    harmless = landing.fastest(limits.force, PUSH_SHARE * limits.force)
    return min(FASTEST_SURFACE, math.sqrt(max(harmless**2 - along**2, FASTEST_LANDING**2)))


def most_force(limits: Limits) -> float:
    """Return the largest force that may be asked for [N]."""
    return min(MOST_FORCE, LANDING_SHARE * limits.force)
