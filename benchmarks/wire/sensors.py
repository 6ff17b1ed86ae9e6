"""Force/torque sensors on the wire: rates without loss, processor time, time stamps.

Emulated sensors run in a process of their own, with real sockets and pseudo-terminals and the clients that a robot
uses. Required: 7000 records a second without loss. Faults of sensors: `wire.fault_table`.
"""

import argparse
import functools
import tempfile
import time
from collections.abc import Iterator
from enum import Enum
from pathlib import Path

import numpy as np
import psutil
from harness.campaign import Listing, load

from palpate.hw.devices import DeviceError
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.netft import BoxSettings, NetFtServer
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.serial_ft import BotaServer, ResenseServer
from palpate.hw.emulators.server import Server
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.ft_stream import StreamedSensor, StreamSettings
from palpate.hw.netft import NetFt, NetFtSettings
from palpate.hw.serial_ft import Bota, Resense, SerialSensor

ADDRESS = "127.0.17.1"
"""Address of the emulated box."""

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
"""Noise of a Nano17 [N, N m]."""

RANGES = ((12.0, 12.0, 17.0), (0.12, 0.12, 0.12))

LOOP = 0.002
"""Period of a control loop that reads the sensor [s]."""


def host(kind: str, rate: float, link: Path) -> Host:
    """Return the host of the emulator's process."""
    server: Server
    if kind == "Net F/T":
        server = NetFtServer(BoxSettings(ADDRESS, rate=rate))
    elif kind == "Bota":
        server = BotaServer(link=link)
    else:
        server = ResenseServer(rate=rate, link=link)
    return Host(SimplePlant(), [server])


def client(kind: str, link: Path) -> StreamedSensor:
    """Return the client of the sensor."""
    stream = StreamSettings(NOISE)
    if kind == "Net F/T":
        return NetFt(ADDRESS, NetFtSettings(stream))
    return SerialSensor(str(link), Bota(51) if kind == "Bota" else Resense(*RANGES), stream)


def emulator_cpu() -> float:
    """Return the processor time of the emulator's process [s]."""
    used = 0.0
    for child in psutil.Process().children(recursive=True):
        times = child.cpu_times()
        used += times.user + times.system
    return used


class Beside(Enum):
    """What the thread that reads the sensor does between two readings."""

    LOOP = "a loop"
    """It sleeps, like a control loop that has done its work."""
    COMPUTING = "computing"
    """It computes in Python and never gives the interpreter away by itself."""


def compute() -> None:
    """Keep the interpreter for a while."""
    for _ in range(20_000):
        pass


def measure_rate(kind: str, rate: float, seconds: float, link: Path, beside: Beside = Beside.LOOP) -> list[str]:
    """Return a row: what came in a while, what was lost, what it cost, how old and how steady its times are."""
    with EmulatorProcess(functools.partial(host, kind, rate, link)):
        sensor = client(kind, link)
        sensor.start()
        own, other = time.process_time(), emulator_cpu()
        records, lost, begin = sensor.counts.records, sensor.counts.lost, time.monotonic()
        ages, wait = [], begin
        while wait < begin + seconds:
            if beside is Beside.COMPUTING:
                compute()
                wait = time.monotonic()
            else:
                wait += LOOP
                time.sleep(max(wait - time.monotonic(), 0.0))
            try:
                ages.append(time.monotonic() - sensor.read().time)
            except DeviceError as error:
                print(f"  {kind} at {rate:g}/s: {error}")
        took, came, lost = time.monotonic() - begin, sensor.counts.records - records, sensor.counts.lost - lost
        own, other = time.process_time() - own, emulator_cpu() - other
        sensor.close()
    age = 1e3 * np.percentile(ages, [50, 99])
    return [
        kind,
        beside.value,
        f"{rate:g}",
        f"{came / took:.1f}",
        str(lost),
        f"{100 * other / took:.0f} %",
        f"{100 * own / took:.0f} %",
        f"{age[0]:.2f} / {age[1]:.2f}",
    ]


RATES = (
    ("Net F/T", 500.0, Beside.LOOP),
    ("Net F/T", 1000.0, Beside.LOOP),
    ("Net F/T", 2000.0, Beside.LOOP),
    ("Net F/T", 7000.0, Beside.LOOP),
    ("Bota", 1003.9, Beside.LOOP),
    ("Resense", 1000.0, Beside.LOOP),
    ("Net F/T", 7000.0, Beside.COMPUTING),
    ("Bota", 1003.9, Beside.COMPUTING),
)


def sensors(options: argparse.Namespace) -> Iterator[Listing]:
    """Measure rates."""
    seconds = options.seconds or 4.0
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder) / "sensor"
        rates = [measure_rate(kind, rate, seconds, link, beside) for kind, rate, beside in RATES]
    heads = ("sensor", "beside", "asked 1/s", "came 1/s", "lost", "emulator", "client", "age ms, p50/p99")
    yield Listing(f"records over {seconds:g} s, read every {1e3 * LOOP:g} ms, {load()}", heads, rates)


PARTS = {"sensors": sensors}
