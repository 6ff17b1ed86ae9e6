"""Whether a finger stuck and slipped by turns, at which resistance it then let go, and how often.

What sticks and slips varies within a few per cent of its travel. What a bent surface does to a resistance (its
normal turns), a skin that slips late, or a zero that drifts, varies slowly over the whole stroke: none of that is
stick-slip, and a parabola over the travel takes it off.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.friction.rubbing.slip_test import Resistance

STICK_SLIP_NOISE = 2.0
"""How many times more than the sensor's noise the ratio must vary to be called stick-slip."""

MIN_STICK_SLIP = 0.01
"""Its least standard deviation, over its mean, however good the sensor: that of a sawtooth that rises 1.7 % above
its mean. What a simulated finger's force control leaves of the ratio on a smooth surface is below 0.3 %."""

STATIC_QUANTILE = 0.98
"""Of the ratio in stick-slip, which is the static coefficient: a prototype found 1.00 to 1.01 times it over many
cycles; over some ten, 1.10 was seen."""

STATIC_ABOVE, STATIC_BELOW = 1.10, 1.03
"""By how much that may be more and less than the static coefficient: 1.10 as above; on the friction plant
0.98 to 1.01 times it was seen where it let go ten times and more."""

MIN_LET_GO = 10
"""From so many times on the quantile is the static coefficient; of fewer, some let go before they had stuck."""

MIN_TURNS = 3
"""From so many times on it is called stick-slip: fewer may be the start of a stroke."""

_BEND = 2
"""Degree of what is taken off."""


@dataclass(frozen=True, slots=True)
class StickSlip:
    """Sticking and slipping by turns.

    Attributes:
        ratio: At which it let go: `STATIC_QUANTILE` of all.
        times: How often it let go, in all strokes together.
    """

    ratio: float
    times: int


def stick_slip(strokes: Sequence[Resistance], mean: float, sensor: float) -> StickSlip | None:
    """Return how it stuck and slipped, or None if it did not.

    Args:
        strokes: In slip.
        mean: Of their ratio.
        sensor: Standard deviation of a sample of the ratio by the sensor's noise.
    """
    left = [_steady(stroke) for stroke in strokes]
    spread = math.sqrt(float(np.mean([each.var() for each in left])))
    if spread <= max(STICK_SLIP_NOISE * sensor, MIN_STICK_SLIP * mean):
        return None
    times = sum(_times(each, spread) for each in left)
    # of few long turns the parabola is a part; of the bend of a surface, motions there and back have as much
    bend = float(np.mean([_slope(stroke) for stroke in strokes]))
    level = [stroke.ratio - bend * (stroke.travel - stroke.travel.mean()) for stroke in strokes]
    return StickSlip(float(np.quantile(np.concatenate(level), STATIC_QUANTILE)), times)


def _times(left: FloatArray, spread: float) -> int:
    """How often it fell from a deviation above the mean to one below."""
    side = np.sign(left)[np.abs(left) > spread]
    return int(np.count_nonzero(np.diff(side) < 0.0))


def _slope(stroke: Resistance) -> float:
    s = stroke.travel - stroke.travel.mean()
    return float(s @ stroke.ratio) / max(float(s @ s), 1e-300)


def _steady(stroke: Resistance) -> FloatArray:
    """The ratio less what of it changes slowly."""
    s = stroke.travel - stroke.travel.mean()
    columns = np.vander(s / max(float(np.abs(s).max()), 1e-12), _BEND + 1)
    weights, *_ = np.linalg.lstsq(columns, stroke.ratio, rcond=None)
    return np.asarray(stroke.ratio - columns @ weights)
