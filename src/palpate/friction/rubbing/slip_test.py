"""Whether a finger slipped at all: a surface that only yields shows a force, but no friction.

Something elastic resists in proportion to the travel, something that slips does not. Over the steady part of a
stroke, fit resistance = mean + slope (travel - mid); `rise` = slope mid / mean is 1 for anything elastic, whatever
its stiffness, and 0 for slip. The slope is that of the chord from the start at most 1 / rise times, so a rise
below 0.15 says both: the plateau's slope is below 15 % of the initial one, and the travel more than twice that
before slip. Both directions together, as a stroke may begin preloaded: nothing elastic, preloaded or not, resists
a motion and its reverse alike without rising.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.friction.rubbing.stroke import batch_means

LARGEST_RISE = 0.15
"""Of the plateau's slope over the initial one. None of 4000 elastic surfaces passed for slip, by strokes or by
twists, and all of 240 that slipped were seen (`benchmarks/friction.py`)."""

SIGMAS_BELOW_ELASTIC = 5.0
"""By how many standard deviations the rise must lie below 1: with the 12 degrees of freedom of one pair, chance
alone does that 1.5 times in 10000 (Student)."""

SIGMAS_ABOVE_NOTHING = 4.0
"""By how many the resistance to every single stroke must lie above 0."""


LEVEL_END = 0.3
"""Share of a single motion at whose end a plateau is looked for."""


@dataclass(frozen=True, slots=True, eq=False)
class Resistance:
    """What resisted a stroke over its steady part; n samples.

    Attributes:
        travel: Since the motion began, shape (n,) [m or rad].
        ratio: Tangential force against the motion over normal force, or torque likewise [m], shape (n,).
    """

    travel: FloatArray
    ratio: FloatArray


@dataclass(frozen=True, slots=True)
class SlipEvidence:
    """What strokes say about slip.

    Attributes:
        slipped: Whether they slipped, beyond doubt.
        rise: Slope of the plateau over that of the chord from the start: 0 in slip, 1 if elastic.
        uncertainty: Its standard deviation.
    """

    slipped: bool
    rise: float
    uncertainty: float


def slip_evidence(strokes: Sequence[Resistance]) -> SlipEvidence:
    """Return whether strokes of one kind slipped, all of them together.

    Args:
        strokes: At least one in each of two opposite directions.

    Raises:
        InvalidValueError: Fewer than two strokes.
    """
    if len(strokes) < 2:
        raise InvalidValueError(f"{len(strokes)} stroke: must be at least one there and one back")
    rises, means, variances, sure = [], [], [], True
    for stroke in strokes:
        s, r = batch_means(stroke.travel), batch_means(stroke.ratio)
        mid, mean = float(s.mean()), float(r.mean())
        spread = float(((s - mid) ** 2).sum())
        slope = float((s - mid) @ r) / spread
        variance = float(((r - mean - slope * (s - mid)) ** 2).sum()) / (len(s) - 2)
        rises.append(slope * mid)
        means.append(mean)
        variances.append(variance * mid**2 / spread)
        sure = sure and mean > SIGMAS_ABOVE_NOTHING * math.sqrt(variance / len(s))
    total = float(np.sum(means))
    if total <= 0.0:
        return SlipEvidence(False, math.inf, 0.0)
    rise, uncertainty = float(np.sum(rises)) / total, math.sqrt(float(np.sum(variances))) / total
    slipped = sure and rise < LARGEST_RISE + 2.0 * uncertainty and rise + SIGMAS_BELOW_ELASTIC * uncertainty < 1.0
    return SlipEvidence(slipped, rise, uncertainty)


def ends_level(stroke: Resistance) -> bool:
    """Return whether the resistance of a single motion has stopped rising at its end: it began to slip.

    That is not enough to measure by: something that stiffens ends level, too.
    """
    s, r = batch_means(stroke.travel, 20), batch_means(stroke.ratio, 20)
    last = round(len(s) * (1.0 - LEVEL_END))
    at, end = s[last:] - s[last:].mean(), r[last:]
    spread = float((at**2).sum())
    slope = float(at @ end) / spread
    off = math.sqrt(float(((end - end.mean() - slope * at) ** 2).sum()) / (len(at) - 2) / spread)
    risen = float(end.mean() - r[0]) / float(s[last:].mean() - s[0])
    return risen > SIGMAS_ABOVE_NOTHING * off and slope + 2.0 * off < LARGEST_RISE * risen
