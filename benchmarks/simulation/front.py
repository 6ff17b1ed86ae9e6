"""Whether a preset lies on the front of speed against error: nothing else is as good, and better somewhere."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from simulation.timing import Ratio

RESOLUTION = 0.05
"""Relative: times and errors nearer than this are alike. What times vary by, and errors from path to path."""


@dataclass(frozen=True, slots=True)
class Rival:
    """A choice as the front sees it.

    Attributes:
        name: Its name.
        time: Of a whole control period, over the preset's, paired.
        errors: The less, the better; NaN: could not be measured.
        admitted: Whether it reaches as far as its kind of scene needs.
    """

    name: str
    time: Ratio
    errors: tuple[float, ...]
    admitted: bool = True


def beaten_by(errors: Sequence[float], rivals: Sequence[Rival], floors: Sequence[float]) -> list[str]:
    """Return whom a preset is beaten by, if it is not on the front.

    Args:
        errors: Of the preset.
        rivals: The other choices; those that are not admitted do not count.
        floors: An error below this counts as none, one for each kind of error.
    """
    return [rival.name for rival in rivals if rival.admitted and _beats(rival, errors, floors)]


def _beats(rival: Rival, errors: Sequence[float], floors: Sequence[float]) -> bool:
    if not all(map(math.isfinite, rival.errors)) or rival.time.median > 1.0 + RESOLUTION:
        return False
    better = rival.time.high < 1.0 - RESOLUTION  # with confidence: times are noisy, errors are not
    for its, own, floor in zip(rival.errors, errors, floors, strict=True):
        a, b = max(its, floor), max(own, floor)
        if a > b * (1.0 + RESOLUTION):
            return False
        better = better or a < b * (1.0 - RESOLUTION)
    return better
