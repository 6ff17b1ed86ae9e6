"""What servos report of themselves: fit to run or not, what to do, and what a doctor wants to know."""

from collections.abc import Iterable, Iterator

from palpate.hw.condition import DeviceCondition
from palpate.hw.dynamixel.care import ServoCondition, ServoHealth
from palpate.hw.finding import DeviceFinding, judged

HOT, LOW = 10.0, 0.3
"""[degrees C, V] from the limit at which a servo shuts down."""


def hand_condition(name: str, servos: Iterable[ServoCondition]) -> DeviceCondition:
    """Return whether a hand with servos in these conditions is fit to run."""
    servos = tuple(servos)
    failed = [str(servo.servo_id) for servo in servos if servo.error]
    action = f"restart servo {' and '.join(failed)}, which lets go of what it holds" if failed else ""
    return DeviceCondition(name, "; ".join(map(_words, servos)), not failed, action)


def _words(servo: ServoCondition) -> str:
    error = f"shut down by {servo.error.words}" if servo.error else "no hardware error"
    stopped = ", stopped by its bus watchdog" if servo.expired else ""
    return f"servo {servo.servo_id} {error}, torque {'on' if servo.torque_on else 'off'}{stopped}"


def servo_findings(hand: str, servo: ServoHealth, model: str | None) -> Iterator[DeviceFinding]:
    """Yield the findings on a servo; `model` is the required one, None if any will do."""
    name = f"{hand}, servo {servo.servo_id}"
    if model is not None:
        fix = f"write model: {servo.model}, or see which servo has which id"
        yield judged(name, "model", servo.model, "", model, model in servo.model, fix)
    yield DeviceFinding(name, "firmware", float(servo.firmware))
    limit, hottest = servo.temperature_limit, servo.temperature_limit - HOT
    fix = f"let it cool down: at {limit:g} it shuts down, and lets go"
    good = servo.temperature < hottest
    yield judged(name, "temperature", servo.temperature, "deg C", f"below {hottest:g}", good, fix)
    low, high = servo.voltage_range
    fix = "check its supply: outside of its range it shuts down, and lets go"
    good = low + LOW <= servo.voltage <= high - LOW
    yield judged(name, "supply", servo.voltage, "V", f"{low + LOW:.1f} to {high - LOW:.1f}", good, fix)
    words = servo.error.words if servo.error else "none"
    yield judged(name, "hardware error", words, "", "none", not servo.error, "remove the cause, then reboot it")
