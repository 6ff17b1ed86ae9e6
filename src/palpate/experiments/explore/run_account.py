"""What a run shows of its own assumptions: whether the sensor's zero stayed, and how stiff the contact really was.

Both are felt besides the scan: before the first touch and after the last one the tip is in free air, where a
sensor shows its zero; and while a landing settles, force and place tell the stiffness. Where either is otherwise
than was assumed, the map is off by more than it could know, and says so.
"""

import math
from dataclasses import dataclass

import numpy as np

from palpate.errors import FloatArray
from palpate.runtime import FingerDescription, Phase, Record
from palpate.sensing.solver import contacts_from_wrenches

FREE_TIME = 0.05
"""[s] In free air, over which a zero is averaged: the last millimetre of a lift, far off the surface."""

SURE = 6.0
"""Standard errors beyond which a zero has moved: noise alone does that once in 1e9 runs."""

LIKE = 1.5
"""Stiffnesses up to so many times apart are not told apart: landings are short, their damping is not known."""

FEWEST = 20
"""Periods of a landing, below which it tells nothing."""

KNOWN_SHARE = 0.1
"""A landing tells the stiffness if its standard error is below this share of it."""

TOLD_SHARE = 0.01
"""Of the set force: less of a moved zero is not worth a sentence."""

ASKED = 200
"""Contacts that are asked what a moved zero does, evenly over the scan."""

MOST_PERCENT = 95.0
"""Of these contacts, it does so much at most."""

GROUND = (Phase.SETTLE.value, Phase.SCAN.value)
"""Phases in which the tip may touch for long."""


@dataclass(frozen=True, slots=True, eq=False)
class RunAccount:
    """What a run shows of its assumptions.

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


def run_account(
    record: Record,
    finger: FingerDescription,
    *,
    stiffness: float,
    kept: np.ndarray[tuple[int], np.dtype[np.bool_]],
) -> RunAccount:
    """Return what a run shows.

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
    return RunAccount(shift, found, offset, float(force.max()) if len(force) else 0.0)


def account_sentences(account: RunAccount, force: float, stiffness: float) -> tuple[str, ...]:
    """Return what was otherwise than assumed, and what to do.

    Args:
        account: Of the run.
        force: That was to be held [N].
        stiffness: Of the contact, as it was assumed [N/m].
    """
    said = []
    if account.zero_moved > TOLD_SHARE * force:
        said.append(
            f"The sensor's zero moved by {account.zero_moved:.2g} N meanwhile: the force was off by as much, and "
            "where it touched; tare it, let it warm up, or explore in shorter runs."
        )
    if other_stiffness(account.stiffness, stiffness):
        found = float(f"{account.stiffness:.2g}")
        said.append(
            f"Landing felt {1e-3 * found:g} kN/m, not the {1e-3 * stiffness:g} kN/m assumed: points may be off by "
            f"{1e3 * account.offset:.2g} mm; give --stiffness {found:g}."
        )
    return tuple(said)


def other_stiffness(found: float, assumed: float) -> bool:
    """Return whether a stiffness that was found is another than was assumed; False if none was found."""
    return math.isfinite(found) and not assumed / LIKE <= found <= assumed * LIKE


def zero_shift(record: Record) -> FloatArray:
    """Return by how much the sensor's zero moved, shape (6,) [N, N m]: see `RunAccount`."""
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
    # what still touches does not rest: its force changes on the way
    return np.asarray(shift) if (np.abs(shift) > SURE * error).any() else np.zeros(6)


def landed_stiffness(record: Record) -> float:
    """Return the stiffness of the contact by force = K depth + c rate, the median over all landings [N/m]."""
    settling = (record.phase == Phase.SETTLE.value) & record.touching & (record.status == 0)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], settling.astype(int), [0]])))
    found = [_stiffness(record, slice(a, b)) for a, b in edges.reshape(-1, 2) if b - a >= FEWEST]
    told = [each for each in found if math.isfinite(each)]
    return float(np.median(told)) if told else math.nan


def _stiffness(record: Record, rows: slice) -> float:
    force = record.normal_force[rows]
    normal = record.normal[rows].mean(axis=0)
    normal /= np.linalg.norm(normal)
    depth, rate = (record.position[rows] - record.position[rows][0]) @ normal, record.velocity[rows] @ normal
    if not np.ptp(depth) > 0.0:
        return math.nan
    columns = np.column_stack([depth - depth.mean(), rate - rate.mean()])
    scale = np.abs(columns).max(axis=0)
    scale[scale == 0.0] = 1.0  # a robot that tells no velocity, or always the same
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

    A contact that is said to be d beside where it is, with a normal turned by a, is off by d a / 2 on the tip and
    as much on an object as round as it; a normal force that is off moves the compression.

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
    wrench = record.wrench[felt[np.unique(np.linspace(0, len(felt) - 1, ASKED).round().astype(int))]]
    said, meant = (
        contacts_from_wrenches(finger.surface, wrench),
        contacts_from_wrenches(finger.surface, wrench - shift),
    )
    aside = np.linalg.norm(said.centroid - meant.centroid, axis=1)
    turn = np.linalg.norm(said.normal - meant.normal, axis=1)
    pressed = compliance * np.abs(said.normal_force - meant.normal_force)
    return float(np.nanpercentile(aside * turn + pressed, MOST_PERCENT))
