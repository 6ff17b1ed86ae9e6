"""How late a delay is noticed that creeps: a buffer on the line that fills, while records go on arriving.

    python benchmarks/creeping_delay.py [--device ur netft bota resense dynamixel] [--quiet 60]

Each device's own client talks to its emulator through a line that holds back what the device sends, by 5 to 500
ms more every second (`wired/delayed.py`): real sockets and terminals, the real ur_rtde and dynamixel_sdk. The line
knows how old the newest is that it has passed on: the true age, but for the time from the device to the line. A
loop of 2 ms judges the samples' own time stamps. Shown are by how much the true age is over its limit when the
loop notices (negative: it notices before), and how long after that was. Then, without creeping, delays jitter from
0 to 20 ms: alarms are counted for as long as the true age itself is below the limit. A Dynamixel hand refuses
replies later than 6 ms by itself.
"""

import argparse
import math
import os
import random
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from time import monotonic, sleep
from typing import NamedTuple

from rich.console import Console
from rich.table import Table
from wired.delayed import DelayedLine

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
from palpate.hw.emulators.simple_plant import SimplePlant, SimpleServo
from palpate.hw.emulators.ur import SimpleUr
from palpate.hw.ft_stream import StreamedSensor, StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings, Scales
from palpate.hw.serial_ft import Bota, Resense, SerialSensor
from palpate.hw.ur import UrArm, UrSettings
from palpate.sim.hand.finger import SlideFinger

RATES = (0.005, 0.02, 0.08, 0.2, 0.5)
PERIOD = 2e-3
AFTER_STALL = 0.5
"""[s] after an emulator stood still, on a busy computer, in which its samples are old indeed."""

PATIENCE = 5.0
"""[s] for which devices themselves accept silence: the loop here judges age."""

QUIET = (1e-3,) * 6
STREAM = StreamSettings(QUIET, silent_after=PATIENCE, start_within=20.0)
UR, CONTROLLER = "127.0.9.4", "127.0.9.5"
BOX_PORT = 49207

KNOWN = 20.0
"""[s] until the clock of a sensor without echoes is known."""


class Device(NamedTuple):
    """A device behind a line.

    Attributes:
        line: See there.
        age: Returns the age of its newest sample, by its time stamp [s].
        begin: Makes it ready for the next delay.
    """

    line: DelayedLine
    age: Callable[[], float]
    begin: Callable[[], object]


@contextmanager
def ur() -> Iterator[Device]:
    with EmulatorProcess(ur_host), DelayedLine() as line:
        line.connections(UR, CONTROLLER, (30004, 30003, 29999))
        with UrArm(UR, UrSettings(stale_after=PATIENCE, watchdog=1.0)) as arm:
            yield Device(line, lambda: monotonic() - arm.read().time, lambda: None)


def urgent() -> None:
    """Let the emulator keep its time, as a real device does."""
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))


def ur_host() -> Host:
    urgent()
    return SimpleUr(CONTROLLER)()


def box_host() -> Host:
    urgent()
    return Host(SimplePlant(), [NetFtServer(BoxSettings(rdt_port=BOX_PORT, calibration_port=0))])


@contextmanager
def netft() -> Iterator[Device]:
    with EmulatorProcess(box_host), DelayedLine() as line:
        port = line.datagrams(("127.0.0.1", BOX_PORT))
        yield streamed(line, NetFt("127.0.0.1", NetFtSettings(STREAM, Scales(1e-6, 1e-6), rdt_port=port)), 1.0)


def bota_host() -> Host:
    urgent()
    return Host(SimplePlant(), [BotaServer()])


def resense_host() -> Host:
    urgent()
    return Host(SimplePlant(), [ResenseServer()])


@contextmanager
def bota() -> Iterator[Device]:
    with EmulatorProcess(bota_host) as emulator, DelayedLine() as line:
        (path,) = emulator.addresses.values()
        yield streamed(line, SerialSensor(line.terminal(path, Bota.baud), Bota(), STREAM), KNOWN)


@contextmanager
def resense() -> Iterator[Device]:
    with EmulatorProcess(resense_host) as emulator, DelayedLine() as line:
        (path,) = emulator.addresses.values()
        make = Resense((12.0, 12.0, 17.0), (0.12, 0.12, 0.12))
        yield streamed(line, SerialSensor(line.terminal(path, make.baud), make, STREAM), KNOWN)


def streamed(line: DelayedLine, sensor: StreamedSensor, settles: float) -> Device:
    def begin() -> None:
        sensor.start()
        sleep(settles)

    return Device(line, lambda: monotonic() - sensor.read().time, begin)


def bus_host() -> Host:
    urgent()
    bus = DynamixelBus([EmulatedServo(XL330, 1)])
    return Host(SimplePlant(servos=(SimpleServo(),)), [bus])


@contextmanager
def dynamixel() -> Iterator[Device]:
    with EmulatorProcess(bus_host) as emulator, DelayedLine() as line:
        (path,) = emulator.addresses.values()
        settings = HandSettings((ServoCalibration(1),), SlideFinger(pinion=0.02), 0.04, 0.0, watchdog=0.0)
        hand = DynamixelHand(line.terminal(path, settings.baud_rate), settings)

        yield Device(line, lambda: monotonic() - hand.read().time, hand.start)


DEVICES = {"ur": ur, "netft": netft, "bota": bota, "resense": resense, "dynamixel": dynamixel}


def is_old(device: Device, limit: float) -> bool:
    try:
        return device.age() > limit
    except DeviceError:
        return True


def noticed(device: Device, rate: float, limit: float) -> tuple[float, float]:
    """Return by how much the true age was over the limit when the loop noticed [s], and how long after [s]."""
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
    """Return how often a sample was called old that was not, and of how many."""
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--device", nargs="+", choices=DEVICES, default=list(DEVICES))
    parser.add_argument("--limit", type=float, default=0.1, help="of the age [s]")
    parser.add_argument("--quiet", type=float, default=60.0, help="time with jitter of 20 ms and no creeping [s]")
    asked = parser.parse_args()
    sys.setswitchinterval(2e-4)  # the line, the client and the loop stand for three computers
    columns = [f"{1e3 * rate:g} ms/s" for rate in RATES]
    title = f"true age over its limit of {1e3 * asked.limit:g} ms when noticed / how long after [ms]"
    table = Table("device", *columns, "false alarms", title=title)
    for name in asked.device:
        with DEVICES[name]() as device:
            cells = []
            for rate in RATES:
                over, late = noticed(device, rate, asked.limit)
                cells.append(f"{1e3 * over:+.1f} / {1e3 * late:.0f}")
            alarms = ""
            if name != "dynamixel" and asked.quiet:  # it refuses replies later than 6 ms
                alarms = "{} of {}".format(*false_alarms(device, asked.quiet, asked.limit))
            table.add_row(name, *cells, alarms)
            Console().print(name, *cells, alarms)
    Console().print(table)


if __name__ == "__main__":
    main()
