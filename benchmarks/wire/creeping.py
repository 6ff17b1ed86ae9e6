"""Detection of a growing delay: a buffer on the line fills while records keep arriving.

Each device's own client talks to its emulator through a line that delays what the device sends, by 5 to 500 ms
more every second (`wire.delayed`): real sockets and terminals, the real ur_rtde and dynamixel_sdk. The line
knows the age of the newest data that it has passed on: the true age but for the time from the device to the
line. A loop of 2 ms judges the samples' own time stamps. Shown are the excess of the true age over its limit at
detection (negative: detected before), and the time since the limit was passed. Then delays jitter from 0 to 20
ms without growing: alarms count while the true age is below the limit. A Dynamixel hand itself refuses replies
later than 6 ms.
"""

import argparse
import math
import os
import random
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from time import monotonic, sleep
from typing import NamedTuple

from harness.campaign import Listing

from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.dynamixel.registers import XL330
from palpate.hw.dynamixel.settings import HandSettings, ServoCalibration
from palpate.hw.emulators.dynamixel.bus import DynamixelBus
from palpate.hw.emulators.dynamixel.servo import EmulatedServo
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtServer
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.serial_ft import BotaServer, ResenseServer
from palpate.hw.emulators.server import Server
from palpate.hw.emulators.simple_plant import SimplePlant, SimpleServo
from palpate.hw.emulators.ur import SimpleUr
from palpate.hw.ft_stream import StreamedSensor, StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings, Scales
from palpate.hw.serial_ft import Bota, Resense, SerialSensor
from palpate.hw.ur import UrArm, UrSettings
from palpate.sim.hand.finger import SlideFinger
from wire.delayed import DelayedLine

RATES = (0.005, 0.02, 0.08, 0.2, 0.5)
PERIOD = 2e-3
LIMIT, JITTERING = 0.1, 60.0
"""[s] Largest age of a sample, and time with jitter only."""

AFTER_STALL = 0.5
"""Time after a stall of the emulator in which its samples are indeed old [s]."""

PATIENCE = 5.0
"""Silence that devices accept [s]: the loop here judges age."""

QUIET = (1e-3,) * 6
STREAM = StreamSettings(QUIET, silent_after=PATIENCE, start_within=20.0)
UR, CONTROLLER = "127.0.9.4", "127.0.9.5"
BOX_PORT = 49207

KNOWN = 20.0
"""Time until the clock of a sensor without echoes is known [s]."""


class Device(NamedTuple):
    """A device behind a line.

    Attributes:
        line: Line to the device.
        age: Returns the age of the newest sample, by its time stamp [s].
        begin: Makes the device ready for the next delay.
    """

    line: DelayedLine
    age: Callable[[], float]
    begin: Callable[[], object]


SERVERS: dict[str, Callable[[], Server]] = {
    "netft": lambda: NetFtServer(BoxSettings(rdt_port=BOX_PORT, calibration_port=0)),
    "bota": BotaServer,
    "resense": ResenseServer,
}
DEVICES = ("ur", *SERVERS, "dynamixel")


def host(kind: str) -> Host:
    """Return the host of a device, whose process keeps its time like a real device."""
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))
    if kind == "ur":
        return SimpleUr(CONTROLLER)()
    if kind == "dynamixel":
        bus = DynamixelBus([EmulatedServo(XL330, 1)])
        return Host(SimplePlant(servos=(SimpleServo(),)), [bus])
    return Host(SimplePlant(), [SERVERS[kind]()])


@contextmanager
def behind_line(kind: str) -> Iterator[Device]:
    """Return a device behind a line."""
    with EmulatorProcess(partial(host, kind)) as emulator, DelayedLine() as line:
        if kind == "ur":
            line.connections(UR, CONTROLLER, (30004, 30003, 29999))
            with UrArm(UR, UrSettings(stale_after=PATIENCE, watchdog=1.0)) as arm:
                yield Device(line, lambda: monotonic() - arm.read().time, lambda: None)
        elif kind == "netft":
            port = line.datagrams(("127.0.0.1", BOX_PORT))
            yield streamed(line, NetFt("127.0.0.1", NetFtSettings(STREAM, Scales(1e-6, 1e-6), rdt_port=port)), 1.0)
        elif kind == "dynamixel":
            (path,) = emulator.addresses.values()
            settings = HandSettings((ServoCalibration(1),), SlideFinger(pinion=0.02), 0.04, 0.0, watchdog=0.0)
            hand = DynamixelHand(line.terminal(path, settings.baud_rate), settings)
            yield Device(line, lambda: monotonic() - hand.read().time, hand.start)
        else:
            (path,) = emulator.addresses.values()
            make = Bota() if kind == "bota" else Resense((12.0, 12.0, 17.0), (0.12, 0.12, 0.12))
            yield streamed(line, SerialSensor(line.terminal(path, make.baud), make, STREAM), KNOWN)


def streamed(line: DelayedLine, sensor: StreamedSensor, settles: float) -> Device:
    """Return a sensor that streams; its clock is known after this time [s]."""

    def begin() -> None:
        sensor.start()
        sleep(settles)

    return Device(line, lambda: monotonic() - sensor.read().time, begin)


def is_old(device: Device, limit: float) -> bool:
    try:
        return device.age() > limit
    except DeviceError:
        return True


def noticed(device: Device, rate: float, limit: float) -> tuple[float, float]:
    """Return the excess of the true age over the limit at detection, and the time since the excess began [s]."""
    line, passed = device.line, math.inf
    device.begin()
    line.creep(rate)
    while True:
        old = is_old(device, limit)
        now = monotonic()
        true = now - line.released  # after the look: what was looked at is as old as this at least
        if true > limit:
            passed = min(passed, now)
        if old:
            break
        sleep(PERIOD)
    line.creep(0.0)
    sleep(1.0)
    return true - limit, max(0.0, now - passed)


def false_alarms(device: Device, seconds: float, limit: float) -> tuple[int, int]:
    """Return the number of false alarms and of samples."""
    line = device.line
    device.begin()
    line.vary(lambda came: 0.02 * random.Random(came).random())
    alarms = looks = 0
    end = monotonic() + seconds
    while monotonic() < end:
        before = monotonic() - line.released
        old = is_old(device, limit)
        now = monotonic()
        alarms += old and max(before, now - line.released) <= limit and now - line.stalled > AFTER_STALL
        looks += 1
        sleep(PERIOD)
    line.creep(0.0)
    return alarms, looks


def creeping(_: argparse.Namespace) -> Iterator[Listing]:
    """Let delays grow, then jitter, for each device."""
    sys.setswitchinterval(2e-4)  # the line, the client and the loop stand for three computers
    rows = []
    for name in DEVICES:
        with behind_line(name) as device:
            cells = [noticed(device, rate, LIMIT) for rate in RATES]
            alarms = ""
            if name != "dynamixel":  # it refuses replies later than 6 ms
                alarms = "{} of {}".format(*false_alarms(device, JITTERING, LIMIT))
            rows.append((name, *(f"{1e3 * over:+.1f} / {1e3 * late:.0f}" for over, late in cells), alarms))
    title = f"true age over its limit of {1e3 * LIMIT:g} ms when noticed / how long after [ms]"
    yield Listing(title, ("device", *(f"{1e3 * rate:g} ms/s" for rate in RATES), "false alarms"), rows)


PARTS = {"creeping": creeping}
