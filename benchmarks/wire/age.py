"""Age of a UR arm's state when a controller reads it, and time to detect faults.

The real ur_rtde runs in its client process, over real sockets on loopback, against an emulated controller at
500 Hz in a third process. A loop with absolute deadlines, of real-time priority if permitted, reads and
commands every 2 ms. The age counts from the controller's time stamp of the state, so that it includes the
emulator's lateness. A fault is detected when `move` or `read` fails, counted from before the fault is
requested.
"""

import argparse
import os
import signal
from collections.abc import Callable, Iterator
from functools import partial
from time import monotonic, sleep

import numpy as np
from harness.campaign import Listing, raise_priority

from palpate.hw.devices import DeviceError
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.ur import SimpleUr
from palpate.hw.ur import UrArm, UrSettings
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime

ADDRESS = "127.0.9.2"
PERIOD = 2e-3
STILL = (0.0, 0.0, 0.0)
AGE_MEDIAN, AGE_99, DEATH, OTHERS = 3e-3, 8e-3, 20e-3, 50e-3
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


def until_noticed(arm: UrArm) -> float:
    """Return the time at which `read` or `move` failed [s]."""
    pace = RealTime(PERIOD, priority=USUAL_PRIORITY)
    pace.start()
    try:
        while True:
            pace.wait()
            arm.read()
            arm.move(STILL, STILL)
    except DeviceError:
        return monotonic()
    finally:
        pace.stop()


def noticed(arm: UrArm, tries: int, spoil: Callable[[], object], mend: Callable[[], object]) -> np.ndarray:
    """Return the time to detect each fault [s], from before its request."""
    found = []
    for _ in range(tries):
        sleep(0.2)
        recovered(arm)
        begun = monotonic()
        spoil()
        found.append(until_noticed(arm) - begun)
        mend()
        recovered(arm)
    return np.array(found)


def recovered(arm: UrArm) -> None:
    """Recover; again if a stall of the machine makes the state too old at once."""
    for _ in range(20):
        try:
            arm.recover()
            arm.read()
        except DeviceError:
            continue
        return
    arm.recover()


def faults(
    arm: UrArm, fault: Callable[..., object]
) -> dict[str, tuple[float, Callable[[], object], Callable[[], object]]]:
    """Return limit [s], injection and end of each fault by name."""

    def switch(name: str) -> tuple[Callable[[], object], Callable[[], object]]:
        return partial(fault, "ur", name), partial(fault, "ur", name, 0.0)

    return {
        "client process killed": (DEATH, lambda: os.kill(arm.process_id, signal.SIGKILL), int),
        "connection dropped (FIN)": (OTHERS, switch("drop_fin")[0], int),
        "connection dropped (RST)": (OTHERS, switch("drop_rst")[0], int),
        "states stay away": (OTHERS, *switch("stall_stream")),
        "protective stop": (OTHERS, switch("protective_stop")[0], int),
        "emergency stop": (OTHERS, *switch("e_stop")),
        "program stopped": (OTHERS, switch("kill_program")[0], int),
    }


def age(options: argparse.Namespace) -> Iterator[Listing]:
    """Measure ages, then each fault."""
    rows, tries = [], 10 if options.tries is None else options.tries

    def row(name: str, limit: str, values: np.ndarray) -> None:
        p50, p99 = np.percentile(values, (50, 99))
        rows.append((name, limit, *(f"{1e3 * v:.2f}" for v in (p50, p99, values.max()))))

    with EmulatorProcess(controller) as emulator:
        # stalls of this computer are to appear as age, not to end the run
        with UrArm(ADDRESS, UrSettings(stale_after=0.5, watchdog=0.5)) as arm:
            age, since = ages(arm, options.seconds or 20.0).T
            row("age of the state at 500 Hz", f"{1e3 * AGE_MEDIAN:g} / {1e3 * AGE_99:g}", age)
            row("  since it came to the client process", "", since)
        with UrArm(ADDRESS, UrSettings(watchdog=0.5)) as arm:
            for name, (limit, spoil, mend) in faults(arm, emulator.control.fault).items() if tries else ():
                row(f"noticed: {name}", f"{1e3 * limit:g}", noticed(arm, tries, spoil, mend))
    yield Listing("UR arm over the wire [ms]", ("figure", "asked", "p50", "p99", "max"), rows)


PARTS = {"age": age}
