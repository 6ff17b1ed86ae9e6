"""How a servo is, and how to bring it back: what is asked outside of the loop."""

import time
from dataclasses import dataclass

from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.bus import Bus
from palpate.hw.dynamixel.finger_servo import FingerServo
from palpate.hw.dynamixel.registers import WATCHDOG_EXPIRED, HardwareError

REBOOT_TIME = 2.0
"""How long a servo may take to come back after a reboot [s]; a few tenths are assumed."""

REBOOT_REPLY_TIME = 0.05
"""Within which a rebooting servo has replied and stopped listening [s]; assumed."""


@dataclass(frozen=True, slots=True)
class ServoHealth:
    """What a doctor asks a servo.

    Attributes:
        servo_id: On the bus.
        model: Its name.
        firmware: Its version.
        temperature: [degrees C].
        temperature_limit: At which it shuts down [degrees C].
        voltage: Supply [V].
        voltage_range: At whose ends it shuts down [V].
        error: What is wrong with it, if anything.
    """

    servo_id: int
    model: str
    firmware: int
    temperature: float
    temperature_limit: float
    voltage: float
    voltage_range: tuple[float, float]
    error: HardwareError


@dataclass(frozen=True, slots=True)
class ServoCondition:
    """Whether a servo can do anything.

    Attributes:
        servo_id: On the bus.
        error: For which it has shut down, if it has.
        torque_on: Whether it presses, or holds its place.
        expired: Whether its bus watchdog has stopped it.
    """

    servo_id: int
    error: HardwareError
    torque_on: bool
    expired: bool


def servo_condition(bus: Bus, servo_id: int) -> ServoCondition:
    """Ask one servo, and write nothing.

    Raises:
        DeviceError: It does not reply.
    """
    return ServoCondition(
        servo_id,
        HardwareError(bus.read(servo_id, reg.HARDWARE_ERROR_STATUS)),
        bool(bus.read(servo_id, reg.TORQUE_ENABLE)),
        bus.read(servo_id, reg.BUS_WATCHDOG) == WATCHDOG_EXPIRED,
    )


def health(bus: Bus, finger: FingerServo) -> ServoHealth:
    """Ask one servo how it is.

    Raises:
        DeviceError: It does not reply.
    """
    its = finger.servo_id
    return ServoHealth(
        its,
        finger.kind.servo.name,
        bus.read(its, reg.FIRMWARE),
        float(bus.read(its, reg.PRESENT_TEMPERATURE)),
        float(bus.read(its, reg.TEMPERATURE_LIMIT)),
        0.1 * bus.read(its, reg.PRESENT_VOLTAGE),
        (0.1 * bus.read(its, reg.MIN_VOLTAGE_LIMIT), 0.1 * bus.read(its, reg.MAX_VOLTAGE_LIMIT)),
        HardwareError(bus.read(its, reg.HARDWARE_ERROR_STATUS)),
    )


def reboot(bus: Bus, device: str, servo_id: int) -> None:
    """Restart one servo and wait until it is there again.

    Raises:
        DeviceError: It does not come back, or its hardware error does.
    """
    bus.reboot(servo_id)
    end = time.monotonic() + REBOOT_TIME
    time.sleep(REBOOT_REPLY_TIME)
    while bus.ping(servo_id) is None:
        if time.monotonic() > end:
            problem = f"servo {servo_id} did not come back from its reboot"
            raise DeviceError(device, problem, "switch its power off and on")
    error = HardwareError(bus.read(servo_id, reg.HARDWARE_ERROR_STATUS))
    if error:
        raise DeviceError(device, f"servo {servo_id} still reports {error.words}", "see its e-manual")
