"""From a record to touches: the wrench at rest less that in the air just before, and where the sensor was.

The noise of these differences comes from means of blocks, so that correlation from sample to sample counts; it is
one for all touches, for the sensor is the same and they last equally long.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from palpate.controllers.touch_sequence import HeldSpan
from palpate.errors import FloatArray, InvalidValueError
from palpate.runtime import Record
from palpate.sensing.tip_calibration import Touches

BLOCKS = 8
"""Of each rest: each must be longer than what the noise is correlated over, and their scatter still known."""

LEAST_SD = (1e-4, 1e-4, 1e-4, 1e-6, 1e-6, 1e-6)
"""[N, N m] A mean is known no better, even of a sensor without noise: a tenth of what the finest resolve."""

AT_REST = 5e-5
"""By how much the tip may creep from the first to the second half of a rest [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Window:
    """Samples of one rest, each of the sensor once."""

    time: FloatArray
    wrench: FloatArray
    position: FloatArray
    rotation: FloatArray

    @property
    def block_variance(self) -> FloatArray:
        """Of the mean of the wrench, shape (6,)."""
        means = [block.mean(axis=0) for block in np.array_split(self.wrench, BLOCKS)]
        return np.asarray(np.var(means, axis=0, ddof=1) / BLOCKS)

    @property
    def creep(self) -> float:
        """From the first half to the second [m]."""
        half = len(self.position) // 2
        return float(np.linalg.norm(self.position[half:].mean(axis=0) - self.position[:half].mean(axis=0)))


@dataclass(frozen=True, slots=True, eq=False)
class FeltTouches:
    """What a run has felt.

    Attributes:
        touches: At rest, one row per force of each touch.
        step: Of which step of the sequence each row is, shape (n,).
        unrested: Steps that were left out, for the tip crept.
    """

    touches: Touches
    step: tuple[int, ...]
    unrested: tuple[int, ...]


def felt_touches(pieces: Iterable[Record], spans: Sequence[HeldSpan], targets: Sequence[int]) -> FeltTouches:
    """Return the touches of a run.

    Args:
        pieces: All periods of it, in order.
        spans: When the tip rested.
        targets: Target of each step of the sequence.

    Raises:
        InvalidValueError: Nothing was felt at rest.
    """
    windows = _windows(pieces, [(*span.air,) for span in spans] + [(*span.held,) for span in spans])
    air, held = windows[: len(spans)], windows[len(spans) :]
    found = [
        (span, before, at)
        for span, before, at in zip(spans, air, held, strict=True)
        if min(len(before.time), len(at.time)) >= 2 * BLOCKS
    ]
    rested = [each for each in found if each[2].creep <= AT_REST]
    if not rested:
        raise InvalidValueError(
            f"nothing was felt at rest: {len(spans)} rests, {len(found)} with {2 * BLOCKS} samples or more; "
            "are the things where they are thought to be (--plate, --rod, --ball)?"
        )
    variance = np.mean([before.block_variance + at.block_variance for _, before, at in rested], axis=0)
    sd = np.maximum(np.sqrt(variance), LEAST_SD)
    touches = Touches(
        np.array([targets[span.touch] for span, _, _ in rested]),
        np.array([at.wrench.mean(axis=0) - before.wrench.mean(axis=0) for _, before, at in rested]),
        np.tile(sd, (len(rested), 1)),
        np.array([Rotation.from_matrix(at.rotation).mean().as_matrix() for _, _, at in rested]),
        np.array([at.position.mean(axis=0) for _, _, at in rested]),
        np.array([at.time.mean() for _, _, at in rested]),
    )
    left_out = tuple(sorted({span.touch for span, _, at in found if at.creep > AT_REST}))
    return FeltTouches(touches, tuple(span.touch for span, _, _ in rested), left_out)


def _windows(pieces: Iterable[Record], limits: Sequence[tuple[float, float]]) -> list[_Window]:
    """The samples between some times; a window may go on in the next piece."""
    parts: list[list[_Window]] = [[] for _ in limits]
    for record in pieces:
        if not len(record):
            continue
        begins, ends = (np.searchsorted(record.time, [each[i] for each in limits]) for i in (0, 1))
        for part, begin, end in zip(parts, begins.tolist(), ends.tolist(), strict=True):
            part.extend(_cut(record, begin, end))
    return [_joined(part) for part in parts]


def _cut(record: Record, begin: int, end: int) -> Iterator[_Window]:
    if end > begin:
        rows = slice(begin, end)
        yield _Window(record.wrench_time[rows], record.wrench[rows], record.position[rows], record.rotation[rows])


def _joined(parts: Sequence[_Window]) -> _Window:
    if not parts:
        return _Window(np.empty(0), np.empty((0, 6)), np.empty((0, 3)), np.empty((0, 3, 3)))
    time = np.concatenate([each.time for each in parts])
    _, first = np.unique(time, return_index=True)
    wrench, position, rotation = (
        np.concatenate([getattr(each, name) for each in parts])[first]
        for name in ("wrench", "position", "rotation")
    )
    return _Window(time[first], wrench, position, rotation)


def joined_touches(first: Touches, second: Touches) -> Touches:
    """Return the touches of two runs, the second later than the first."""
    later = second.time + (float(first.time.max(initial=0.0)) - float(second.time.min(initial=0.0)) + BETWEEN)
    return Touches(
        np.concatenate([first.target, second.target]),
        np.concatenate([first.wrench, second.wrench]),
        np.concatenate([first.wrench_sd, second.wrench_sd]),
        np.concatenate([first.rotation, second.rotation]),
        np.concatenate([first.position, second.position]),
        np.concatenate([first.time, later]),
    )


BETWEEN = 10.0
"""[s] From the last of the first touches to the next ones, about."""
