"""A line that holds back ever more of what devices send: real clients take no sample for younger than it is.

`benchmarks/wire creeping` measures how soon that is noticed.
"""

import os
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.emulators.host import MOST_BEHIND
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.ur import SimpleUr
from palpate.hw.ur import UrArm, UrSettings
from support.emulated_bus import hosted_servos, settings
from support.ur_library import needs_ur
from support.waiting import until

sys.path.append(str(Path(__file__).resolve().parents[2] / "benchmarks"))

from wire.delayed import DelayedLine

pytestmark = pytest.mark.slow


def error_behind(line: DelayedLine, stamp: Callable[[], float], rate: float) -> DeviceError:
    """Return what is raised in the end; until then no sample may be dated after it came from the device."""
    line.creep(rate)
    looks = 0

    def look() -> DeviceError | None:
        nonlocal looks
        try:
            taken = stamp()
        except DeviceError as error:
            return error
        # a busy emulator's clock lags and catches up, unlike a real one's
        assert taken <= line.released + 2.0 * MOST_BEHIND
        looks += 1
        return None

    error = until(look)
    assert error is not None
    assert looks > 10
    return error


@needs_ur
@pytest.mark.parametrize("rate", [0.08, 0.5])
def test_states_of_a_ur_arm_are_refused_for_their_age(rate: float) -> None:
    behind, before = (f"127.{100 + os.getpid() % 100}.{os.getpid() // 100 % 250}.{n}" for n in (8, 9))
    with EmulatorProcess(SimpleUr(behind)), DelayedLine() as line:
        line.connections(before, behind, (30004, 30003, 29999))
        with UrArm(before, UrSettings(stale_after=0.4, watchdog=0.4)) as arm:
            error = error_behind(line, lambda: arm.read().time, rate)
            line.creep(0.0)
    assert "ms old, as round trips prove" in str(error) or "held up" in str(error)


def test_states_of_servos_are_refused_for_their_age() -> None:
    with EmulatorProcess(hosted_servos) as emulator, DelayedLine() as line:
        path = line.terminal(emulator.addresses["dynamixel"], 1_000_000)
        hand = DynamixelHand(path, settings(4, watchdog=0.0, reply_timeout=0.05, silence=0.2))
        hand.start()
        error = error_behind(line, lambda: hand.read().time, 0.05)
        line.creep(0.0)
        hand.close()
    assert "does not reply for" in str(error) or "sends damaged replies for" in str(error)
