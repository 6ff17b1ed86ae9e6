"""Limits that no controller can pass."""

import math
from dataclasses import dataclass

from palpate.errors import InvalidValueError, positive
from palpate.runtime.data import Command, Observation, Phase
from palpate.spatial import ZERO, Vector, norm, rotate, scale

FASTEST = 0.25
"""Default speed limit [m/s]: the reduced speed of ISO 10218-1:2011, section 5.6.2."""

RETREAT_SPEED = 0.02
"""With which the tip gives way to a force over its limit [m/s]."""


@dataclass(frozen=True, slots=True)
class Limits:
    """What must not be exceeded.

    Attributes:
        force: Length of any finger's contact force [N].
        speed: Commanded speed of the tip [m/s].
        workspace_lower: Smallest position of the tip frame, base frame [m].
        workspace_upper: Largest position of the tip frame, base frame [m].
    """

    force: float = 20.0
    speed: float = FASTEST
    workspace_lower: Vector = (-1.0, -1.0, -1.0)
    workspace_upper: Vector = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        positive("force limit", self.force, "N")
        positive("speed limit", self.speed, "m/s")
        for axis, lower, upper in zip("xyz", self.workspace_lower, self.workspace_upper, strict=True):
            if not lower < upper:
                raise InvalidValueError(f"workspace along {axis} is [{lower:g}, {upper:g}] m: must not be empty")


@dataclass(frozen=True, slots=True)
class Trip:
    """Why the supervisor stopped the robot.

    Attributes:
        time: When [s].
        measure: What was out of bounds.
        value: Its value, with unit.
        limit: The limit it broke, with unit.
    """

    time: float
    measure: str
    value: str
    limit: str

    def __str__(self) -> str:
        """One line for a person."""
        return f"{self.measure} was {self.value} at t = {self.time:.3f} s; the limit is {self.limit}"


class Supervisor:
    """Passes commands on until something is out of bounds; from then on it only lets the robot stand still.

    Attributes:
        trip: Why it stopped the robot; None while all is well.
    """

    def __init__(self, limits: Limits | None = None) -> None:
        """Take the limits, or the defaults of `Limits`."""
        self.limits = limits or Limits()
        self.trip: Trip | None = None

    def start(self) -> None:
        """Forget an earlier trip: a new run begins."""
        self.trip = None

    def check(self, now: Observation, command: Command) -> Command:
        """Return the command, or a stop."""
        if self.trip is None:
            self.trip = self._find(now, command)
        return command if self.trip is None else Command(ZERO, Phase.HOLD)

    def give_way(self, now: Observation) -> Command:
        """Return how to get out of a force over its limit: slowly along it, which is away from the object."""
        for finger in now.fingers:
            force = finger.wrench[:3]
            size = norm(force)
            if self.limits.force < size < math.inf:
                away = rotate(now.arm.rotation_base_tip, scale(RETREAT_SPEED / size, force))
                return Command(away, Phase.HOLD)
        return Command(ZERO, Phase.HOLD)

    def _find(self, now: Observation, command: Command) -> Trip | None:
        limits, time = self.limits, now.time
        x, y, z = now.arm.position_base_tip
        # a sum is finite unless one of its terms is not, or they overflow, which is no better
        if not math.isfinite(x + y + z + sum(now.arm.velocity_base_tip)):
            return Trip(time, "arm state", "not finite", "finite numbers")
        for finger in now.fingers:
            force = norm(finger.wrench[:3])
            if not math.isfinite(sum(finger.wrench)):
                return Trip(time, "wrench", "not finite", "finite numbers")
            if not finger.health.ok:
                return Trip(time, "force/torque sensor", str(finger.health), "a healthy sensor")
            if force > limits.force:
                return Trip(time, "contact force", f"{force:.2f} N", f"{limits.force:g} N")
        u, v, w = command.velocity_base_tip
        speed = math.sqrt(u * u + v * v + w * w)
        if not speed <= limits.speed:  # also catches NaN
            return Trip(time, "commanded speed", f"{speed:.3f} m/s", f"{limits.speed:g} m/s")
        lower, upper = limits.workspace_lower, limits.workspace_upper
        if not (lower[0] <= x <= upper[0] and lower[1] <= y <= upper[1] and lower[2] <= z <= upper[2]):
            return Trip(time, "tip position", f"({x:.4f}, {y:.4f}, {z:.4f}) m", f"between {lower} m and {upper} m")
        return None
