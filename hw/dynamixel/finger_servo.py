"""One finger on the wire: registers to SI units and back, forces to currents."""

import math
import struct
from dataclasses import dataclass

from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.registers import MIDDLE, HardwareError, ServoKind
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.kinematics.servo_model import OPENING_FORCE, PULSE, VELOCITY_UNIT, ServoModel

STATE_ITEMS = (
    reg.TORQUE_ENABLE,
    reg.HARDWARE_ERROR_STATUS,
    reg.BUS_WATCHDOG,
    reg.PRESENT_CURRENT,
    reg.PRESENT_VELOCITY,
    reg.PRESENT_POSITION,
)
"""What is read of every servo in every period, through indirect addresses: they stand far apart."""

_STATE = struct.Struct("<BBBhii")

STATE_LENGTH = _STATE.size
"""Of these [bytes]."""

FARTHEST = 1.0
"""Turns of a servo beyond its finger's range that are still believed: it may be calibrated roughly."""

LENGTHS = 8
"""How many lengths of reads take turns when replies fail, so that a late reply is recognised by its length. One
that is late by this many exchanges is not: after as many failures nothing is read until a new start. The XL330 has
20 indirect addresses, 13 of which hold the state."""


@dataclass(frozen=True, slots=True)
class ServoReading:
    """A servo's reported state.

    Attributes:
        torque_on: Whether it drives.
        error: What is wrong with it, if anything.
        watchdog: As Bus Watchdog(98) has it.
        position: Of its shaft [rad], 0 in the middle of its turn, in its own direction.
        velocity: Likewise [rad/s].
        current: Likewise [A].
    """

    torque_on: bool
    error: HardwareError
    watchdog: int
    position: float
    velocity: float
    current: float


@dataclass(frozen=True, slots=True)
class Goals:
    """Goal Current(102), then Profile Velocity(112) and Goal Position(116), as written every period."""

    current: bytes
    motion: bytes


class FingerServo:
    """A servo with its finger, as far as both are numbers: no bus."""

    def __init__(
        self, calibration: ServoCalibration, settings: HandSettings, kind: ServoKind, current_limit: int
    ) -> None:
        """Take what is known of it.

        Args:
            calibration: Its zero and direction.
            settings: Of its hand.
            kind: Its model.
            current_limit: Current Limit(38) as it stands in the servo.
        """
        self.calibration, self.kind = calibration, kind
        self.motor: ServoModel = calibration.motor or kind.servo
        self._finger, self._along = settings.finger, settings.tip_along
        self._closed = settings.closed
        self._unit = kind.servo.current_unit
        self._largest = min(current_limit, math.floor(self.motor.largest_current / self._unit + 0.5))
        speed = settings.closing_speed / self._finger.lever(0.0, self._along)
        self._motion_speed = max(1, round(speed / VELOCITY_UNIT))

    @property
    def servo_id(self) -> int:
        """On the bus."""
        return self.calibration.servo_id

    @property
    def range(self) -> tuple[int, int]:
        """Positions of the open and of the closed finger, as registers have them."""
        return self._position(0.0), self._position(self._closed)

    def reading(self, data: bytes) -> ServoReading:
        """Return what bytes of `STATE_ITEMS` mean."""
        torque, error, watchdog, current, velocity, position = _STATE.unpack_from(data)
        return ServoReading(
            bool(torque),
            HardwareError(error),
            watchdog,
            (position - MIDDLE) * PULSE,
            velocity * VELOCITY_UNIT,
            current * self._unit,
        )

    def joint_position(self, position: float) -> float:
        """Return the finger's coordinate [rad or m] at a position of the shaft [rad]."""
        its = self.calibration
        return its.direction * self._finger.ratio * (position - its.zero)

    def impossible(self, position: float) -> str:
        """Return why the shaft cannot be at a position [rad]; empty if it can."""
        turns = FARTHEST * 2.0 * math.pi
        ends = [(each - MIDDLE) * PULSE for each in self.range]
        low, high = min(ends) - turns, max(ends) + turns
        if low <= position <= high:
            return ""
        return (
            f"servo {self.servo_id} reports its shaft at {position:.4g} rad, its finger at "
            f"{self.joint_position(position):.4g} of {self._closed:.3g} (rad or m): it can be from {low:.3g} to "
            f"{high:.3g} rad"
        )

    def goals(self, force: float, driving: float, q: float) -> Goals:
        """Return what makes the finger press.

        Args:
            force: Normal force [N]; 0 opens it.
            driving: Share of the current that makes up for the gear's friction, by `GearDirection`; the rest
                yields to it.
            q: Where the joint is [rad or m].
        """
        lever, motor = self._finger.lever(q, self._along), self.motor
        if force == 0.0:
            return self._goals(motor.driving_current(OPENING_FORCE * lever), 0.0)
        return self._goals(motor.pressing_current(force * lever, driving), self._closed)

    def _goals(self, current: float, q: float) -> Goals:
        units = self._largest if current == math.inf else min(self._largest, round(current / self._unit))
        return Goals(struct.pack("<h", units), struct.pack("<ii", self._motion_speed, self._position(q)))

    def _position(self, q: float) -> int:
        its = self.calibration
        return MIDDLE + round((its.zero + its.direction * q / self._finger.ratio) / PULSE)
