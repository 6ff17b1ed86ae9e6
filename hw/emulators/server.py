"""Interfaces of emulated devices: the plant that they move and measure, and the loop that serves them all.

The built-in plant is simple; an experiment may provide a MuJoCo scene. Neither depends on the other.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, TypeVar, runtime_checkable

from palpate.errors import InvalidValueError
from palpate.runtime.data import ArmSample, WrenchSample
from palpate.spatial import Vector

Fault = TypeVar("Fault", bound=StrEnum)


@dataclass(frozen=True, slots=True)
class ServoGoal:
    """Goal that the control table of a servo sets for its motor (current-based position control).

    Attributes:
        torque_on: Whether the motor drives; if not, it turns freely but for its gear's friction.
        position: Goal of the shaft [rad], 0 in the middle of its turn.
        current: Largest magnitude of the current [A].
        speed: Profile speed towards the goal [rad/s]; 0: unlimited.
    """

    torque_on: bool
    position: float
    current: float
    speed: float


@dataclass(frozen=True, slots=True)
class ServoState:
    """Measurements of a servo.

    Attributes:
        position: Shaft angle [rad], 0 in the middle of its turn.
        velocity: Shaft speed [rad/s].
        current: Signed current [A].
    """

    position: float
    velocity: float
    current: float


@dataclass(frozen=True, slots=True)
class PlantState:
    """Measurements of all devices at one instant.

    Attributes:
        time: Plant's clock [s].
        arm: Sample of the tool frame.
        wrenches: Sample of each force/torque sensor: its own frame, load on its tip side.
        servos: State of each servo of the hand.
    """

    time: float
    arm: ArmSample
    wrenches: tuple[WrenchSample, ...] = ()
    servos: tuple[ServoState, ...] = ()


class Plant(Protocol):
    """Mechanics behind the devices."""

    @property
    def period(self) -> float:
        """Time from one step to the next [s]."""
        ...

    def start(self) -> PlantState:
        """Begin, standing still."""
        ...

    def step(
        self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector, servos: tuple[ServoGoal, ...]
    ) -> PlantState:
        """Advance by one period.

        Args:
            velocity_base_tip: Velocity of the tool frame's origin, base frame [m/s].
            angular_velocity_base_tip: Angular velocity of the tool frame, base frame [rad/s].
            servos: Goals of the hand's servos; empty without a hand.
        """
        ...

    def close(self) -> None:
        """Release its resources."""
        ...


class Server(Protocol):
    """Device on a wire. Nothing in it blocks: the host calls when there is something to do.

    Times are of the host's wall clock, `time.monotonic` [s]; the plant's own time comes with its state.
    """

    @property
    def name(self) -> str:
        """Name of the device, for messages and faults."""
        ...

    @property
    def address(self) -> str:
        """Address for clients: an IP address, or the path of a terminal."""
        ...

    def files(self) -> Sequence[int]:
        """Return the file descriptors to wait for until they are readable; they may change from call to call."""
        ...

    def receive(self, file: int, now: float) -> None:
        """Read the bytes that have arrived at one of them, and reply."""
        ...

    def due(self) -> float:
        """Return when `tick` is to be called next [s]; infinity if it is not."""
        ...

    def tick(self, now: float) -> None:
        """Do the work that is due."""
        ...

    def take(self, state: PlantState) -> None:
        """Take the state of the plant; called after every one of its steps."""
        ...

    def inject(self, fault: str, value: float) -> str:
        """Switch a fault on or off and return a line that confirms it.

        Raises:
            InvalidValueError: If there is no such fault; the message lists those that exist.
        """
        ...

    def close(self) -> None:
        """Close all files."""
        ...


@runtime_checkable
class ArmServer(Server, Protocol):
    """Device that moves the plant's arm."""

    def velocity(self) -> tuple[Vector, Vector]:
        """Return the tool's velocity [m/s] and angular velocity [rad/s] for the plant's next step, base frame."""
        ...


@runtime_checkable
class ServoServer(Server, Protocol):
    """Device that drives the plant's servos."""

    def goals(self) -> tuple[ServoGoal, ...]:
        """Return the goals for the plant's next step."""
        ...


def fault_named(kinds: type[Fault], name: str) -> Fault:
    """Return the fault of a name.

    Raises:
        InvalidValueError: If there is none; the message lists those that exist.
    """
    try:
        return kinds(name)
    except ValueError:
        raise InvalidValueError(f"fault = {name!r}: must be one of {', '.join(kinds)}") from None


def whole_number(fault: str, value: float, largest: int = 2**31 - 1) -> int:
    """Return the value of a fault that counts.

    Raises:
        InvalidValueError: If it is not a whole number from 0 to `largest`.
    """
    if not 0 <= value <= largest or value != int(value):
        raise InvalidValueError(f"fault {fault} = {value!r}: must be a whole number, 0 to {largest}")
    return int(value)
