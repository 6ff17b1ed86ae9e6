"""Whether an arm moves as it reports: its positions must bear out its velocity."""

from math import hypot

from palpate.compiling import njit
from palpate.errors import FloatArray
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.runtime.supervision.observed_row import ARM_TIME, POSITION, TIME, VELOCITY

MEMORY = 0.5
"""Time constant [s] with which differences are forgotten, so that noise and filters of an arm do not add up."""

LARGEST_DIFFERENCE = 3e-3
"""Of displacement and integrated velocity [m]: an arm that creeps at 8 mm/s and reports rest reaches it in
0.7 s; below 6 mm/s, `LARGEST_DIFFERENCE` per `MEMORY`, it is not found."""

LONGEST_STEP = 0.02
"""From sample to sample [s]: over a longer gap velocity may have changed too much to be integrated."""


MEMORY_SIZE = 6
"""Numbers that it remembers: the difference (three), how far the tip went since the state was taken, and of the
last period the size of the difference and what it may be [m]."""

_UNCERTAIN, _SIZE, _MOST = 3, 4, 5


@njit(error_model="numpy", cache=True)
def motion_is_broken(row: FloatArray, memory: FloatArray) -> bool:
    """Compare the tip's displacement with the integral of its reported velocity; return whether they disagree.

    Args:
        row: See `palpate.runtime.supervision.observed_row`, with the one before.
        memory: Written, zeros at first, shape (`MEMORY_SIZE`,).
    """
    size = len(row) // 2
    time = row[ARM_TIME] - row[size + ARM_TIME]
    if not 0.0 < time <= LONGEST_STEP:
        return False
    keep, half = 1.0 - time / MEMORY, 0.5 * time
    for i in range(3):
        gone = row[POSITION + i] - row[size + POSITION + i]
        speeds = row[VELOCITY + i] + row[size + VELOCITY + i]
        memory[i] = keep * memory[i] + gone - half * speeds
    memory[_SIZE] = hypot(hypot(memory[0], memory[1]), memory[2])
    # when a state was taken is known to its age: meanwhile the tip went this far
    speed = hypot(hypot(row[VELOCITY], row[VELOCITY + 1]), row[VELOCITY + 2])
    memory[_UNCERTAIN] = max(keep * memory[_UNCERTAIN], (row[TIME] - row[ARM_TIME]) * speed)
    memory[_MOST] = LARGEST_DIFFERENCE + memory[_UNCERTAIN]
    return not memory[_SIZE] <= memory[_MOST]


def unexplained_motion(memory: FloatArray) -> Violation:
    """Return the finding that goes with a memory."""
    return Violation(
        "motion of the tip that the arm's reported velocity does not explain",
        f"{1e3 * memory[_SIZE]:.3g} mm within about {MEMORY:g} s",
        f"{1e3 * memory[_MOST]:.3g} mm: check the arm's state stream",
        Cause.DEVICE,
    )
