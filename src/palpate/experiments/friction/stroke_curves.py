"""mu along strokes, for their figure."""

from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.friction.result import FrictionResult
from palpate.friction.rubbing.stroke import RubbingStroke

SMOOTHED = 0.01
"""Over how long mu along a stroke is averaged for its figure [s]: with 10 mN of noise at 1 N it is a cloud else.
"""


@dataclass(frozen=True, slots=True, eq=False)
class StrokeCurve:
    """Tangential over normal force along one direction of a stroke.

    Attributes:
        load: Normal force [N].
        back: Whether on the return.
        travel: Since it began to move, shape (n,) [m].
        ratio: Against the motion, shape (n,).
    """

    load: float
    back: bool
    travel: FloatArray
    ratio: FloatArray

    def __post_init__(self) -> None:
        if self.travel.shape != self.ratio.shape:
            raise InvalidValueError(f"ratio has shape {self.ratio.shape}: must be {self.travel.shape}, as travel")


def stroke_curves(result: FrictionResult) -> tuple[StrokeCurve, ...]:
    """Return of each load the last stroke at the main speed: the longest, where it went on until it slipped."""
    last = {
        pair.rub.normal_force: pair
        for pair in result.pairs
        if pair.rub.spin == pair.rub.heading == 0.0 and pair.rub.speed == result.plan.wanted.speed
    }
    normals = {at.load: at.friction.normal for at in result.found.loads}
    return tuple(
        _stroke_curve(load, back, stroke, normals[load], pair.rub.speed)
        for load, pair in last.items()
        if load in normals
        for back, stroke in ((False, pair.pair.there), (True, pair.pair.back))
    )


def _stroke_curve(load: float, back: bool, stroke: RubbingStroke, normal: FloatArray, speed: float) -> StrokeCurve:
    velocity = stroke.contact_velocity
    along = velocity - np.outer(velocity @ normal, normal)
    direction = along.sum(axis=0) / np.linalg.norm(along.sum(axis=0))
    travel = np.concatenate([[0.0], np.cumsum((along @ direction)[:-1] * np.diff(stroke.time))])
    ratio = (stroke.force @ direction) / (stroke.force @ normal)
    step = float(np.median(np.diff(stroke.time)))
    width = max(1, round(SMOOTHED / step))
    ratio = np.convolve(ratio, np.full(width, 1.0 / width), "same")
    # at its ends the moving average is not over its full width
    kept = slice(width, len(ratio) - width)
    return StrokeCurve(load, back, travel[kept], ratio[kept])
