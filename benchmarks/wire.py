"""Devices on the wire in two minutes: ages, rates, a dozen faults, a short soak. `make bench` runs it.

    python benchmarks/wire.py

The long runs: `wire_age.py` (the arm alone, faults ten times), `wire_netft.py` (sensors alone), `wire_faults.py`
(every fault) and `wire_soak.py` (half an hour).
"""

import os
import tempfile
from contextlib import suppress
from multiprocessing import resource_tracker
from pathlib import Path
from time import monotonic

import numpy as np
from rich.console import Console
from rich.table import Table
from wire_age import ADDRESS as AGE_ADDRESS
from wire_age import AGE_99, AGE_MEDIAN, ages, controller
from wire_faults import campaign, shown
from wire_netft import measure_rate
from wire_soak import Account, show, soak
from wired.cell import PATIENT, Cell
from wired.fault_table import CASES

from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.registers import XL330
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.simple_plant import SimplePlant, SimpleServo
from palpate.hw.ur import UrArm, UrSettings
from palpate.sim.hand.finger import SlideFinger

ADDRESS = "127.0.43.2"
SERVOS = 4
CYCLES = 300.0
"""Of four servos per second, asked for (issue 9): one read of all and one write of goals each."""

SOME = (
    "no. 2: states stay away",
    "protective stop",
    "emergency stop",
    "client process killed",
    "a servo is silent",
    "every checksum wrong",
    "adapter unplugged",
    "F/T box silent",
    "F/T out of range",
    "gap of 5 records",
)


def servos() -> Host:
    """Return a host of four servos, for a process of its own."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, -20)
    bus = DynamixelBus([EmulatedServo(XL330, i + 1) for i in range(SERVOS)])
    return Host(SimplePlant(servos=tuple(SimpleServo() for _ in range(SERVOS))), [bus])


def cycle_rate(seconds: float) -> tuple[float, int]:
    """Return full cycles per second of four servos, and how many exchanges were missed."""
    calibrations = tuple(ServoCalibration(i + 1) for i in range(SERVOS))
    settings = HandSettings(
        calibrations, SlideFinger(pinion=0.02), opening=0.04, tip_along=0.012, watchdog=0.4, silence=0.2
    )
    with EmulatorProcess(servos) as emulator:
        hand = DynamixelHand(emulator.addresses["dynamixel"], settings)
        hand.start()
        missed, cycles, begun = hand.missed, 0, monotonic()
        while monotonic() - begun < seconds:
            with suppress(DeviceError):
                hand.read()
                hand.press((0.0,) * SERVOS)
                cycles += 1
        took, missed = monotonic() - begun, hand.missed - missed
        hand.close()
    return (cycles - missed) / took, missed


def main() -> None:
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, -20)
    resource_tracker.ensure_running()
    console = Console(width=200)
    figures = Table("figure", "asked", "got", title=f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    with EmulatorProcess(controller), UrArm(AGE_ADDRESS, UrSettings(stale_after=0.5, watchdog=0.5)) as arm:
        p50, p99 = np.percentile(ages(arm, 10.0)[:, 0], (50, 99))
    figures.add_row(
        "age of the arm's state at 500 Hz, p50 / p99 [ms]",
        f"{1e3 * AGE_MEDIAN:g} / {1e3 * AGE_99:g}",
        f"{1e3 * p50:.2f} / {1e3 * p99:.2f}",
    )
    with tempfile.TemporaryDirectory() as folder:
        row = measure_rate("Net F/T", 7000.0, 4.0, Path(folder) / "sensor")
    figures.add_row("Net F/T: records a second, lost", "7000, 0", f"{row[2]}, {row[3]}")
    rate, missed = cycle_rate(4.0)
    figures.add_row("Dynamixel: full cycles a second of 4 servos", f"{CYCLES:g}", f"{rate:.0f} ({missed} missed)")
    console.print(figures)
    console.print(shown(campaign(ADDRESS, [case for case in CASES if case.name in SOME], 1)))
    account = Account()
    with Cell(ADDRESS, patience=PATIENT) as cell:
        soak(cell, account, 20.0, 2.0, seed=1)
    show(account, console)


if __name__ == "__main__":
    main()
