"""Condition of a hand: what its servos report, and how fast the exchange with them is."""

from collections.abc import Iterator
from time import monotonic

import numpy as np

from palpate.hw.devices import HandDevice
from palpate.hw.finding import DeviceFinding, DeviceUse, FindingVerdict, SelfExamining, judged
from palpate.robots.robot import Robot


def hand_findings(robot: Robot, poll: float, hand: HandDevice, seconds: float) -> Iterator[DeviceFinding]:
    """Yield the findings on a hand that has been started, and that a run asks every `poll` seconds.

    Raises:
        DeviceError: It is lost meanwhile.
    """
    took, begin = list[float](), monotonic()
    while monotonic() - begin < seconds:
        sent = monotonic()
        hand.read()
        took.append(monotonic() - sent)
    if isinstance(hand, SelfExamining):
        yield from hand.findings(DeviceUse(robot.file.period, len(took), len(took) / seconds))
    half, most = (1e3 * float(x) for x in np.percentile(took, [50.0, 99.0]))
    oldest, wanted = 1e3 * robot.file.limits.sample_age, f"at most backend.hand.poll_s, {1e3 * poll:g}"
    fix, fast = f"write poll_s: {1e-3 * half * 1.3:.3f}, or raise the baud rate", half <= 1e3 * poll
    yield judged(hand.name, "exchange, median", half, "ms", wanted, fast, fix, FindingVerdict.NOTE)
    wanted, fix = f"well below limits.sample_age_s, {oldest:g} ms", "check cables, baud rate and the adapter"
    yield judged(hand.name, "exchange, 99 %", most, "ms", wanted, most + 1e3 * poll < oldest, fix)
