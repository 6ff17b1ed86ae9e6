"""Whether loads are those of one limit surface in slip: what a fit leaves of them is looked at."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.estimation import Assumption, BrokenAssumption, Verdict

MOST_SCATTER = 0.2
"""Of loads about their limit surface: real surfaces differ by some per cent from stroke to stroke."""

FAR = 5.0
"""In standard deviations, both components together: chance alone does that 4 times in a million loads."""

OFF = 0.1
"""Relative: what is off by less is what a sensor's zero and calibration make of light loads."""

FAR_INSIDE = 0.7
"""Of the load predicted for its slip: what is less, by `FAR_DEVIATIONS` of the scatter, had not slipped."""

FAR_DEVIATIONS = 3.0


@dataclass(frozen=True, slots=True, eq=False)
class FittedLoads:
    """Loads beside what a fit predicts of them, n of them.

    Attributes:
        scatter: Relative.
        distance: Of each from its prediction, in standard deviations, shape (n,).
        share: Its size over that predicted, shape (n,).
        at_bound: Names of parameters at a bound.
        axes: Largest and least mu by direction, if it differs; None else.
        off: How far it is from that predicted, over the size of that, shape (n,).
        sharpest: Whether p is at its largest.
    """

    scatter: float
    distance: FloatArray
    share: FloatArray
    at_bound: tuple[str, ...]
    axes: tuple[float, float] | None
    off: FloatArray
    sharpest: bool


def surface_verdict(loads: FittedLoads) -> Verdict:
    """Return which assumptions of a limit surface in slip do not hold for these loads."""
    return Verdict(tuple(_broken(loads)))


def _broken(loads: FittedLoads) -> Iterator[BrokenAssumption]:
    n = len(loads.distance)
    if loads.at_bound or loads.sharpest:
        names = ", ".join((*loads.at_bound, *(("p",) if loads.sharpest else ())))
        yield BrokenAssumption(
            Assumption.WITHIN_BOUNDS,
            f"{names} at the end of what is looked for",
            "no limit surface explains these loads; check units, and that the contact slipped in all of them",
        )
    if loads.scatter > MOST_SCATTER:
        yield BrokenAssumption(
            Assumption.NOISE_LEVEL,
            f"loads scatter by {100.0 * loads.scatter:.0f} % about it, at most {100.0 * MOST_SCATTER:.0f} %",
            "leave out loads of contacts that did not slip",
        )
    far = (loads.distance > FAR) & (loads.off > OFF)
    inside = loads.share < min(FAR_INSIDE, 1.0 - FAR_DEVIATIONS * min(loads.scatter, 0.1))
    if np.count_nonzero(inside) > max(1, 0.05 * n):
        yield BrokenAssumption(
            Assumption.NO_OUTLIERS,
            f"{np.count_nonzero(inside)} of {n} loads are less than {100.0 * FAR_INSIDE:.0f} % of what slip takes",
            "leave out loads of contacts that did not slip",
        )
    elif far.any():
        worst = int(np.argmax(loads.distance))
        yield BrokenAssumption(
            Assumption.NO_OUTLIERS,
            f"{np.count_nonzero(far)} of {n} loads are more than {FAR:g} deviations off, most number {worst}",
            "look at these, and measure them again",
        )
    if loads.axes is not None:
        largest, least = loads.axes
        yield BrokenAssumption(
            Assumption.WHITE_IN_DIRECTION,
            f"mu is {largest:.3g} along one direction, {least:.3g} across it",
            "take mu along both axes, or the smaller one for grasps",
        )
