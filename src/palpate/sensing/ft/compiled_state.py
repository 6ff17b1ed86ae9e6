"""What a sensor's samples leave behind, compiled: how long channels rest, whether it touches, how zeros drift."""

from math import hypot

from palpate.compiling import njit

TOUCH, RELEASE, TOUCH_SAMPLES, RELEASE_SAMPLES = 0, 1, 2, 3
"""Where the numbers of a `ContactDetector` stand: forces [N], and so many samples in a row."""

TOUCHING, AGAINST = 0, 1
"""Where its memory stands: whether it touches, and how many samples in a row said otherwise."""

SEEN, SAMPLES = 6, 6
"""Where a `DriftWatch` counts samples, behind the mean; and so many make it, behind the limits."""


@njit(error_model="numpy", cache=True)
def longest_rest(last, unchanged, reading):
    """Count since when each channel has not changed; return the largest count.

    Args:
        last: The last reading, shape (k,), written; no numbers at first.
        unchanged: Counts, shape (k,), written.
        reading: k finite numbers.
    """
    longest = 0.0
    for i in range(len(reading)):
        unchanged[i] = unchanged[i] + 1.0 if reading[i] == last[i] else 1.0
        last[i] = reading[i]
        longest = max(longest, unchanged[i])
    return longest


@njit(error_model="numpy", cache=True)
def touches(detector, memory, x, y, z):
    """Return whether it touches, given the contact force of a sample; one that is no number changes nothing.

    Args:
        detector: Laid out as the constants above say; so is
        memory: which is written.
        x: Force [N],
        y: likewise,
        z: likewise.
    """
    force, touching = hypot(hypot(x, y), z), memory[TOUCHING] != 0.0
    contrary = force < detector[RELEASE] if touching else force > detector[TOUCH]
    memory[AGAINST] = memory[AGAINST] + 1.0 if contrary else 0.0
    if memory[AGAINST] >= detector[RELEASE_SAMPLES if touching else TOUCH_SAMPLES]:
        touching = not touching
        memory[TOUCHING], memory[AGAINST] = touching, 0.0
    return touching


@njit(error_model="numpy", cache=True)
def drifting_axis(limits, memory, wrench):
    """Take the contact wrench of a sample without touch; return the first axis whose mean is too large, or -1.

    Args:
        limits: Of each axis, and how many samples make the mean, shape (7,).
        memory: The mean, and how many samples were taken, shape (7,), written.
        wrench: Six numbers [N, N m].
    """
    memory[SEEN] += 1.0
    # plain average at first, then with a constant memory
    gain = 1.0 / min(memory[SEEN], limits[SAMPLES])
    found = -1
    for i in range(6):
        memory[i] = memory[i] + gain * (wrench[i] - memory[i])
        if found < 0 and abs(memory[i]) > limits[i]:
            found = i
    return found if memory[SEEN] >= limits[SAMPLES] else -1
