"""What a rig is assembled from: an arm, a hand, force/torque sensors, behind small interfaces."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

from palpate.errors import InvalidValueError
from palpate.runtime.data import ArmSample, HandSample
from palpate.runtime.supervision import Cause
from palpate.spatial import Vector


class DeviceError(OSError):
    """A device was lost, or reports that it must not go on. The message names it and the remedy.

    Attributes:
        cause: What has to be seen to.
    """

    cause = Cause.DEVICE

    def __init__(self, device: str, problem: str, remedy: str) -> None:
        """Take the device's name, what is wrong, and what to do about it."""
        super().__init__(f"{device}: {problem}; {remedy}")
        self.device, self.problem, self.remedy = device, problem, remedy


class WireError(DeviceError):
    """Nothing comes from a device, or nothing that can be read: cable, network or power."""

    cause = Cause.WIRE


@dataclass(frozen=True, slots=True)
class SensorReading:
    """The newest record of a force/torque sensor.

    Attributes:
        time: When it was sampled, `time.monotonic` [s].
        wrench: Load on its tip side, its own frame [N, N m]; raw channels if it is not calibrated.
        healthy: Whether the sensor itself says that the record is good.
        lost: Records that have been lost since the start.
    """

    time: float
    wrench: tuple[float, ...]
    healthy: bool
    lost: int


class Device(Protocol):
    """Something on a wire. Times are of `time.monotonic` [s]."""

    @property
    def name(self) -> str:
        """For messages: "UR arm at 192.168.0.10"."""
        ...

    def start(self) -> None:
        """Connect, check versions and settings, come to a safe rest.

        Raises:
            DeviceError: It cannot be reached, or is not fit to run.
        """
        ...

    def close(self) -> None:
        """Leave it safe: an arm stopped, a hand as its settings say; may be called more than once, at any time."""
        ...


class ArmDevice(Device, Protocol):
    """An arm that follows velocities of its tool frame."""

    def read(self) -> ArmSample:
        """Return the newest state.

        Raises:
            DeviceError: It is lost, stopped, or silent for too long.
        """
        ...

    def move(self, velocity_base_tip: Vector, angular_velocity_base_tip: Vector) -> None:
        """Move with these velocities until commanded otherwise, or until the watchdog stops it.

        Raises:
            DeviceError: As `read`.
        """
        ...


@runtime_checkable
class StoppedArm(Protocol):
    """An arm whose state can be read while it does not go on, as in a protective stop. Optional."""

    def read_stopped(self) -> ArmSample:
        """Return the newest state, whatever the arm reports to be wrong.

        Raises:
            DeviceError: There is none.
        """
        ...


def read_stopped(arm: ArmDevice) -> ArmSample:
    """Return an arm's newest state, if it can be had also where the arm does not go on.

    Raises:
        DeviceError: It cannot.
    """
    return arm.read_stopped() if isinstance(arm, StoppedArm) else arm.read()


class HandDevice(Device, Protocol):
    """A hand whose fingers press with forces."""

    def read(self) -> HandSample:
        """Return the state of one exchange on the bus.

        Raises:
            DeviceError: A servo is silent, or has shut down.
        """
        ...

    def press(self, grip_force: tuple[float, ...]) -> None:
        """Let each finger press with a force [N]; 0 opens the hand."""
        ...


@runtime_checkable
class MovingHand(HandDevice, Protocol):
    """A hand whose fingertips can be moved besides. Optional."""

    def move(self, finger_velocity: tuple[Vector | None, ...] | None) -> None:
        """Move fingertips until commanded otherwise, or until the watchdog stops them.

        Args:
            finger_velocity: Of each fingertip, in its sensor frame [m/s]; None for a finger, or for all: it only
                presses.

        Raises:
            InvalidValueError: A finger cannot move so.
        """
        ...


def move_fingers(hand: HandDevice | None, finger_velocity: tuple[Vector | None, ...] | None) -> None:
    """Move the fingertips of a hand, as in `MovingHand`.

    Raises:
        InvalidValueError: There is no hand that moves them.
    """
    move = getattr(hand, "move", None)  # isinstance of a Protocol takes microseconds
    if move is not None:
        move(finger_velocity)
    elif finger_velocity is not None:
        raise InvalidValueError(
            f"finger_velocity = {finger_velocity} m/s: these fingers only close; give None, or take a hand that "
            "is a MovingHand"
        )


class SensorDevice(Device, Protocol):
    """A force/torque sensor that streams; a thread reads it."""

    def read(self) -> SensorReading:
        """Return the newest record at once.

        Raises:
            DeviceError: It is silent for too long, or broken.
        """
        ...

    def tare(self) -> None:
        """Take the present load for zero."""
        ...
