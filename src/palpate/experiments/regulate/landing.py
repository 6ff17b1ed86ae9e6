"""How a regulation of force lands: how fast, and how hard it may meet a surface that moves."""

from palpate.controllers import ForceGain
from palpate.controllers.landing import LandingModel, meeting_speed, moved_mass
from palpate.controllers.surface_motion import FASTEST_SURFACE
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_checks import speed_hint
from palpate.experiments.regulate.config import RegulateConfig
from palpate.robots.task import RobotInScene
from palpate.runtime import Limits

FASTEST_LANDING = 0.005
"""[m/s], however soft a surface is."""

LIFT_SPEED = 0.02
"""How fast it is lifted from what stands still, at most [m/s]."""

LANDING_ON_MOTION = 0.0005
"""[m/s]. A surface that goes up and down is then met less than a landing speed times its period below its turning
point, where it is slow: on one of 10 mm and 20 mm/s the peak is 7 N, instead of 15 N at 4 mm/s."""


def landing_model(gain: ForceGain, contact: float, ready: RobotInScene) -> LandingModel:
    """Return what lands on what.

    Args:
        gain: Of force control.
        contact: Stiffness of the contact alone [N/m].
        ready: The robot in its scene.
    """
    return LandingModel(gain.stiffness, gain.delay, contact, moved_mass(ready.stiffness, ready.response))


def landing_speed(config: RegulateConfig, model: LandingModel, ready: RobotInScene) -> float:
    """Return how fast it may land [m/s]."""
    speed = min(model.speed(config.force, min(ready.touch_force, 0.5 * config.force)), FASTEST_LANDING)
    return min(speed, LANDING_ON_MOTION) if config.surface == "sine" else speed


def check_meeting(config: RegulateConfig, model: LandingModel, landing: float, limits: Limits) -> None:
    """Refuse to meet a surface that goes up and down with a force beyond the limit.

    Raises:
        InvalidValueError: It would be, or the surface goes faster than can be followed.
    """
    if config.surface != "sine":
        return
    if config.surface_speed > FASTEST_SURFACE:
        speed = config.surface_speed
        hint = speed_hint(speed, FASTEST_SURFACE)
        raise InvalidValueError(
            f"surface_speed = {speed:g} m/s: must be at most {FASTEST_SURFACE:g} m/s, the fastest that is "
            f"followed{hint}"
        )
    met = meeting_speed(landing, config.surface_speed)
    peak = model.peak(met)
    if peak > limits.force:
        raise InvalidValueError(
            f"landing_speed = {landing:g} m/s: the surface may be met at {met:.2g} m/s, and so with "
            f"about {peak:.2g} N, beyond the robot's limit of {limits.force:g} N; come down more slowly "
            "(--landing-speed), or let the surface move more slowly or less far"
        )
