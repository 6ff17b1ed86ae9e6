"""Force/torque sensors on the wire: rates without loss, processor time, time stamps, time to notice faults.

    python benchmarks/wire_netft.py [--seconds 4] [--tries 10]

Emulated sensors in a process of their own, real sockets and pseudo-terminals, the clients that a robot uses. Asked
for (issue 9): 7000 records a second without loss, every fault noticed within 50 ms. It takes about a minute and a
half; close other programs, and expect the largest numbers to be the machine's.
"""

import argparse
import functools
import os
import tempfile
import time
from collections.abc import Callable
from enum import Enum
from pathlib import Path

import numpy as np
import psutil
from rich.console import Console
from rich.table import Table

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
"""Of the emulated box: loopback, and nobody else's."""

NOISE = (0.003, 0.003, 0.003, 1.6e-5, 1.6e-5, 1.6e-5)
"""Of a Nano17 [N, N m]."""

RANGES = ((12.0, 12.0, 17.0), (0.12, 0.12, 0.12))

SLOWEST_NOTICE = 0.05
"""Asked for [s]."""

LOOP = 0.002
"""Period of a control loop that reads the sensor [s]."""


def host(kind: str, rate: float, link: Path) -> Host:
    """Return what the emulator's process runs."""
    server: Server
    if kind == "Net F/T":
        server = NetFtServer(BoxSettings(ADDRESS, rate=rate))
    elif kind == "Bota":
        server = BotaServer(link=link)
    else:
        server = ResenseServer(rate=rate, link=link)
    return Host(SimplePlant(), [server])


def client(kind: str, link: Path) -> StreamedSensor:
    """Return what reads it."""
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


def noticed(sensor: StreamedSensor, sign: Callable[[StreamedSensor], bool]) -> float:
    """Return the time until a sign shows [s]."""
    begin = time.monotonic()
    while not sign(sensor):
        if time.monotonic() - begin > 2.0:
            return float("inf")
        time.sleep(0.0005)
    return time.monotonic() - begin


def fails(sensor: StreamedSensor) -> bool:
    """Whether `read` refuses."""
    try:
        sensor.read()
    except DeviceError:
        return True
    return False


def unhealthy(sensor: StreamedSensor) -> bool:
    """Whether the newest reading says that it is no good; that there is none is something else."""
    try:
        return not sensor.read().healthy
    except DeviceError:
        return False


def counted(name: str) -> Callable[[StreamedSensor], bool]:
    """Return a sign: a count has gone up."""
    before: list[int] = []

    def sign(sensor: StreamedSensor) -> bool:
        value = getattr(sensor.counts, name)
        if not before:
            before.append(value)
        return bool(value > before[0])

    return sign


def wait_until_good(sensor: StreamedSensor) -> float:
    """Return how long it took to be well again [s]."""
    return noticed(sensor, lambda one: not fails(one) and not unhealthy(one))


FAULTS: dict[str, list[tuple[str, float, Callable[[], Callable[[StreamedSensor], bool]]]]] = {
    "Net F/T": [
        ("silent", 1, lambda: fails),
        ("rebooted", 1, lambda: fails),
        ("out_of_range", 1, lambda: unhealthy),
        ("gap", 3, lambda: counted("lost")),
        ("dropped", 2, lambda: counted("lost")),
        ("reordered", 2, lambda: counted("older")),
        ("repeated", 2, lambda: counted("older")),
        ("wrong_length", 2, lambda: counted("refused")),
        ("restarted", 1, lambda: counted("restarts")),
    ],
    "Bota": [
        ("silent", 1, lambda: fails),
        ("rebooted", 1, lambda: fails),
        ("unplugged", 1, lambda: fails),
        ("out_of_range", 1, lambda: unhealthy),
        ("lost_byte", 2, lambda: counted("lost")),
        ("damaged", 2, lambda: counted("lost")),
        ("noise", 2, lambda: counted("refused")),
        ("dropped", 2, lambda: counted("lost")),
    ],
    "Resense": [
        ("silent", 1, lambda: fails),
        ("unplugged", 1, lambda: fails),
        ("out_of_range", 1, lambda: unhealthy),
        ("lost_byte", 2, lambda: counted("lost")),
        ("noise", 2, lambda: counted("refused")),
    ],
}
"""Fault, its value, and what shows it."""

ONCE = ("gap", "restarted", "rebooted")


def measure_faults(kind: str, tries: int, link: Path) -> list[list[str]]:
    """Return rows: times to notice each fault, and to be well again once it is over."""
    rows = []
    with EmulatorProcess(functools.partial(host, kind, 1000.0, link)) as emulator:
        name = next(iter(emulator.addresses))
        sensor = client(kind, link)
        sensor.start()
        time.sleep(1.0)
        for fault, value, sign_of in FAULTS[kind]:
            times, well = [], []
            for _ in range(tries):
                sign = sign_of()
                if sign is not fails and sign is not unhealthy:
                    sign(sensor)
                emulator.control.fault(name, fault, value)
                times.append(noticed(sensor, sign))
                if fault not in ONCE:
                    emulator.control.fault(name, fault, 0)
                well.append(wait_until_good(sensor))
                time.sleep(0.05)
            worst = max(times)
            verdict = "yes" if worst <= SLOWEST_NOTICE else "NO"
            rows.append(
                [
                    kind,
                    fault,
                    f"{1e3 * float(np.median(times)):.0f} / {1e3 * worst:.0f}",
                    verdict,
                    f"{1e3 * float(np.median(well)):.0f}",
                ]
            )
        sensor.close()
    return rows


def main() -> None:
    """Measure and print the tables."""
    parser = argparse.ArgumentParser(description="Measure force/torque sensors on the wire.")
    parser.add_argument("--seconds", type=float, default=4.0, help="for each rate")
    parser.add_argument("--tries", type=int, default=10, help="of each fault")
    options = parser.parse_args()
    console = Console()
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder) / "sensor"
        rates = Table("sensor", "beside", "asked 1/s", "came 1/s", "lost", "emulator", "client", "age ms, p50/p99")
        for kind, rate in (
            ("Net F/T", 500.0),
            ("Net F/T", 1000.0),
            ("Net F/T", 2000.0),
            ("Net F/T", 7000.0),
            ("Bota", 1003.9),
            ("Resense", 1000.0),
        ):
            rates.add_row(*measure_rate(kind, rate, options.seconds, link))
        rates.add_row(*measure_rate("Net F/T", 7000.0, options.seconds, link, Beside.COMPUTING))
        rates.add_row(*measure_rate("Bota", 1003.9, options.seconds, link, Beside.COMPUTING))
        console.print(f"Load of this machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores.")
        console.print(f"Records over {options.seconds:g} s, read every {1e3 * LOOP:g} ms:", rates)
        faults = Table(
            "sensor", "fault", "noticed ms p50 / max", f"within {1e3 * SLOWEST_NOTICE:g} ms", "well again ms"
        )
        for kind in FAULTS:
            for row in measure_faults(kind, options.tries, link):
                faults.add_row(*row)
        console.print(f"Faults, {options.tries} times each:", faults)


if __name__ == "__main__":
    main()
