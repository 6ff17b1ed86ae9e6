"""Condition of a hand of Dynamixel servos: each servo, and their bus."""

from collections.abc import Iterator
from time import monotonic

import numpy as np

from palpate.commands.doctor.finding import DoctorFinding, DoctorVerdict, judged
from palpate.hw.dynamixel.care import ServoHealth
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.robots.rig_entries import DynamixelEntry
from palpate.robots.robot import Robot

HOT, LOW = 10.0, 0.3
"""[degrees C, V] from the limit at which a servo shuts down."""


def hand_findings(
    robot: Robot, entry: DynamixelEntry, hand: DynamixelHand, seconds: float
) -> Iterator[DoctorFinding]:
    """Yield the findings on a hand that has been started.

    Raises:
        DeviceError: It is lost meanwhile.
    """
    models = {servo.servo_id: servo.model for servo in entry.servos}
    for servo in hand.health():
        yield from _servo(hand.name, servo, models[servo.servo_id])
    missed, took, begin = hand.missed, list[float](), monotonic()
    while monotonic() - begin < seconds:
        sent = monotonic()
        hand.read()
        took.append(monotonic() - sent)
    half, most = (1e3 * float(x) for x in np.percentile(took, [50.0, 99.0]))
    oldest = 1e3 * robot.file.limits.sample_age
    cable = "check cables, baud rate and the adapter's latency"
    yield judged(
        hand.name, "exchange, median", half, "ms", f"at most backend.hand.poll_s, {1e3 * entry.poll:g}",
        half <= 1e3 * entry.poll,
        f"write poll_s: {1e-3 * half * 1.3:.3f}, or raise the baud rate",
        DoctorVerdict.NOTE,
    )  # fmt: skip
    yield judged(
        hand.name, "exchange, 99 %", most, "ms", f"well below limits.sample_age_s, {oldest:g} ms",
        most + 1e3 * entry.poll < oldest, cable,
    )  # fmt: skip
    share = 100.0 * (hand.missed - missed) / max(1, len(took))
    yield judged(hand.name, "exchanges missed", share, "%", "at most 1", share <= 1.0, cable)


def _servo(hand: str, servo: ServoHealth, model: str | None) -> Iterator[DoctorFinding]:
    name = f"{hand}, servo {servo.servo_id}"
    if model is not None:
        fix = f"write model: {servo.model}, or see which servo has which id"
        yield judged(name, "model", servo.model, "", model, model in servo.model, fix)
    yield DoctorFinding(name, "firmware", float(servo.firmware))
    limit = servo.temperature_limit
    fix = f"let it cool down: at {limit:g} it shuts down, and lets go"
    yield judged(
        name,
        "temperature",
        servo.temperature,
        "deg C",
        f"below {limit - HOT:g}",
        servo.temperature < limit - HOT,
        fix,
    )
    low, high = servo.voltage_range
    fix = "check its supply: outside of its range it shuts down, and lets go"
    good = low + LOW <= servo.voltage <= high - LOW
    yield judged(name, "supply", servo.voltage, "V", f"{low + LOW:.1f} to {high - LOW:.1f}", good, fix)
    words = servo.error.words if servo.error else "none"
    yield judged(name, "hardware error", words, "", "none", not servo.error, "remove the cause, then reboot it")
