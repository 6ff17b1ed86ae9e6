"""Whether the tip goes where it is commanded to: an arm that reports states and follows no command does not.

This is for runs of a robot. Samples that are replayed under other options do not follow what is commanded here.
"""

from collections.abc import Callable
from functools import partial
from math import sqrt
from typing import Protocol

import numpy as np

from palpate.compiling import machine_code, njit
from palpate.errors import FloatArray, PalpateError
from palpate.runtime.data import ArmSample, Command, Observation, Sample

MEMORY = 2.0
"""Time constant [s] with which commands and motion are forgotten: what is slower than `SMALLEST` in this time,
2 mm/s, is not judged."""

SMALLEST = 0.004
"""Commanded distance [m] from which on the tip must have followed: above what contact and servo give way at their
force limit, 20 N at 10 kN/m."""

LONGEST_DELAY = 0.1
"""[s] from a command to its motion and the sample that shows it: of the slowest limit on the age of samples."""

STEADY = 0.5
"""Cosine of the angle between what was commanded until now and until `LONGEST_DELAY` ago, below which the tip may
be anywhere in between."""

LEAST_SHARE = 0.1
"""Of the commanded distance, along it: a speed slider may make an arm this slow."""


class FollowingError(PalpateError, RuntimeError):
    """The tip does not follow its commands."""


class Following(Protocol):
    """Compares commands with motion."""

    def take(self, command: Command, before: Observation, after: Sample) -> None:
        """Take a command, what was observed when it was given, and the sample that the robot gave after it.

        Raises:
            FollowingError: The tip does not follow.
        """
        ...


class AnyMotion:
    """Compares nothing: for samples that were recorded under other commands. A `Following`."""

    def __init__(self, period: float, first: ArmSample) -> None:
        """As of `CommandedMotion`."""

    def take(self, command: Command, before: Observation, after: Sample) -> None:
        """See `Following`."""


POSITION, MOVED, NEWEST, WANTED, ALONG = 0, 3, 6, 7, 8
"""Where numbers of the memory stand: last position (three), motion (three), which of the commanded distances is
the newest, and what was compared last."""


@njit(error_model="numpy", cache=True)
def is_left_behind(
    commanded: FloatArray,
    memory: FloatArray,
    keep: float,
    period: float,
    u: float,
    v: float,
    w: float,
    x: float,
    y: float,
    z: float,
) -> bool:
    """Take a period; return whether the tip does not follow.

    Args:
        commanded: Distances commanded until each of the last periods, slowly forgotten, written, shape (n, 3).
        memory: Laid out as the constants above say, written.
        keep: Share that is not forgotten within a period.
        period: Of control [s].
        u: Commanded velocity [m/s], base frame,
        v: likewise,
        w: likewise.
        x: Position of the tip after it [m],
        y: likewise,
        z: likewise.
    """
    last = int(memory[NEWEST])
    newest = (last + 1) % len(commanded)
    oldest = (newest + 1) % len(commanded)
    memory[NEWEST] = newest
    size = along = wanted = distance = 0.0
    for i, (speed, place) in enumerate(((u, x), (v, y), (w, z))):
        commanded[newest, i] = keep * commanded[last, i] + period * speed
        memory[MOVED + i] = keep * memory[MOVED + i] + place - memory[POSITION + i]
        memory[POSITION + i] = place
        size += commanded[newest, i] * commanded[newest, i]
        distance += commanded[oldest, i] * commanded[oldest, i]
        wanted += commanded[oldest, i] * commanded[newest, i]
        along += commanded[oldest, i] * memory[MOVED + i]
    if not distance > SMALLEST * SMALLEST:
        return False
    distance = sqrt(distance)
    memory[WANTED], memory[ALONG] = wanted / distance, along / distance
    if memory[WANTED] < STEADY * sqrt(size):
        return False
    return bool(memory[ALONG] < LEAST_SHARE * (min(memory[WANTED], distance) - SMALLEST))


class CommandedMotion:
    """The tip must follow: a `Following`.

    At a commanded speed v a tip that stands still is found `LONGEST_DELAY` + `SMALLEST` / v after its command:
    0.3 s at 20 mm/s.
    """

    def __init__(self, period: float, first: ArmSample) -> None:
        """Begin.

        Args:
            period: Of control [s].
            first: State of the arm before any command.
        """
        commanded = np.zeros((max(1, round(LONGEST_DELAY / period)) + 1, 3))
        self._memory: FloatArray = np.zeros(ALONG + 1)
        self._memory[POSITION : POSITION + 3] = first.position_base_tip
        given = (commanded, self._memory, 1.0 - period / MEMORY, period)
        self._is_left_behind = partial(machine_code(is_left_behind, *given, *(0.0,) * 6), *given)

    def take(self, command: Command, before: Observation, after: Sample) -> None:
        """See `Following`."""
        u, v, w = command.velocity_base_tip
        x, y, z = after.arm.position_base_tip
        if self._is_left_behind(u, v, w, x, y, z):
            wanted, along = 1e3 * self._memory[WANTED], 1e3 * self._memory[ALONG]
            raise FollowingError(
                f"the tip went {along:.3g} mm where {wanted:.3g} mm were commanded; the limit is "
                f"{LEAST_SHARE:.0%} of what is beyond {1e3 * SMALLEST:g} mm, after {LONGEST_DELAY:g} s; see "
                "whether the arm is stopped, held up, or described in another frame than it is commanded in"
            )


FollowingMaker = Callable[[float, ArmSample], Following]
"""From control period [s] and first state of the arm to what compares."""
