"""Grip that a grasp will need, computed beforehand, and the strength of the hand."""

import math
from dataclasses import replace

from palpate.errors import InvalidValueError
from palpate.experiments.grasp.config import SPREADS, GraspConfig, Knowledge
from palpate.experiments.grasp.least import least_forces
from palpate.experiments.grasp.unit_text import in_percent
from palpate.friction.limit_surface import LimitSurface
from palpate.sim.fidelity import GRAVITY
from palpate.spatial import Vector, Wrench

LARGEST_GRIP = 15.5
"""[N] 12 mm before the sensor that is 0.19 N m, and 0.24 as a grip that jumps there with 450 N/s overshoots, of
the 0.25 that it can measure; half of the largest pull and a weight, 8 mm aside, are 0.036 about another axis."""

OVERSHOOT = 0.3
"""By which share a grip that jumps there is more for a moment: the servos' rotors swing on the contacts."""

LEAST_ROOM = 0.08
"""Share of grip that lifting takes beyond the least, whatever the margin: what the lift waits for, and noise."""

FOLLOWS = 15.0
"""[N/s] With which the simulated fingers' grip follows a large change at least: position servos, whose profile
closes with 5 mm/s."""

LIKELY = 2.33
"""Standard deviations: beyond lies 1 %."""

UNLOADED = 0.15
"""[s] That taking up any weight takes longer than to start with the full acceleration."""


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
    """Return the largest of the least forces that hold a load where fingers are to touch [N], or infinity."""
    contacts: list[Vector] = []
    normals: list[Vector] = []
    for i in range(config.fingers):
        angle = 2.0 * math.pi * i / config.fingers
        x, y = math.cos(angle), math.sin(angle)
        contacts.append((config.half_width * x, config.half_width * y, 0.0))
        normals.append((-x, -y, 0.0))
    return max(least_forces(surface, load, contacts, normals))


def cautious_surface(config: GraspConfig, believed: LimitSurface, true: LimitSurface) -> LimitSurface:
    """Return the least that the grip is planned with while it is lifted; a nudge is taken to measure the truth."""
    if config.known == "nudged":
        return true
    return believed if config.known == "touched" else at_worst(believed, config.known)


def at_worst(believed: LimitSurface, known: Knowledge) -> LimitSurface:
    """Return the least that contacts can bear within the assumed range of friction."""
    of_mu, of_e = SPREADS[known]
    if known == "estimated":
        of_mu, of_e = LIKELY * of_mu, LIKELY * of_e
    return replace(
        believed, friction=believed.friction * (1.0 - of_mu), spin_length=believed.spin_length * (1.0 - of_e)
    )


def taking_up_time(config: GraspConfig, cautious: LimitSurface, first_grip: float) -> float:
    """Return how much longer a lift takes because the grip has to come up to the weight [s].

    Args:
        config: What is lifted.
        cautious: See `cautious_surface`.
        first_grip: With which the lift begins [N].
    """
    needed = grip_for(config, cautious, weight_of(config))
    grip = min((1.0 + config.margin) * needed, LARGEST_GRIP)
    return UNLOADED + max(0.0, grip - first_grip) / FOLLOWS


def check_weight(config: GraspConfig, cautious: LimitSurface, true: LimitSurface) -> None:
    """Refuse an object that the hand cannot hold, even if nothing pulls.

    Args:
        config: What is held.
        cautious: See `cautious_surface`.
        true: What contacts really bear.

    Raises:
        InvalidValueError: Its weight takes more grip, with the margin, than fingers may press with, by what is
            true or by what is planned with.
    """
    weight = weight_of(config)
    needs = (
        (grip_for(config, true, weight), true, ""),
        (grip_for(config, cautious, weight), cautious, " (planned with)"),
    )
    least, surface, note = max(needs, key=lambda each: each[0])
    grip = (1.0 + max(config.margin, LEAST_ROOM)) * least
    if grip > LARGEST_GRIP:
        most = _rounded_down(config.mass * LARGEST_GRIP / grip)
        raise InvalidValueError(
            f"mass = {config.mass:g} kg: must be at most {most:g} kg, or the object rougher (--friction); with "
            f"mu = {surface.friction:.3g}{note} and a margin of {in_percent(max(config.margin, LEAST_ROOM))} its "
            f"weight takes {grip:.3g} N of each finger, of which at most {LARGEST_GRIP:g} N is asked"
        )


def _rounded_down(value: float) -> float:
    """To three digits, never up: what a message recommends must be accepted."""
    step = 10.0 ** (math.floor(math.log10(value)) - 2)
    return round(math.floor(value / step) * step, 12)
