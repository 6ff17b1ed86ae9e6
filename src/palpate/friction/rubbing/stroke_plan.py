"""The slips that determine a limit surface best.

- Loads: ln e is a straight line over ln f_n with the slope gamma, so half of them at either end of the range.
- Spins: tau / f_n alone tells mu e, which has two parameters; mu has one, and every slip helps it.
- Both at once, for p: a slip at v = e omega tells how far the load lies from the axes (ln 2 / p^2 per p), one at
  v = k e omega how fast the load turns with the slip (ln k / (p - 1)^2): for p near 2 that takes a k far from 1,
  near 1 a k close to it, or the load has turned to the axis already; k and 1/k make up for what is not known of e.
- One slip speed for all, by which mu may differ.
"""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, positive

PURE_SLIDE, PURE_SPIN = math.inf, 0.0

RATIOS = (PURE_SLIDE, PURE_SPIN, 0.4, 2.5, PURE_SPIN, 1.25, 0.8, PURE_SPIN, 1.0)
"""v over e omega of the slips at one load, the most telling ones first."""

MIN_LOAD_SPAN = 2.0
"""Largest over least normal force: at 2, gamma takes eight times the strokes that 0.7 to 5 N take,
(ln 7 / ln 2)^2."""

MIN_SLIPS = 6
"""A slide, a spin and both at once, at either load."""


@dataclass(frozen=True, slots=True)
class PlannedSlip:
    """A motion there and back at one load.

    Attributes:
        normal_force: To press with [N].
        speed: Of the contact along the surface [m/s].
        spin: About the normal [rad/s].
    """

    normal_force: float
    speed: float
    spin: float


def planned_slips(
    forces: tuple[float, float],
    spin_lengths: tuple[float, float],
    count: int = 18,
    slip_speed: float = 0.02,
) -> tuple[PlannedSlip, ...]:
    """Return slips that determine mu, c, gamma and p.

    Args:
        forces: Least and largest normal force that finger and surface bear [N].
        spin_lengths: e at these two, within 30 % or so, as one pair of strokes and twists at each tells [m].
        count: How many to make.
        slip_speed: |(v, e omega)| of each [m/s].

    Raises:
        InvalidValueError: Forces too close together, or too few slips.
    """
    low, high = (positive("force", force, "N") for force in forces)
    for length in spin_lengths:
        positive("spin length", length, "m")
    positive("slip_speed", slip_speed, "m/s")
    if high < MIN_LOAD_SPAN * low:
        raise InvalidValueError(
            f"forces = {low:g} and {high:g} N: the second must be at least {MIN_LOAD_SPAN:g} times the first; "
            "gamma follows from how e grows between them"
        )
    if count < MIN_SLIPS:
        raise InvalidValueError(f"count = {count}: must be at least {MIN_SLIPS}, three at either load")
    slips = []
    for i in range(count):
        force, e = (low, spin_lengths[0]) if i % 2 == 0 else (high, spin_lengths[1])
        ratio = RATIOS[i // 2 % len(RATIOS)]
        angle = 0.5 * math.pi if math.isinf(ratio) else math.atan(ratio)
        speed = 0.0 if ratio == PURE_SPIN else slip_speed * math.sin(angle)
        spin = 0.0 if ratio == PURE_SLIDE else slip_speed * math.cos(angle) / e
        slips.append(PlannedSlip(force, speed, spin))
    return tuple(slips)
