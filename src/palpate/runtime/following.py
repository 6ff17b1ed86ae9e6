"""Whether the tip goes where it is commanded to: an arm that reports states and follows no command does not.

This is for runs of a robot. Samples that are replayed under other options do not follow what is commanded here.
"""

from collections.abc import Callable
from typing import Protocol

from palpate.errors import PalpateError
from palpate.runtime.data import ArmSample, Command
from palpate.spatial import ZERO, Vector, dot, norm

MEMORY = 2.0
"""Time constant [s] with which commands and motion are forgotten: what is slower than `SMALLEST` in this time,
2 mm/s, is not judged."""

SMALLEST = 0.004
"""Commanded distance [m], beyond what the delay explains, at which the tip must have followed: above what a contact
and a servo give way at their force limit, 20 N at 10 kN/m."""

LONGEST_DELAY = 0.1
"""[s] from a command to its motion and the sample that shows it: of the slowest limit on the age of samples."""

LEAST_SHARE = 0.1
"""Of the commanded distance, along it: a speed slider may make an arm this slow."""


class FollowingError(PalpateError, RuntimeError):
    """The tip does not follow its commands."""


class Following(Protocol):
    """Compares commands with motion."""

    def take(self, command: Command, arm: ArmSample) -> None:
        """Take a command, and the state of the arm after it.

        Raises:
            FollowingError: The tip does not follow.
        """
        ...


class AnyMotion:
    """Compares nothing: for samples that were recorded under other commands. A `Following`."""

    def take(self, command: Command, arm: ArmSample) -> None:
        """See `Following`."""


class CommandedMotion:
    """The tip must follow: a `Following`.

    At a commanded speed v one that stands still is found `LONGEST_DELAY` + `SMALLEST` / v after its command, 0.3 s at
    20 mm/s.
    """

    def __init__(self, period: float, first: ArmSample) -> None:
        """Begin.

        Args:
            period: Of control [s].
            first: State of the arm before any command.
        """
        self._period, self._keep = period, 1.0 - period / MEMORY
        self._position = first.position_base_tip
        self._commanded: Vector = ZERO
        self._moved: Vector = ZERO
        self._speed = 0.0

    def take(self, command: Command, arm: ArmSample) -> None:
        """See `Following`."""
        keep, period = self._keep, self._period
        u, v, w = command.velocity_base_tip
        a, b, c = self._commanded
        self._commanded = commanded = (keep * a + period * u, keep * b + period * v, keep * c + period * w)
        x, y, z = position = arm.position_base_tip
        p, q, r = self._position
        d, e, f = self._moved
        self._moved = moved = (keep * d + x - p, keep * e + y - q, keep * f + z - r)
        self._position = position
        a, b, c = commanded
        if a * a + b * b + c * c > SMALLEST * SMALLEST:
            self._judge(command, commanded, moved)

    def _judge(self, command: Command, commanded: Vector, moved: Vector) -> None:
        distance = norm(commanded)
        along = dot(commanded, moved) / distance
        speed = norm(command.velocity_base_tip)
        if along >= LEAST_SHARE * (distance - SMALLEST - LONGEST_DELAY * speed):
            return
        raise FollowingError(
            f"the tip went {1e3 * along:.3g} mm along the {1e3 * distance:.3g} mm that were commanded; the limit is "
            f"{LEAST_SHARE:.0%} of what is beyond {1e3 * SMALLEST:g} mm and {1e3 * LONGEST_DELAY:g} ms; see whether the "
            "arm is stopped, held up, or described in another frame than it is commanded in"
        )


FollowingMaker = Callable[[float, ArmSample], Following]
"""From control period [s] and first state of the arm to what compares."""
