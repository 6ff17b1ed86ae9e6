"""Whether the tip goes where it is commanded to: an arm that reports states and follows no command does not.

This is for runs of a robot. Samples that are replayed under other options do not follow what is commanded here.
"""

from collections import deque
from collections.abc import Callable
from typing import Protocol

from palpate.errors import PalpateError
from palpate.runtime.data import ArmSample, Command, Observation, Sample
from palpate.spatial import ZERO, Vector, dot, norm

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
        self._period, self._keep = period, 1.0 - period / MEMORY
        self._position = first.position_base_tip
        self._commanded: deque[Vector] = deque([ZERO], maxlen=max(1, round(LONGEST_DELAY / period)) + 1)
        self._moved: Vector = ZERO

    def take(self, command: Command, before: Observation, after: Sample) -> None:
        """See `Following`."""
        keep, period, recent = self._keep, self._period, self._commanded
        u, v, w = command.velocity_base_tip
        a, b, c = recent[-1]
        recent.append((keep * a + period * u, keep * b + period * v, keep * c + period * w))
        x, y, z = self._position
        self._position = p, q, r = after.arm.position_base_tip
        d, e, f = self._moved
        self._moved = (keep * d + p - x, keep * e + q - y, keep * f + r - z)
        a, b, c = recent[0]
        if a * a + b * b + c * c > SMALLEST * SMALLEST:
            self._judge(recent[0], recent[-1])

    def _judge(self, before: Vector, now: Vector) -> None:
        distance = norm(before)
        wanted = dot(before, now) / distance
        if wanted < STEADY * norm(now):
            return
        along = dot(before, self._moved) / distance
        if along < LEAST_SHARE * (min(wanted, distance) - SMALLEST):
            raise FollowingError(
                f"the tip went {1e3 * along:.3g} mm where {1e3 * wanted:.3g} mm were commanded; the limit is "
                f"{LEAST_SHARE:.0%} of what is beyond {1e3 * SMALLEST:g} mm, after {LONGEST_DELAY:g} s; see "
                "whether the arm is stopped, held up, or described in another frame than it is commanded in"
            )


FollowingMaker = Callable[[float, ArmSample], Following]
"""From control period [s] and first state of the arm to what compares."""
