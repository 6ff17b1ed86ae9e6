"""Whether a fingertip's sensor feels the force that the arm itself measures: a dead sensor does not.

With a sensor that reports a constant, noise alone or a tenth of the load the controller presses harder and harder.
An arm that measures the force on what its flange carries shows it: an e-Series UR has a sensor there.
"""

from math import hypot

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.runtime.supervision.finding import Violation
from palpate.runtime.supervision.observed_row import (
    ARM_FORCE,
    FINGERS,
    FORCE,
    HAND_JOINTS,
    HAS_ARM_FORCE,
    ROTATION,
    TIME,
)

ACCURACY = 4.0
"""Of an arm's own force [N]: UR5e, data sheet."""

GAIN_ERROR = 0.1
"""Share of the force by which both may differ besides: calibrations and cross-talk, 5 % each."""

LARGEST_IMPULSE = 0.05
"""Integral over time of what the difference is beyond both [N s]: a difference of 10 N is found after 10 ms. As
much comes of a touch with 10 N that one of them shows 10 ms after the other. White noise of 1.5 N on each axis of
the difference, at 500 Hz, comes to it by chance once in 1e24 samples (Lundberg's bound)."""

FIRST = 0.1
"""Time from the start of a run [s] in which the difference is taken for the arm's zero: a payload that is set a
little wrong, a sensor that was not zeroed. From then on both are judged."""

LONGEST_STEP = 0.02
"""From sample to sample [s]: over a longer gap, a difference counts for so long."""

REMEDY = "check the fingertip's sensor, and the payload and zero of the arm's own"


MEMORY_SIZE = 9
"""Numbers that it remembers: the arm's zero (three), of so many samples, since when, and the impulse; and of the
last period the arm's own force, the fingertip's and their difference [N]."""

_SAMPLES, _BEGAN, _IMPULSE, _OWN, _FELT, _APART = 3, 4, 5, 6, 7, 8

CAME_OR_WENT, TOO_LARGE, DIFFERENT = 1, 2, 3
"""What is wrong."""


@njit(error_model="numpy", cache=True)
def force_fault(row: FloatArray, known: bool, finger: int, limit: float, memory: FloatArray) -> int:
    """Compare the force of an arm's one finger with what the arm measures; silent without one of the two.

    Args:
        row: See `palpate.runtime.supervision.observed_row`, with the one before,
        known: if there is one.
        finger: Where the first finger stands.
        limit: Of the contact force [N], which holds for the arm's own, within its accuracy, too.
        memory: Written, zeros at first, shape (`MEMORY_SIZE`,).

    Returns:
        What is wrong; 0: nothing.
    """
    size = len(row) // 2
    if known and row[HAS_ARM_FORCE] != row[size + HAS_ARM_FORCE]:
        return CAME_OR_WENT
    if row[HAS_ARM_FORCE] == 0.0 or row[HAND_JOINTS] >= 0.0 or row[FINGERS] != 1.0:
        return 0
    r, f = row[ROTATION : ROTATION + 9], row[finger + FORCE : finger + FORCE + 3]
    u = row[ARM_FORCE] - r[0] * f[0] - r[1] * f[1] - r[2] * f[2]
    v = row[ARM_FORCE + 1] - r[3] * f[0] - r[4] * f[1] - r[5] * f[2]
    w = row[ARM_FORCE + 2] - r[6] * f[0] - r[7] * f[1] - r[8] * f[2]
    if not known or memory[_SAMPLES] == 0.0 or row[TIME] - memory[_BEGAN] <= FIRST:
        # the mean difference until now is taken for the arm's zero
        if memory[_SAMPLES] == 0.0:
            memory[_BEGAN] = row[TIME]
        memory[_SAMPLES] += 1.0
        share = 1.0 / memory[_SAMPLES]
        memory[0] += share * (u - memory[0])
        memory[1] += share * (v - memory[1])
        memory[2] += share * (w - memory[2])
        return 0
    x, y, z = row[ARM_FORCE] - memory[0], row[ARM_FORCE + 1] - memory[1], row[ARM_FORCE + 2] - memory[2]
    own = hypot(hypot(x, y), z)
    apart = hypot(hypot(u - memory[0], v - memory[1]), w - memory[2])
    time = min(row[TIME] - row[size + TIME], LONGEST_STEP)
    memory[_IMPULSE] = max(memory[_IMPULSE] + (apart - ACCURACY - GAIN_ERROR * own) * time, 0.0)
    memory[_OWN], memory[_FELT], memory[_APART] = own, hypot(hypot(f[0], f[1]), f[2]), apart
    if not own <= limit + ACCURACY:
        return TOO_LARGE
    return 0 if memory[_IMPULSE] <= LARGEST_IMPULSE else DIFFERENT


def force_finding(fault: int, reported: bool, memory: FloatArray, limit: float) -> Violation:
    """Return the finding that goes with what is wrong.

    Args:
        fault: What is.
        reported: Whether the arm now reports its force.
        memory: What is remembered.
        limit: Of the contact force [N].
    """
    if fault == CAME_OR_WENT:
        return Violation("the arm's own force", "new" if reported else "missing", "as in every period")
    own, felt, apart = memory[_OWN], memory[_FELT], memory[_APART]
    if fault == TOO_LARGE:
        return Violation(
            "contact force as the arm itself measures it",
            f"{own:.3g} N, by the fingertip's sensor {felt:.3g} N,",
            f"{limit:g} N, and {ACCURACY:g} N for its accuracy: {REMEDY}",
        )
    return Violation(
        "difference between the contact force that the arm itself measures and that of the fingertip's sensor",
        f"{apart:.3g} N ({own:.3g} N and {felt:.3g} N)",
        f"{ACCURACY:g} N and {GAIN_ERROR:.0%} for longer than a touch lasts: {REMEDY}",
    )
