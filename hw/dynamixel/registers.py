"""The control table of X-series servos (ROBOTIS e-manuals XL330-M288, XM430-W210), as far as both have it."""

from dataclasses import dataclass
from enum import IntEnum, IntFlag

from palpate.kinematics.servo_model import XL330_M288, XM430_W210, ServoModel

EEPROM_END = 64
"""Addresses below keep their values without power, and are locked while the torque is on."""


class Mode(IntEnum):
    """Operating Mode(11)."""

    CURRENT = 0
    VELOCITY = 1
    POSITION = 3
    EXTENDED_POSITION = 4
    CURRENT_BASED_POSITION = 5
    PWM = 16


class HardwareError(IntFlag):
    """Hardware Error Status(70), and Shutdown(63), which says at which of these the torque goes off."""

    VOLTAGE = 0x01
    OVERHEATING = 0x04
    ENCODER = 0x08
    ELECTRICAL_SHOCK = 0x10
    OVERLOAD = 0x20

    @property
    def words(self) -> str:
        """Return what is wrong, for messages."""
        known = [flag.name.lower().replace("_", " ") for flag in HardwareError if self & flag and flag.name]
        return " and ".join(known) or f"hardware error 0x{int(self):02x}"


@dataclass(frozen=True, slots=True)
class Register:
    """An item of the control table.

    Attributes:
        address: Of its first byte.
        size: In bytes.
        signed: Whether it is two's complement.
        writable: Whether it can be written at all.
    """

    address: int
    size: int
    signed: bool = False
    writable: bool = True

    @property
    def end(self) -> int:
        """Address behind it."""
        return self.address + self.size

    def value(self, data: bytes | bytearray) -> int:
        """Return what bytes from the wire mean."""
        return int.from_bytes(data, "little", signed=self.signed)

    def bytes_of(self, value: int) -> bytes:
        """Return a value as bytes for the wire; one too large wraps round, as a register does."""
        return (value & ((1 << (8 * self.size)) - 1)).to_bytes(self.size, "little")


MODEL_NUMBER = Register(0, 2, writable=False)
MODEL_INFORMATION = Register(2, 4, writable=False)
FIRMWARE = Register(6, 1, writable=False)
ID = Register(7, 1)
BAUD_RATE = Register(8, 1)
RETURN_DELAY = Register(9, 1)
DRIVE_MODE = Register(10, 1)
OPERATING_MODE = Register(11, 1)
SECONDARY_ID = Register(12, 1)
PROTOCOL = Register(13, 1)
HOMING_OFFSET = Register(20, 4, signed=True)
MOVING_THRESHOLD = Register(24, 4)
TEMPERATURE_LIMIT = Register(31, 1)
MAX_VOLTAGE_LIMIT = Register(32, 2)
MIN_VOLTAGE_LIMIT = Register(34, 2)
PWM_LIMIT = Register(36, 2)
CURRENT_LIMIT = Register(38, 2)
VELOCITY_LIMIT = Register(44, 4)
MAX_POSITION_LIMIT = Register(48, 4)
MIN_POSITION_LIMIT = Register(52, 4)
SHUTDOWN = Register(63, 1)
TORQUE_ENABLE = Register(64, 1)
LED = Register(65, 1)
STATUS_RETURN_LEVEL = Register(68, 1)
REGISTERED_INSTRUCTION = Register(69, 1, writable=False)
HARDWARE_ERROR_STATUS = Register(70, 1, writable=False)
VELOCITY_I_GAIN = Register(76, 2)
VELOCITY_P_GAIN = Register(78, 2)
POSITION_D_GAIN = Register(80, 2)
POSITION_I_GAIN = Register(82, 2)
POSITION_P_GAIN = Register(84, 2)
FEEDFORWARD_2ND_GAIN = Register(88, 2)
FEEDFORWARD_1ST_GAIN = Register(90, 2)
BUS_WATCHDOG = Register(98, 1)
GOAL_PWM = Register(100, 2, signed=True)
GOAL_CURRENT = Register(102, 2, signed=True)
GOAL_VELOCITY = Register(104, 4, signed=True)
PROFILE_ACCELERATION = Register(108, 4)
PROFILE_VELOCITY = Register(112, 4)
GOAL_POSITION = Register(116, 4, signed=True)
REALTIME_TICK = Register(120, 2, writable=False)
MOVING = Register(122, 1, writable=False)
MOVING_STATUS = Register(123, 1, writable=False)
PRESENT_PWM = Register(124, 2, signed=True, writable=False)
PRESENT_CURRENT = Register(126, 2, signed=True, writable=False)
PRESENT_VELOCITY = Register(128, 4, signed=True, writable=False)
PRESENT_POSITION = Register(132, 4, signed=True, writable=False)
VELOCITY_TRAJECTORY = Register(136, 4, signed=True, writable=False)
POSITION_TRAJECTORY = Register(140, 4, signed=True, writable=False)
PRESENT_VOLTAGE = Register(144, 2, writable=False)
PRESENT_TEMPERATURE = Register(146, 1, writable=False)

REGISTERS = tuple(value for value in dict(globals()).values() if isinstance(value, Register))
"""All of them, in the order of their addresses; indirect addresses and data stand in `ServoKind`."""

INDIRECT_ADDRESSES = 168
"""Of the first indirect address, 2 bytes each (both e-manuals)."""

BAUD_RATES = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
"""By the value of Baud Rate(8) [1/s]; the last one is for XM430 only."""

WATCHDOG_UNIT = 0.02
"""Of Bus Watchdog(98), 1 to 127 [s]."""

WATCHDOG_EXPIRED = 255
"""What Bus Watchdog(98) reads after it has stopped the servo."""

MIDDLE = 2048
"""Position in the middle of a turn."""


@dataclass(frozen=True, slots=True)
class ServoKind:
    """What sets one model apart on the wire.

    Attributes:
        number: Model Number(0).
        servo: Its figures as a motor.
        indirect: How many indirect addresses stand in a row from `INDIRECT_ADDRESSES`.
        indirect_data: Address of the first indirect data byte.
        initial: Values of a new servo that are not 0.
        table_end: Address behind the control table.
        fastest_baud: Largest value of Baud Rate(8).
    """

    number: int
    servo: ServoModel
    indirect: int
    indirect_data: int
    initial: dict[Register, int]
    table_end: int
    fastest_baud: int


def _initial(
    current: int, velocity: int, velocity_i: int, velocity_p: int, position_p: int, shutdown: int
) -> dict[Register, int]:
    return {
        ID: 1,
        BAUD_RATE: 1,
        RETURN_DELAY: 250,
        OPERATING_MODE: Mode.POSITION,
        SECONDARY_ID: 255,
        PROTOCOL: 2,
        MOVING_THRESHOLD: 10,
        PWM_LIMIT: 885,
        CURRENT_LIMIT: current,
        VELOCITY_LIMIT: velocity,
        MAX_POSITION_LIMIT: 4095,
        SHUTDOWN: shutdown,
        STATUS_RETURN_LEVEL: 2,
        VELOCITY_I_GAIN: velocity_i,
        VELOCITY_P_GAIN: velocity_p,
        POSITION_P_GAIN: position_p,
    }


XL330 = ServoKind(
    number=1200,
    servo=XL330_M288,
    indirect=20,
    indirect_data=208,
    initial=_initial(1750, 445, 1600, 180, 400, 53)
    | {TEMPERATURE_LIMIT: 70, MAX_VOLTAGE_LIMIT: 70, MIN_VOLTAGE_LIMIT: 35},
    table_end=228,
    fastest_baud=6,
)
"""XL330-M288 (e-manual, control table)."""

XM430 = ServoKind(
    number=1030,
    servo=XM430_W210,
    indirect=28,
    indirect_data=224,
    initial=_initial(1193, 330, 1920, 100, 800, 52)
    | {TEMPERATURE_LIMIT: 80, MAX_VOLTAGE_LIMIT: 160, MIN_VOLTAGE_LIMIT: 95},
    table_end=252,
    fastest_baud=7,
)
"""XM430-W210 (e-manual, control table); its second block of indirect addresses from 578 is left out."""

KINDS = {kind.number: kind for kind in (XL330, XM430)}
"""By Model Number(0)."""
