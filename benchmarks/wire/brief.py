"""Devices on the wire in two minutes: ages, rates, ten faults, a short soak."""

import argparse
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from multiprocessing import resource_tracker
from pathlib import Path
from time import monotonic

import numpy as np
from harness.campaign import Listing, load, raise_priority

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
from wire.age import ADDRESS as AGE_ADDRESS
from wire.age import AGE_99, AGE_MEDIAN, ages, controller
from wire.cell import PATIENT, Cell
from wire.fault_table import CASES
from wire.faults import campaign, listed
from wire.sensors import measure_rate
from wire.soak import Account, accounts, soak

ADDRESS = "127.0.43.2"
SERVOS = 4
CYCLE_RATE = 300.0
"""Required cycles per second of four servos: one read of all and one write of goals each."""

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
    raise_priority()
    bus = DynamixelBus([EmulatedServo(XL330, i + 1) for i in range(SERVOS)])
    return Host(SimplePlant(servos=tuple(SimpleServo() for _ in range(SERVOS))), [bus])


def cycle_rate(seconds: float) -> tuple[float, int]:
    """Return full cycles per second of four servos, and the number of missed exchanges."""
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


def brief(_: argparse.Namespace) -> Iterator[Listing]:
    """Measure a little of everything; nothing is judged, since `make bench` runs on any machine."""
    raise_priority()
    resource_tracker.ensure_running()
    with EmulatorProcess(controller), UrArm(AGE_ADDRESS, UrSettings(stale_after=0.5, watchdog=0.5)) as arm:
        p50, p99 = 1e3 * np.percentile(ages(arm, 10.0)[:, 0], (50, 99))
    with tempfile.TemporaryDirectory() as folder:
        row = measure_rate("Net F/T", 7000.0, 4.0, Path(folder) / "sensor")
    rate, missed = cycle_rate(4.0)
    limits = f"{1e3 * AGE_MEDIAN:g} / {1e3 * AGE_99:g}"
    rows = (
        ("age of the arm's state at 500 Hz, p50 / p99 [ms]", limits, f"{p50:.2f} / {p99:.2f}"),
        ("Net F/T: records a second, lost", "7000, 0", f"{row[3]}, {row[4]}"),
        ("Dynamixel: full cycles a second of 4 servos", f"{CYCLE_RATE:g}", f"{rate:.0f} ({missed} missed)"),
    )
    yield Listing(load(), ("figure", "asked", "got"), rows)
    yield replace(listed(campaign(ADDRESS, [case for case in CASES if case.name in SOME], 1)), met=True)
    account = Account()
    with Cell(ADDRESS, patience=PATIENT) as cell:
        soak(cell, account, 20.0, 2.0, seed=1)
    yield accounts(account)


PARTS = {"brief": brief}
