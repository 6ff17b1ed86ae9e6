"""What must hold of a command before it may reach the robot."""

import math
from dataclasses import dataclass
from typing import Any, Protocol

from palpate.errors import shown
from palpate.runtime.data import Command, Phase
from palpate.runtime.supervision.finding import Violation
from palpate.spatial import ZERO

ROUNDING = 1.0 + 1e-9
"""A controller that goes to the very limit is not over it."""


class CommandCondition(Protocol):
    """Something that should hold of a command."""

    def broken(self, command: Command, before: Command) -> Violation | None:
        """Return what is wrong, if anything; `before` is the last command that the robot got."""
        ...


@dataclass(frozen=True, slots=True)
class WellFormed:
    """It is a command, of finite numbers, for as many fingers as before. Comes first: the others rely on it."""

    def broken(self, command: object, before: Command) -> Violation | None:
        """See `CommandCondition`; takes whatever a controller returns."""
        if not isinstance(command, Command):
            return Violation("what the controller returned", shown(command), "a Command")
        try:
            x, y, z = command.velocity_base_tip
            finite = math.isfinite(x + y + z)
        except (TypeError, ValueError, OverflowError):
            return Violation("commanded velocity", shown(command.velocity_base_tip), "three finite numbers [m/s]")
        if not finite:
            return Violation("commanded velocity", f"({x}, {y}, {z}) m/s", "three finite numbers")
        if command.angular_velocity_base_tip is not ZERO:
            finding = self._turn(command.angular_velocity_base_tip)
            if finding is not None:
                return finding
        phase: object = command.phase  # nothing is certain yet
        if not isinstance(phase, Phase):
            return Violation("phase of the command", shown(phase), "a Phase")
        if phase is Phase.STOP:
            return Violation("phase of the command", "stop", "another one: this is the supervisor's")
        if command.finger_velocity is not None:
            finding = self._fingers(command.finger_velocity, before.grip_force)
            if finding is not None:
                return finding
        return None if command.grip_force is None else self._grip(command.grip_force, before.grip_force)

    @staticmethod
    def _turn(given: Any) -> Violation | None:
        try:
            x, y, z = given
            finite = math.isfinite(x + y + z)
        except (TypeError, ValueError, OverflowError):
            finite = False
        wanted = "three finite numbers [rad/s]"
        return None if finite else Violation("commanded angular velocity", shown(given), wanted)

    @staticmethod
    def _fingers(given: object, last: tuple[float, ...] | None) -> Violation | None:
        wanted = "three finite numbers [m/s], or None, for each finger"
        if not isinstance(given, tuple) or not given or (last is not None and len(given) != len(last)):
            return Violation("commanded finger velocity", shown(given), wanted)
        try:
            fine = all(velocity is None or _finite(*velocity) for velocity in given)
        except (TypeError, OverflowError):
            fine = False
        return None if fine else Violation("commanded finger velocity", shown(given), wanted)

    @staticmethod
    def _grip(grip: object, last: tuple[float, ...] | None) -> Violation | None:
        wanted = "one finite force, 0 N or above, for each finger"
        if not isinstance(grip, tuple) or not grip or (last is not None and len(grip) != len(last)):
            return Violation("commanded grip force", shown(grip), wanted)
        try:
            fine = all(0.0 <= force < math.inf for force in grip)
        except TypeError:
            fine = False
        return None if fine else Violation("commanded grip force", shown(grip), wanted)


@dataclass(frozen=True, slots=True)
class CommandedSpeed:
    """The tip is not sent faster than `limit` [m/s]."""

    limit: float

    def broken(self, command: Command, before: Command) -> Violation | None:
        """See `CommandCondition`."""
        x, y, z = command.velocity_base_tip
        speed = math.hypot(x, y, z)
        if speed <= self.limit * ROUNDING:
            return None
        return Violation("commanded speed", f"{speed:.4g} m/s", f"{self.limit:g} m/s")


@dataclass(frozen=True, slots=True)
class CommandedAcceleration:
    """The commanded velocity does not change faster than `limit` [m/s^2], period after `period` [s]."""

    limit: float
    period: float

    def broken(self, command: Command, before: Command) -> Violation | None:
        """See `CommandCondition`."""
        x, y, z = command.velocity_base_tip
        u, v, w = before.velocity_base_tip
        acceleration = math.hypot(x - u, y - v, z - w) / self.period
        if acceleration <= self.limit * ROUNDING:
            return None
        return Violation("commanded acceleration", f"{acceleration:.4g} m/s^2", f"{self.limit:g} m/s^2")


@dataclass(frozen=True, slots=True)
class CommandedTurn:
    """The tip is not commanded to turn faster than `speed` [rad/s], nor to change that faster than `acceleration`.

    Attributes:
        speed: [rad/s].
        acceleration: [rad/s^2], period after `period`.
        period: Control period [s].
    """

    speed: float
    acceleration: float
    period: float

    def broken(self, command: Command, before: Command) -> Violation | None:
        """See `CommandCondition`."""
        turn, last = command.angular_velocity_base_tip, before.angular_velocity_base_tip
        if turn is last:
            return None  # most robots never turn, and what was passed before is within the limits
        x, y, z = turn
        u, v, w = last
        speed = math.hypot(x, y, z)
        if not speed <= self.speed * ROUNDING:
            return Violation("commanded angular speed", f"{speed:.4g} rad/s", f"{self.speed:g} rad/s")
        acceleration = math.hypot(x - u, y - v, z - w) / self.period
        if acceleration <= self.acceleration * ROUNDING:
            return None
        return Violation(
            "commanded angular acceleration", f"{acceleration:.4g} rad/s^2", f"{self.acceleration:g} rad/s^2"
        )


@dataclass(frozen=True, slots=True)
class CommandedGrip:
    """No finger is commanded to press with more than `limit` [N]."""

    limit: float

    def broken(self, command: Command, before: Command) -> Violation | None:
        """See `CommandCondition`."""
        if command.grip_force is None or max(command.grip_force) <= self.limit * ROUNDING:
            return None
        return Violation("commanded grip force", f"{max(command.grip_force):.4g} N", f"{self.limit:g} N")


@dataclass(frozen=True, slots=True)
class CommandedFingerSpeed:
    """No fingertip is sent faster than `limit` [m/s]."""

    limit: float

    def broken(self, command: Command, before: Command) -> Violation | None:
        """See `CommandCondition`."""
        if command.finger_velocity is None:
            return None
        speed = max(0.0 if velocity is None else math.hypot(*velocity) for velocity in command.finger_velocity)
        if speed <= self.limit * ROUNDING:
            return None
        return Violation("commanded finger speed", f"{speed:.4g} m/s", f"{self.limit:g} m/s")


def _finite(x: float, y: float, z: float) -> bool:
    return math.isfinite(x + y + z)
