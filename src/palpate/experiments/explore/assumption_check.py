"""Checks of a run's assumptions: whether the sensor's zero stayed, and how stiff the contact really was.

Both are measured outside the scan: before the first touch and after the last one the tip is in free air, where
the sensor shows its zero; and while a landing settles, force and position give the stiffness. Where either
differs from what was assumed, the error budget of the map grows, and the report states it.
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime import FingerDescription, Phase, Record
from palpate.sensing.solver import contacts_from_wrenches

FREE_TIME = 0.05
"""[s] In free air, over which a zero is averaged: the last millimetre of a lift, far off the surface."""

SIGNIFICANT = 6.0
"""Standard errors beyond which a zero has moved: noise alone does that once in 1e9 runs."""

SAME_RATIO = 1.5
"""Largest ratio of stiffnesses that count as equal: landings are short, and their damping is unknown."""

FEWEST = 20
"""Least periods of a landing from which its stiffness is estimated."""

KNOWN_SHARE = 0.1
"""Largest relative standard error of a landing's stiffness at which it counts."""

REPORTED_SHARE = 0.01
"""Least shift of the zero, over the set force, that is reported."""

EVALUATED = 200
"""Contacts at which the effect of a moved zero is evaluated, evenly over the scan."""

MOST_PERCENT = 95.0
"""Percentile of that effect that the budget takes."""

GROUND = (Phase.SETTLE.value, Phase.SCAN.value)
"""Phases in which the tip may touch for long."""


@dataclass(frozen=True, slots=True, eq=False)
class AssumptionCheck:
    """Sensor zero and contact stiffness as a run showed them.

    Attributes:
        zero_shift: By how much what the sensor shows in free air moved from the beginning to the end, sensor
            frame, shape (6,) [N, N m]; zero where it did not move beyond its noise, or nobody can tell.
        stiffness: Of the contact, as landings show it [N/m]; NaN where they tell nothing.
        offset: How far off the points of a map may be because of both [m].
        most_force: Largest force that was felt [N].
    """

    zero_shift: FloatArray
    stiffness: float
    offset: float
    most_force: float

    @property
    def zero_moved(self) -> float:
        """Length of the force by which the zero moved [N]."""
        return float(np.linalg.norm(self.zero_shift[:3]))


def assumption_check(
    record: Record,
    finger: FingerDescription,
    *,
    stiffness: float,
    kept: np.ndarray[tuple[int], np.dtype[np.bool_]],
) -> AssumptionCheck:
    """Return what a run shows of its assumptions.

    Args:
        record: Of the run.
        finger: That felt it.
        stiffness: Of the contact, as it was assumed [N/m].
        kept: Which periods gave a point of the map, shape (n,).
    """
    shift, found = zero_shift(record), landed_stiffness(record)
    offset = zero_offset(record, finger, shift, kept, 1.0 / stiffness)
    if other_stiffness(found, stiffness):
        pressed = float(np.median(record.normal_force[kept])) if kept.any() else 0.0
        offset += pressed * abs(1.0 / found - 1.0 / stiffness)
    force = np.linalg.norm(record.wrench[:, :3], axis=1)
    return AssumptionCheck(shift, found, offset, float(force.max()) if len(force) else 0.0)


def assumption_sentences(checked: AssumptionCheck, force: float, stiffness: float) -> tuple[str, ...]:
    """Return which assumptions did not hold, and what to do.

    Args:
        checked: Of the run.
        force: That was to be held [N].
        stiffness: Of the contact, as it was assumed [N/m].
    """
    sentences = []
    if checked.zero_moved > REPORTED_SHARE * force:
        sentences.append(
            f"The sensor's zero moved by {checked.zero_moved:.2g} N meanwhile: the force was off by as much, and "
            "where it touched; tare it, let it warm up, or explore in shorter runs."
        )
    if other_stiffness(checked.stiffness, stiffness):
        found = float(f"{checked.stiffness:.2g}")
        sentences.append(
            f"Landing felt {1e-3 * found:g} kN/m, not the {1e-3 * stiffness:g} kN/m assumed: points may be off by "
            f"{1e3 * checked.offset:.2g} mm; give --stiffness {found:g}."
        )
    return tuple(sentences)


def other_stiffness(found: float, assumed: float) -> bool:
    """Return whether a stiffness that was found is another than was assumed; False if none was found."""
    return math.isfinite(found) and not assumed / SAME_RATIO <= found <= assumed * SAME_RATIO


def zero_shift(record: Record) -> FloatArray:
    """Return by how much the sensor's zero moved, shape (6,) [N, N m]: see `AssumptionCheck`."""
    ground = np.flatnonzero(np.isin(record.phase, GROUND))
    if not len(ground):
        return np.zeros(6)
    before, after = record.wrench[: ground[0]], record.wrench[ground[-1] + 1 :]
    count = round(FREE_TIME / max(float(np.median(np.diff(record.time))), 1e-9)) if len(record) > 1 else 0
    if count < 2 or len(before) < 2 * count or len(after) < 2 * count:
        return np.zeros(6)
    first, last = before[count : 2 * count], after[-count:]
    shift = last.mean(axis=0) - first.mean(axis=0)
    error = np.sqrt((first.var(axis=0) + last.var(axis=0)) / count)
    # a contact that persists is not at rest: its force changes meanwhile
    return np.asarray(shift) if (np.abs(shift) > SIGNIFICANT * error).any() else np.zeros(6)


def landed_stiffness(record: Record) -> float:
    """Return the stiffness of the contact by force = K depth + c rate, the median over all landings [N/m]."""
    settling = (record.phase == Phase.SETTLE.value) & record.touching & (record.status == 0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], settling.astype(int), [0]])))
    found = [_stiffness(record, slice(a, b)) for a, b in edges.reshape(-1, 2) if b - a >= FEWEST]
    known = [each for each in found if math.isfinite(each)]
    return float(np.median(known)) if known else math.nan


def _stiffness(record: Record, rows: slice) -> float:
    force = record.normal_force[rows]
    normal = record.normal[rows].mean(axis=0)
    normal /= np.linalg.norm(normal)
    depth, rate = (record.position[rows] - record.position[rows][0]) @ normal, record.velocity[rows] @ normal
    if not np.ptp(depth) > 0.0:
        return math.nan
    columns = np.column_stack([depth - depth.mean(), rate - rate.mean()])
    scale = np.abs(columns).max(axis=0)
    scale[scale == 0.0] = 1.0  # a robot without velocity measurement, or at constant velocity
    columns = columns / scale
    solved, *_ = np.linalg.lstsq(columns, force - force.mean(), rcond=None)
    left = force - force.mean() - columns @ solved
    inverse = np.linalg.pinv(columns.T @ columns)
    error = math.sqrt(float(inverse[0, 0]) * float(left @ left) / (len(force) - 3))
    return float(solved[0] / scale[0]) if error < KNOWN_SHARE * solved[0] else math.nan


def zero_offset(
    record: Record,
    finger: FingerDescription,
    shift: FloatArray,
    kept: np.ndarray[tuple[int], np.dtype[np.bool_]],
    compliance: float,
) -> float:
    """Return how far points come out off their place because of a moved zero [m].

    A contact estimated a distance d off, with a normal turned by a, is off by d a / 2 on the tip and by as much on
    an object of the same curvature; an error of the normal force changes the compression.

    Args:
        record: Of the run.
        finger: That felt it.
        shift: Of the zero, shape (6,) [N, N m].
        kept: Which periods gave a point of the map, shape (n,).
        compliance: Of tip and object together [m/N].
    """
    felt = np.flatnonzero(kept)
    if not len(felt) or not shift.any():
        return 0.0
    wrench = record.wrench[felt[np.unique(np.linspace(0, len(felt) - 1, EVALUATED).round().astype(int))]]
    shifted, corrected = (
        contacts_from_wrenches(finger.surface, wrench),
        contacts_from_wrenches(finger.surface, wrench - shift),
    )
    aside = np.linalg.norm(shifted.centroid - corrected.centroid, axis=1)
    turn = np.linalg.norm(shifted.normal - corrected.normal, axis=1)
    pressed = compliance * np.abs(shifted.normal_force - corrected.normal_force)
    return float(np.nanpercentile(aside * turn + pressed, MOST_PERCENT))
