"""What is compared in every period beside the guards: motion, directions, forces and sliding, all compiled."""

from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.compiling import machine_code, njit
from palpate.errors import FloatArray
from palpate.runtime.data import Command, Observation
from palpate.runtime.supervision import direction_check, force_comparison, motion_check, sliding_check
from palpate.runtime.supervision.bounds import first_broken
from palpate.runtime.supervision.direction_check import disagreement, first_contact_fault, first_contact_finding
from palpate.runtime.supervision.finding import Violation
from palpate.runtime.supervision.force_comparison import force_fault, force_finding
from palpate.runtime.supervision.motion_check import motion_is_broken, unexplained_motion
from palpate.runtime.supervision.sliding_check import sliding_cosine

MOTION = 0
DIRECTIONS = MOTION + motion_check.MEMORY_SIZE
FORCES = DIRECTIONS + direction_check.MEMORY_SIZE
SLIDING = FORCES + force_comparison.MEMORY_SIZE
"""Where the memory of each begins."""

WHAT, WHICH, LIMIT = (
    SLIDING + sliding_check.MEMORY_SIZE,
    SLIDING + sliding_check.MEMORY_SIZE + 1,
    SLIDING + sliding_check.MEMORY_SIZE + 2,
)
"""Which comparison has found something, what it returned, and the limit of the contact force [N]."""

_MOTION, _DIRECTIONS, _FORCES, _SLIDING = 1, 2, 3, 4

UNCLEAR = -1
"""A bound of a guard does not hold."""


def fresh_memory(limit: float) -> FloatArray:
    """Return what comparisons remember at first, with the limit of the contact force [N]."""
    memory = np.zeros(LIMIT + 1)
    memory[SLIDING + 1], memory[LIMIT] = np.nan, limit
    return memory


@njit(error_model="numpy", cache=True)
def compare(
    row: FloatArray, known: bool, finger: int, approach: bool, command: FloatArray, memory: FloatArray
) -> int:
    """Compare in turn, until something is wrong; return what, 0 for nothing, and make the row the one before.

    Args:
        row: See `palpate.runtime.supervision.observed_row`, with the one before,
        known: if there is one.
        finger: Where the first finger stands.
        approach: Whether the last command was one of an approach.
        command: Its velocities, see `palpate.runtime.supervision.direction_check.first_contact_fault`.
        memory: Written.
    """
    what = 0
    which = 0.0
    if known and motion_is_broken(row, memory[MOTION:DIRECTIONS]):
        what = _MOTION
    if what == 0:
        which = float(first_contact_fault(row, finger, approach, command, memory[DIRECTIONS:FORCES]))
        what = _DIRECTIONS if which > 0.0 else 0
    if what == 0:
        which = float(force_fault(row, known, finger, memory[LIMIT], memory[FORCES:SLIDING]))
        what = _FORCES if which > 0.0 else 0
    if what == 0:
        which = sliding_cosine(row, finger, memory[SLIDING:WHAT])
        what = _SLIDING if which > -1.0 else 0
    memory[WHAT], memory[WHICH] = what, which
    size = len(row) // 2
    row[size:] = row[:size]
    return what


@njit(error_model="numpy", cache=True)
def judge(
    places: npt.NDArray[np.int16],
    limits: FloatArray,
    row: FloatArray,
    known: bool,
    finger: int,
    approach: bool,
    command: FloatArray,
    memory: FloatArray,
) -> int:
    """Return `UNCLEAR` if a bound does not hold, and what `compare` returns otherwise.

    Args:
        places: See `palpate.runtime.supervision.bounds.first_broken`,
        limits: likewise.
        row: See `compare`; so is the rest.
        known: See there.
        finger: See there.
        approach: See there.
        command: See there.
        memory: See there.
    """
    if first_broken(places, limits, row, known, 0, len(places)) >= 0:
        return UNCLEAR
    return compare(row, known, finger, approach, command, memory)


_GIVEN = (np.empty(2), True, 0, True, np.empty(12), np.empty(1))


def compiled_comparisons() -> tuple[Any, Any]:
    """Return `judge` and `compare`, compiled."""
    return machine_code(judge, np.empty((1, 4), np.int16), np.empty((1, 2)), *_GIVEN), machine_code(
        compare, *_GIVEN
    )


def comparison_finding(memory: FloatArray, now: Observation, last: Command) -> Violation:
    """Return what is wrong where `compare` says so.

    Args:
        memory: Of it.
        now: What is sensed.
        last: The command that led here.
    """
    what, which = memory[WHAT], float(memory[WHICH])
    if what == _MOTION:
        return unexplained_motion(memory[MOTION:DIRECTIONS])
    if what == _DIRECTIONS:
        return first_contact_finding(int(which), now, last, memory[DIRECTIONS:FORCES])
    if what == _FORCES:
        reported = now.arm.tip_force_base is not None
        return force_finding(int(which), reported, memory[FORCES:SLIDING], float(memory[LIMIT]))
    return disagreement("angle between sliding and friction", which)
