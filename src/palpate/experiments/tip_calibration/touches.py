"""From a record to touches: the wrench at rest less that in the air just before, and the pose of the sensor.

The noise of these differences comes from means of blocks, so that correlation from sample to sample counts. It is
one for all touches, for the sensor is the same and they last equally long.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.controllers.touch_sequence import HeldSpan
from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime import Record
from palpate.sensing.tip_calibration import Touches

BLOCK_COUNT = 8
"""Number of blocks of a rest: each must exceed the correlation time of the noise, and their scatter be known."""

MIN_WRENCH_SD = (1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6)
"""Least standard deviation of a mean, even without noise [N, N m]: a tenth of the finest sensors' resolution."""

_MAX_CREEP = 5e-5
"""Largest motion of the tip from the first to the second half of a rest [m]."""

_PAUSE_TIME = 10.0
"""Time between the first touches and the next ones [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """Samples of one rest, each of the sensor once."""

    time: FloatArray
    wrench: FloatArray
    position: FloatArray
    rotation: FloatArray

    @property
    def block_variance(self) -> FloatArray:
        """Variance of the mean of the wrench, shape (6,)."""
        means = [block.mean(axis=0) for block in np.array_split(self.wrench, BLOCK_COUNT)]
        return np.asarray(np.var(means, axis=0, ddof=1) / BLOCK_COUNT)

    @property
    def creep(self) -> float:
        """Motion from the first half to the second [m]."""
        half = len(self.position) // 2
        return float(np.linalg.norm(self.position[half:].mean(axis=0) - self.position[:half].mean(axis=0)))


@dataclass(frozen=True, slots=True, eq=False)
class FeltTouches:
    """The touches of a run.

    Attributes:
        touches: Touches at rest, one row per force of each touch.
        unrested: Steps that were left out, for the tip crept.
    """

    touches: Touches
    unrested: tuple[int, ...]


def felt_touches(pieces: Iterable[Record], spans: Sequence[HeldSpan], targets: Sequence[int]) -> FeltTouches:
    """Return the touches of a run.

    Args:
        pieces: All periods of the run, in order.
        spans: Times at which the tip rested.
        targets: Index of the target of each step of the sequence.

    Raises:
        InvalidValueError: If nothing was felt at rest.
    """
    windows = _windows(pieces, [span.air for span in spans] + [span.held for span in spans])
    found = [
        (span, before, at)
        for span, before, at in zip(spans, windows[: len(spans)], windows[len(spans) :], strict=True)
        if min(len(before.time), len(at.time)) >= 2 * BLOCK_COUNT
    ]
    rested = [each for each in found if each[2].creep <= _MAX_CREEP]
    if not rested:
        raise InvalidValueError(
            f"nothing was felt at rest: {len(spans)} rests, {len(found)} with {2 * BLOCK_COUNT} samples or more; "
            "are the things where they are thought to be (--plate, --rod, --ball)?"
        )
    variance = np.mean([before.block_variance + at.block_variance for _, before, at in rested], axis=0)
    sd = np.maximum(np.sqrt(variance), MIN_WRENCH_SD)
    touches = Touches(
        np.array([targets[span.touch] for span, _, _ in rested]),
        np.array([at.wrench.mean(axis=0) - before.wrench.mean(axis=0) for _, before, at in rested]),
        np.tile(sd, (len(rested), 1)),
        np.array([Rotation.from_matrix(at.rotation).mean().as_matrix() for _, _, at in rested]),
        np.array([at.position.mean(axis=0) for _, _, at in rested]),
        np.array([at.time.mean() for _, _, at in rested]),
    )
    return FeltTouches(touches, tuple(sorted({span.touch for span, _, at in found if at.creep > _MAX_CREEP})))


def _windows(pieces: Iterable[Record], limits: Sequence[tuple[float, float]]) -> list[_Window]:
    """Return the samples between pairs of times; a window may go on in the next piece."""
    empty = (np.empty(0), np.empty((0, 6)), np.empty((0, 3)), np.empty((0, 3, 3)))
    parts = [[empty] for _ in limits]
    for record in pieces:
        columns = (record.wrench_time, record.wrench, record.position, record.rotation)
        rows = np.searchsorted(record.time, np.array(limits).reshape(-1, 2))
        for part, (begin, end) in zip(parts, rows.tolist(), strict=True):
            a, b, c, d = (column[begin:end] for column in columns)
            part.append((a, b, c, d))
    found = []
    for part in parts:
        a, b, c, d = (np.concatenate(column) for column in zip(*part, strict=True))
        time, first = np.unique(a, return_index=True)
        found.append(_Window(time, b[first], c[first], d[first]))
    return found


def joined_touches(first: Touches, second: Touches) -> Touches:
    """Return the touches of two runs, the second later than the first."""
    columns: dict[str, Any] = {
        each.name: np.concatenate([getattr(first, each.name), getattr(second, each.name)])
        for each in fields(Touches)
    }
    later = float(first.time.max(initial=0.0)) - float(second.time.min(initial=0.0)) + _PAUSE_TIME
    columns["time"] = np.concatenate([first.time, second.time + later])
    return Touches(**columns)
