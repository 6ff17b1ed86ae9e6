"""Single readings far from their neighbours: a loose cable's, or a corrupted packet's. They are left out."""

from dataclasses import fields

import numpy as np
from scipy.ndimage import median_filter

from palpate.friction.rubbing.estimate import SensorErrors
from palpate.friction.rubbing.stroke import MIN_SAMPLES, RubbingStroke, TwoWay

NEIGHBOURS = 5
"""Readings of whose median one should not be far: two spikes in a row do not move it."""

FAR = 8.0
"""In standard deviations of a reading, of a Nano17 at the least: white noise is never so far off, and what sticks
and slips moves the median too."""

LARGEST_SHARE = 0.01
"""Of readings that may be left out without a remark."""


def without_spikes(pair: TwoWay, errors: SensorErrors) -> tuple[TwoWay, int]:
    """Return a motion there and back without spikes, and how many were left out.

    Args:
        pair: As recorded.
        errors: Of the sensor: what its noise explains is no spike.
    """
    (there, first), (back, second) = (_kept(stroke, errors) for stroke in pair.both)
    return TwoWay(there, back), first + second


def _kept(stroke: RubbingStroke, errors: SensorErrors) -> tuple[RubbingStroke, int]:
    off = np.abs(stroke.wrench - median_filter(stroke.wrench, size=(NEIGHBOURS, 1), mode="nearest"))
    usual = SensorErrors()
    noise = np.repeat(
        [max(errors.force_noise, usual.force_noise), max(errors.moment_noise, usual.moment_noise)], 3
    )
    kept = (off <= FAR * np.maximum(1.4826 * np.median(off, axis=0), noise)).all(axis=1)
    if kept.all() or np.count_nonzero(kept) < MIN_SAMPLES:
        return stroke, 0
    values = {each.name: np.array(getattr(stroke, each.name)[kept]) for each in fields(RubbingStroke)}
    return RubbingStroke(**values), int(np.count_nonzero(~kept))
