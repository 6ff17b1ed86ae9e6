"""What connections of strangers cost a control loop: its lateness with and without them, in pairs.

    python benchmarks/foreign_connections.py [--pairs 5] [--seconds 8] [--connections 500]

A loop of 500 Hz commands an emulated UR arm through the real ur_rtde and is shown in a live view. Strangers hold
connections to the view and the emulator's control: without a token they begin a request and go on
by one byte a second (slowloris); those that are closed come again every second. They run at the lowest urgency, as
if on another computer. With and without take turns; how long the emulator's loop stalled stands beside. Then 1020
connections at once to each, and to the arm's dashboard: page and emulator must still be there.
"""

import argparse
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path
from socket import create_connection
from urllib.parse import urlsplit
from urllib.request import urlopen

import numpy as np
from rich.console import Console
from rich.table import Table

from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.hw.devices import DeviceError
from palpate.hw.emulators.host import Host
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.simple_plant import SimplePlant
from palpate.hw.emulators.ur import UrServer
from palpate.hw.emulators.ur.server import DASHBOARD_PORT
from palpate.hw.ur import UrArm, UrSettings
from palpate.robots.values import load_named_robot
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime
from palpate.viewing import ANY_PORT, LiveView

ADDRESS, CONTROL_PORT = "127.0.9.3", 41239
PERIOD = 2e-3
ASKED = 1.2
"""What the 99 % lateness with strangers may be of that without."""

WARM_UP = 1.0
"""[s] of each turn that do not count."""


def controller() -> Host:
    """Return the emulated controller, in its process."""
    with suppress(OSError):
        os.setpriority(os.PRIO_PROCESS, 0, -20)
    server = UrServer(ADDRESS, unlock_delay=0.1)
    return Host(SimplePlant(), [server], control_port=CONTROL_PORT)


@contextmanager
def foreign_clients(count: int, where: tuple[str, ...]) -> Iterator[None]:
    """Have strangers, in a process of their own, who have come already."""
    command = [sys.executable, str(Path(__file__).with_name("foreign_clients.py")), str(count), *where]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        try:
            yield
        finally:
            process.kill()


def lateness(arm: UrArm, view: LiveView, periods: list, seconds: float) -> np.ndarray:
    """Return how late each period of a loop began [s]."""
    late = []
    pace = RealTime(PERIOD, priority=USUAL_PRIORITY)
    pace.start()
    for i in range(round((WARM_UP + seconds) / PERIOD)):
        pace.wait()
        late.append(pace.lateness)
        try:
            arm.read()
            arm.move((0.01 if i // 250 % 2 else -0.01, 0.0, 0.0), (0.0, 0.0, 0.0))
        except DeviceError as error:  # the machine's stalls, too, are longer than the arm's watchdog at times
            print(f"recovered from: {error}")
            arm.recover()
            pace.start()
        view.observe(*periods[i % len(periods)])
    pace.stop()
    return np.array(late[round(WARM_UP / PERIOD) :])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--connections", type=int, default=500)
    asked = parser.parse_args()
    config = ExploreConfig(width=0.01, depth=0.004, out=Path(tempfile.mkdtemp()))
    planned, periods = plan(config, load_named_robot(config.robot), {}), []
    RecordedRun(planned).run((lambda *period: periods.append(period),))
    with (
        EmulatorProcess(controller) as emulator,
        LiveView(planned.view(), port=ANY_PORT) as view,
        UrArm(ADDRESS, UrSettings(stale_after=10.0, watchdog=0.5)) as arm,
    ):
        where = (urlsplit(view.url).netloc, f"127.0.0.1:{CONTROL_PORT}", f"{ADDRESS}:{DASHBOARD_PORT}")
        turns: dict[bool, list[np.ndarray]] = {False: [], True: []}
        stalls: dict[bool, list[float]] = {False: [], True: []}
        for pair in range(asked.pairs):
            for strangers in (False, True) if pair % 2 else (True, False):
                with foreign_clients(asked.connections, where[:2]) if strangers else nullcontext():
                    arm.recover()  # it has waited for a command
                    before = emulator.control.state()
                    turns[strangers].append(lateness(arm, view, periods, asked.seconds))
                stalls[strangers].append(stalled(before, emulator.control.state()))
        show(turns)
        print(f"emulator's loop stalled [s]: without {sum(stalls[False]):.2f}, with {sum(stalls[True]):.2f}")
        survive(view, emulator, where)


def stalled(before: dict, after: dict) -> float:
    """Return for how long the emulator's loop was held up and gave periods up [s]."""
    return float(after["given_up"] - before["given_up"])


def show(turns: dict[bool, list[np.ndarray]]) -> None:
    """Print both sides of each pair, and their ratio."""
    table = Table("pair", "p50 without", "with", "p99 without", "with", "ratio", title="lateness at 500 Hz [ms]")
    ratios = []
    for i, (without, with_) in enumerate(zip(turns[False], turns[True], strict=True)):
        a, b = np.percentile(without, (50, 99)), np.percentile(with_, (50, 99))
        ratios.append(b[1] / a[1])
        table.add_row(str(i + 1), *(f"{1e3 * each:.3f}" for each in (a[0], b[0], a[1], b[1])), f"{ratios[-1]:.2f}")
    whole = (np.percentile(np.concatenate(turns[each]), 99) for each in (True, False))
    table.caption = (
        f"median ratio of the 99 % lateness {np.median(ratios):.2f}, asked {ASKED:g}; "
        f"of all periods together {next(whole) / next(whole):.2f}"
    )
    Console().print(table)


def survive(view: LiveView, emulator: EmulatorProcess, where: tuple[str, ...]) -> None:
    """Open 1020 connections to each, and see that whoever has the token is served."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
    for each in where:
        host, port = each.rsplit(":", 1)
        opened = [create_connection((host, int(port)), 5.0) for _ in range(1020)]
        with urlopen(view.url, timeout=30.0) as page:
            served = page.status == 200
        steps = emulator.control.state()["steps"]
        print(f"1020 connections to {each}: page served {served}, emulator at step {steps}")
        for one in opened:
            one.close()


if __name__ == "__main__":
    main()
