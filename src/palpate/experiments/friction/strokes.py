"""From a run's observations to recorded strokes: which sample belongs to which direction of which rub."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from palpate.controllers.rubs import AirSpan, Rub, RubSpan
from palpate.errors import FloatArray
from palpate.friction.rubbing.stroke import MIN_SAMPLES, RubbingStroke, TwoWay
from palpate.runtime import Command, Observation, Sample

_WIDTH = 1 + 6 + 9 + 3 + 3 + 3 + 3


class RubRecorder:
    """An observer that keeps what strokes are made of, each sample of the sensor once."""

    def __init__(self) -> None:
        """Begin empty."""
        self._rows = array("d")
        self._last = -np.inf

    def __call__(self, sample: Sample, now: Observation, command: Command) -> None:
        """Append a sample, if it is a new one."""
        finger, arm = now.fingers[0], now.arm
        if finger.time <= self._last:
            return
        self._last = finger.time
        a, b, c = arm.rotation_base_tip
        self._rows.extend(
            (
                finger.time,
                *finger.wrench,
                *a,
                *b,
                *c,
                *arm.position_base_tip,
                *arm.velocity_base_tip,
                *arm.angular_velocity_base_tip,
                *finger.contact.centroid.tolist(),
            )
        )

    def rows(self) -> FloatArray:
        """Return all samples, shape (n, 28)."""
        return np.array(self._rows).reshape(-1, _WIDTH)


@dataclass(frozen=True, slots=True, eq=False)
class RubbedPair:
    """A rub that was done there and back.

    Attributes:
        rub: Requested rub.
        pair: Recorded strokes there and back.
    """

    rub: Rub
    pair: TwoWay


@dataclass(frozen=True, slots=True, eq=False)
class FreeAir:
    """Readings of the sensor without load.

    Attributes:
        time: Middle of each stretch, shape (k,) [s].
        wrench: Mean of it, shape (k, 6) [N, N m].
        noise: Standard deviation of one sample, shape (6,), of the first stretch.
    """

    time: FloatArray
    wrench: FloatArray
    noise: FloatArray

    def at(self, time: FloatArray) -> FloatArray:
        """Return the zero at times, shape (n,) [s], on a straight line between the stretches, shape (n, 6)."""
        return np.column_stack([np.interp(time, self.time, column) for column in self.wrench.T])

    @property
    def moved(self) -> FloatArray:
        """How far the zero went from the first stretch to the last, shape (6,)."""
        return np.asarray(self.wrench[-1] - self.wrench[0])


def free_air(rows: FloatArray, spans: Sequence[AirSpan]) -> FreeAir | None:
    """Return the readings in free air; None if no stretch was long enough.

    Args:
        rows: Rows of `RubRecorder.rows`.
        spans: When it was.
    """
    parts = [_within(rows, span.begin, span.end) for span in spans]
    parts = [part for part in parts if len(part) >= MIN_SAMPLES]
    if not parts:
        return None
    return FreeAir(
        np.array([part[:, 0].mean() for part in parts]),
        np.array([part[:, 1:7].mean(axis=0) for part in parts]),
        parts[0][:, 1:7].std(axis=0, ddof=1),
    )


def rubbed_pairs(rows: FloatArray, spans: Sequence[RubSpan], air: FreeAir | None) -> tuple[RubbedPair, ...]:
    """Return the rubs that were done there and back, their wrenches less the sensor's zero.

    Args:
        rows: Rows of `RubRecorder.rows`.
        spans: When each direction was done.
        air: The sensor's zero; not taken off if None.
    """
    pairs = []
    for there, back in pairwise(spans):
        if there.back or not back.back:
            continue
        strokes = [_stroke(_within(rows, span.begin, span.end), air) for span in (there, back)]
        if strokes[0] is not None and strokes[1] is not None:
            pairs.append(RubbedPair(there.rub, TwoWay(strokes[0], strokes[1])))
    return tuple(pairs)


def _within(rows: FloatArray, begin: float, end: float) -> FloatArray:
    time = rows[:, 0]
    return np.asarray(rows[(time >= begin) & (time <= end)])


def _stroke(rows: FloatArray, air: FreeAir | None) -> RubbingStroke | None:
    rows = rows[np.isfinite(rows).all(axis=1)]
    if len(rows) < MIN_SAMPLES:
        return None
    time = rows[:, 0].copy()
    wrench = rows[:, 1:7] - (0.0 if air is None else air.at(time))
    return RubbingStroke(
        time,
        wrench,
        rows[:, 7:16].reshape(-1, 3, 3).copy(),
        rows[:, 16:19].copy(),
        rows[:, 19:22].copy(),
        rows[:, 22:25].copy(),
        rows[:, 25:28].copy(),
    )
