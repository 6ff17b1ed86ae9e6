"""What must hold of a command before it may reach the robot."""

import math
from dataclasses import dataclass
from typing import Any, Protocol

from palpate.errors import shown
from palpate.runtime.data import Command, Phase
from palpate.runtime.supervision.bounds import Bound, Measure
from palpate.runtime.supervision.finding import Violation
from palpate.spatial import ZERO, norm, subtract

ROUNDING = 1.0 + 1e-9
"""A controller that goes to the very limit is not over it."""

VELOCITY, TURN, GRIP = 0, 3, 6
"""Places of a command's numbers in its row: three [m/s], three [rad/s], and a grip force for each finger [N]."""


class CommandCondition(Protocol):
    """Something that should hold of a command, as bounds on its row; before it stands what the robot got last."""

    def bounds(self, grips: int) -> tuple[Bound[Command], ...]:
        """Return them, for so many grip forces."""
        ...


def form_fault(command: object, grip: tuple[float, ...] | None) -> Violation | None:
    """Return what is wrong with the form of whatever a controller returned, if anything; all else relies on it.

    It must be a command, of finite numbers, for as many fingers as before.

    Args:
        command: That.
        grip: Of the last command that said something of it.
    """
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
        finding = _turn(command.angular_velocity_base_tip)
        if finding is not None:
            return finding
    phase: object = command.phase  # nothing is certain yet
    if not isinstance(phase, Phase):
        return Violation("phase of the command", shown(phase), "a Phase")
    if phase is Phase.STOP:
        return Violation("phase of the command", "stop", "another one: this is the supervisor's")
    if command.finger_velocity is not None:
        finding = _fingers(command.finger_velocity, grip)
        if finding is not None:
            return finding
    return None if command.grip_force is None else _grip(command.grip_force, grip)


def _turn(given: Any) -> Violation | None:
    try:
        x, y, z = given
        finite = math.isfinite(x + y + z)
    except (TypeError, ValueError, OverflowError):
        finite = False
    wanted = "three finite numbers [rad/s]"
    return None if finite else Violation("commanded angular velocity", shown(given), wanted)


def _fingers(given: object, last: tuple[float, ...] | None) -> Violation | None:
    wanted = "three finite numbers [m/s], or None, for each finger"
    if not isinstance(given, tuple) or not given or (last is not None and len(given) != len(last)):
        return Violation("commanded finger velocity", shown(given), wanted)
    try:
        fine = all(velocity is None or _finite(*velocity) for velocity in given)
    except (TypeError, OverflowError):
        fine = False
    return None if fine else Violation("commanded finger velocity", shown(given), wanted)


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

    def bounds(self, grips: int) -> tuple[Bound[Command], ...]:
        """See `CommandCondition`."""
        return (Bound(VELOCITY, self._told, 0.0, self.limit * ROUNDING, measure=Measure.LENGTH),)

    def _told(self, command: Command, before: Command | None) -> Violation:
        return Violation("commanded speed", f"{norm(command.velocity_base_tip):.4g} m/s", f"{self.limit:g} m/s")


@dataclass(frozen=True, slots=True)
class CommandedAcceleration:
    """The commanded velocity does not change faster than `limit` [m/s^2], period after `period` [s]."""

    limit: float
    period: float

    def bounds(self, grips: int) -> tuple[Bound[Command], ...]:
        """See `CommandCondition`."""
        most, last = self.limit * self.period * ROUNDING, GRIP + grips + VELOCITY
        return (Bound(VELOCITY, self._told, 0.0, most, last, Measure.LENGTH),)

    def _told(self, command: Command, before: Command | None) -> Violation:
        last = ZERO if before is None else before.velocity_base_tip
        acceleration = norm(subtract(command.velocity_base_tip, last)) / self.period
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

    def bounds(self, grips: int) -> tuple[Bound[Command], ...]:
        """See `CommandCondition`."""
        most, last = self.acceleration * self.period * ROUNDING, GRIP + grips + TURN
        return (
            Bound(TURN, self._too_fast, 0.0, self.speed * ROUNDING, measure=Measure.LENGTH),
            Bound(TURN, self._too_sudden, 0.0, most, last, Measure.LENGTH),
        )

    def _too_fast(self, command: Command, before: Command | None) -> Violation:
        speed = norm(command.angular_velocity_base_tip)
        return Violation("commanded angular speed", f"{speed:.4g} rad/s", f"{self.speed:g} rad/s")

    def _too_sudden(self, command: Command, before: Command | None) -> Violation:
        last = ZERO if before is None else before.angular_velocity_base_tip
        acceleration = norm(subtract(command.angular_velocity_base_tip, last)) / self.period
        limit = f"{self.acceleration:g} rad/s^2"
        return Violation("commanded angular acceleration", f"{acceleration:.4g} rad/s^2", limit)


@dataclass(frozen=True, slots=True)
class CommandedGrip:
    """No finger is commanded to press with more than `limit` [N]."""

    limit: float

    def bounds(self, grips: int) -> tuple[Bound[Command], ...]:
        """See `CommandCondition`."""
        most = self.limit * ROUNDING
        return tuple(Bound(GRIP + i, self._told, 0.0, most) for i in range(grips))

    def _told(self, command: Command, before: Command | None) -> Violation:
        grip = max(command.grip_force or (0.0,))
        return Violation("commanded grip force", f"{grip:.4g} N", f"{self.limit:g} N")


def finger_speed_fault(command: Command, limit: float) -> Violation | None:
    """Return what is wrong if a fingertip is sent faster than a limit [m/s], by a command of good form."""
    if command.finger_velocity is None:
        return None
    speed = max(0.0 if velocity is None else math.hypot(*velocity) for velocity in command.finger_velocity)
    if speed <= limit * ROUNDING:
        return None
    return Violation("commanded finger speed", f"{speed:.4g} m/s", f"{limit:g} m/s")


def _finite(x: float, y: float, z: float) -> bool:
    return math.isfinite(x + y + z)
