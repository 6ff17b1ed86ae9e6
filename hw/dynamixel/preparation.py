"""Bringing one servo to where a hand can use it, without letting go of what it may hold."""

from palpate.hw.devices import DeviceError, WireError
from palpate.hw.dynamixel import registers as reg
from palpate.hw.dynamixel.bus import Bus, RegisterSpan
from palpate.hw.dynamixel.finger_servo import STATE_ITEMS, STATE_LENGTH, FingerServo
from palpate.hw.dynamixel.registers import INDIRECT_ADDRESSES, KINDS, HardwareError, Mode
from palpate.hw.dynamixel.settings import LENGTHS, HandSettings, ServoCalibration
from palpate.kinematics.servo_model import PULSES

SETTINGS = (
    (reg.RETURN_DELAY, 0),
    (reg.OPERATING_MODE, int(Mode.CURRENT_BASED_POSITION)),
)
"""Kept without power, locked while the torque is on; written only where they differ, as that memory wears."""

REBOOT_REMEDY = "take the load off it, let it cool, then `palpate recover` restarts it"
"""What to do about a servo that has shut down."""


def shutdown_error(device: str, servo_id: int, error: HardwareError) -> DeviceError:
    """Return what is raised for a servo with a hardware error."""
    return DeviceError(device, f"servo {servo_id} reports {error.words}", REBOOT_REMEDY)


def prepare(bus: Bus, device: str, its: ServoCalibration, settings: HandSettings) -> FingerServo:
    """Check and set up one servo; whether its torque is on stays as it is, unless a setting is not to be had so.

    Args:
        bus: That it is on.
        device: The hand's name, for messages.
        its: Which one, and its calibration.
        settings: Of the hand.

    Raises:
        DeviceError: It is silent, of an unknown model, has shut down, or is set up for something else.
    """
    servo_id = its.servo_id
    number = bus.ping(servo_id)
    if number is None:
        raise WireError(
            device,
            f"servo {servo_id} does not reply at {settings.baud_rate} baud",
            "check its cable, its power, its id and its baud rate",
        )
    kind = KINDS.get(number)
    if kind is None:
        known = ", ".join(f"{kind.servo.name} ({number})" for number, kind in KINDS.items())
        raise DeviceError(device, f"servo {servo_id} is of the unknown model {number}", f"use one of {known}")
    bus.write(servo_id, reg.STATUS_RETURN_LEVEL, 2)  # first: without it a servo may reply to nothing but pings
    error = HardwareError(bus.read(servo_id, reg.HARDWARE_ERROR_STATUS))
    if error:
        raise shutdown_error(device, servo_id, error)
    drive = bus.read(servo_id, reg.DRIVE_MODE)
    if drive:
        raise DeviceError(
            device,
            f"servo {servo_id} has drive mode {drive}, so that its directions and speeds mean something else",
            "set Drive Mode(10) to 0 and calibrate its zero and direction here",
        )
    bus.write(servo_id, reg.BUS_WATCHDOG, 0)
    torque = bus.read(servo_id, reg.TORQUE_ENABLE)
    for register, value in SETTINGS:
        if bus.read(servo_id, register) != value:
            if torque:  # what it holds falls here, and only here: it was not this hand's program that holds it
                bus.write(servo_id, reg.TORQUE_ENABLE, 0)
                torque = 0
            bus.write(servo_id, register, value)
    finger = FingerServo(its, settings, kind, bus.read(servo_id, reg.CURRENT_LIMIT))
    _check_turn(bus, device, finger)
    _map_state(bus, finger)
    return finger


def state_span(finger: FingerServo, longer: int) -> RegisterSpan:
    """Return what to read for the state of a servo, and so many bytes more."""
    return RegisterSpan(finger.servo_id, finger.kind.indirect_data, STATE_LENGTH + longer)


def _check_turn(bus: Bus, device: str, finger: FingerServo) -> None:
    now = bus.read(finger.servo_id, reg.PRESENT_POSITION)
    for what, position in zip(("stands at", "opens to", "closes to"), (now, *finger.range), strict=True):
        if not 0 <= position < PULSES:
            raise DeviceError(
                device,
                f"servo {finger.servo_id} {what} position {position}, outside of the turn it knows at power-up",
                "mount the horn so that the finger's range lies within 0 to 4095, and calibrate its zero",
            )


def _map_state(bus: Bus, finger: FingerServo) -> None:
    addresses = [address for item in STATE_ITEMS for address in range(item.address, item.end)]
    addresses += [reg.PRESENT_TEMPERATURE.address] * (LENGTHS - 1)
    wanted = b"".join(address.to_bytes(2, "little") for address in addresses)
    span = RegisterSpan(finger.servo_id, INDIRECT_ADDRESSES, len(wanted))
    if bus.read_bytes(span) != wanted:
        bus.write_bytes(span.servo_id, span.address, wanted)


def presses(bus: Bus, finger: FingerServo) -> bool:
    """Return whether a servo presses, from before.

    Raises:
        DeviceError: It does not reply.
    """
    its = finger.servo_id
    return bool(bus.read(its, reg.TORQUE_ENABLE)) and bus.read(its, reg.GOAL_POSITION) == finger.range[1]


def hold_still(bus: Bus, finger: FingerServo) -> None:
    """Switch the torque on where the shaft stands, with little current: an old goal must not make it jump.

    One that is on stays as it is, and so does what it holds.

    Raises:
        DeviceError: It does not reply, or refuses.
    """
    servo_id = finger.servo_id
    if bus.read(servo_id, reg.TORQUE_ENABLE):
        return
    reading = finger.reading(bus.read_bytes(state_span(finger, 0)))
    goals = finger.goals(0.0, True, finger.joint_position(reading.position))
    bus.write_bytes(servo_id, reg.GOAL_CURRENT.address, goals.current)
    position = bus.read(servo_id, reg.PRESENT_POSITION)
    bus.write(servo_id, reg.GOAL_POSITION, position)
    bus.write(servo_id, reg.TORQUE_ENABLE, 1)
