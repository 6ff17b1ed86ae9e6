"""Age of a UR arm's state when a controller reads it.

The real ur_rtde runs in its client process, over real sockets on loopback, against an emulated controller at
500 Hz in a third process. A loop with absolute deadlines, of real-time priority if permitted, reads and
commands every 2 ms. The age counts from the controller's time stamp of the state, so that it includes the
emulator's lateness.
"""

import argparse
from collections.abc import Iterator
from time import monotonic

import numpy as np
from harness.campaign import Listing, raise_priority

from palpate.hw.emulators.host import Host
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.ur import SimpleUr
from palpate.hw.ur import UrArm, UrSettings
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime

ADDRESS = "127.0.9.2"
PERIOD = 2e-3
STILL = (0.0, 0.0, 0.0)
AGE_MEDIAN, AGE_99 = 3e-3, 8e-3
"""Limits that are required [s]."""


def controller() -> Host:
    """Return the emulated controller, in its process."""
    raise_priority()
    return SimpleUr(ADDRESS, unlock_delay=0.1)()


def ages(arm: UrArm, seconds: float) -> np.ndarray:
    """Return the age of each state and the time since its arrival, shape (n, 2) [s]."""
    found = []
    pace = RealTime(PERIOD, priority=USUAL_PRIORITY)
    pace.start()
    for i in range(round(seconds / PERIOD)):
        pace.wait()
        state = arm.state()
        now = monotonic()
        found.append((now - state.time, now - state.seen))
        arm.move((0.01 if i // 250 % 2 else -0.01, 0.0, 0.0), STILL)
    pace.stop()
    return np.array(found)


def age(options: argparse.Namespace) -> Iterator[Listing]:
    """Measure the age of the state; stalls of this computer appear as age and do not end the run."""
    with EmulatorProcess(controller), UrArm(ADDRESS, UrSettings(stale_after=0.5, watchdog=0.5)) as arm:
        found = 1e3 * np.percentile(ages(arm, options.seconds or 20.0), (50, 99, 100), axis=0).T
    names = "age of the state at 500 Hz", "  since it came to the client process"
    limits = f"{1e3 * AGE_MEDIAN:g} / {1e3 * AGE_99:g}", ""
    rows = [
        (name, limit, *(f"{value:.2f}" for value in values))
        for name, limit, values in zip(names, limits, found, strict=True)
    ]
    yield Listing("UR arm over the wire [ms]", ("figure", "asked", "p50", "p99", "max"), rows)


PARTS = {"age": age}
