"""Whether the tip could still be stopped inside the workspace: braking begins before its bound, not behind it."""

import math

from palpate.runtime.data import Observation
from palpate.runtime.stopping import Stopping
from palpate.runtime.supervision.finding import Cause, Violation
from palpate.runtime.supervision.limits import Limits
from palpate.spatial import Vector, add_scaled, norm


class WorkspaceCheck:
    """Compares where the tip would come to rest, if it were stopped now, with the workspace.

    On each axis it goes on with the commanded velocity or the measured one, whichever leads farther out: a tip
    that was turned off its path still goes on along it.
    """

    def __init__(self, limits: Limits, stopping: Stopping) -> None:
        """Take the workspace, and how the tip comes to rest."""
        self._lower, self._upper, self._stopping = limits.workspace_lower, limits.workspace_upper, stopping

    def broken(self, now: Observation, velocity: Vector) -> Violation | None:
        """Return what is wrong with commanding a velocity of the tip [m/s, base frame], if anything."""
        arm = now.arm
        position, age = arm.position_base_tip, now.time - arm.time
        axes = tuple(zip(velocity, arm.velocity_base_tip, strict=True))
        # it has gone on since it was seen there
        time = age + self._stopping.equivalent_time(math.hypot(*(max(abs(v), abs(u)) for v, u in axes)))
        for at, (v, u), low, high in zip(position, axes, self._lower, self._upper, strict=True):
            up, down = max(v, u), min(v, u)
            if (up > 0.0 and at + time * up > high) or (down < 0.0 and at + time * down < low):
                break
        else:
            return None
        x, y, z = add_scaled(position, time, max(velocity, arm.velocity_base_tip, key=norm))
        return Violation(
            "tip position after a stop from its velocity",
            f"({x:.4f}, {y:.4f}, {z:.4f}) m",
            f"between {self._lower} m and {self._upper} m",
            Cause.MOTION,
        )
