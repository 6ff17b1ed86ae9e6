"""What a grasp will take of the simulated hand, reckoned before anything moves, and what the hand has."""

import math

from palpate.errors import InvalidValueError
from palpate.experiments.grasp_config import GraspConfig
from palpate.experiments.grasp_least import least_grip
from palpate.experiments.grasp_surface import true_surface
from palpate.experiments.grasp_unit_text import in_percent
from palpate.friction.limit_surface import LimitSurface
from palpate.sim.fidelity import GRAVITY
from palpate.spatial import Vector, Wrench

LARGEST_GRIP = 15.5
"""[N] 12 mm before the sensor that is 0.19 N m, and 0.21 as a grip that jumps there with 300 N/s overshoots by an
eighth; half of the largest pull and a weight, 8 mm aside, are another 0.036 of the 0.25 that it can measure."""


def weight_of(config: GraspConfig) -> Wrench:
    """Return the object's weight, about its origin [N, N m]."""
    return (0.0, 0.0, -config.mass * GRAVITY, 0.0, 0.0, 0.0)


def largest_load(config: GraspConfig) -> Wrench:
    """Return weight and pull where they are largest, about the object's origin, base frame [N, N m]."""
    weight = config.mass * GRAVITY
    if config.load == "none":
        return weight_of(config)
    down, aside = max(config.pull_before, config.largest_pull), 0.0
    if config.load == "shake":
        down, aside = config.pull_before + config.largest_pull, config.largest_pull
    return (0.0, aside, -down - weight, -config.offset * down, 0.0, 0.0)


def grip_for(config: GraspConfig, surface: LimitSurface, load: Wrench) -> float:
    """Return the least grip that holds a load where the fingers are meant to touch [N]; infinity if none does."""
    contacts: list[Vector] = []
    normals: list[Vector] = []
    for i in range(config.fingers):
        angle = 2.0 * math.pi * i / config.fingers
        x, y = math.cos(angle), math.sin(angle)
        contacts.append((config.half_width * x, config.half_width * y, 0.0))
        normals.append((-x, -y, 0.0))
    return least_grip(surface, load, contacts, normals)


def check_weight(config: GraspConfig) -> None:
    """Refuse an object that the hand cannot hold, even if nothing pulls.

    Raises:
        InvalidValueError: Its weight takes more grip, with the margin, than fingers may press with.
    """
    true = true_surface(config)
    grip = (1.0 + config.margin) * grip_for(config, true, weight_of(config))
    if grip > LARGEST_GRIP:
        most = _rounded_down(config.mass * LARGEST_GRIP / grip)
        raise InvalidValueError(
            f"mass = {config.mass:g} kg: must be at most {most:g} kg; with mu = {true.friction:g} and a margin of "
            f"{in_percent(config.margin)} its weight takes {grip:.3g} N of each finger, which presses with "
            f"at most {LARGEST_GRIP:g} N"
        )


def _rounded_down(value: float) -> float:
    """To two digits, never up: what a message offers must do."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return round(math.floor(value / step) * step, 12)
