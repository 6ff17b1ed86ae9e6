"""Cost of foreign connections to a control loop: its lateness with and without them, in pairs.

A loop of 500 Hz commands an emulated UR arm through the real ur_rtde and is shown in a live view. Foreign clients
without a token hold connections to the view and the emulator's control: they begin a request and send one byte a
second (slowloris); those that are closed return every second. They run at the lowest priority, as if on another
computer. Turns with and without them alternate. Then 1020 connections at once to each, and to the arm's dashboard:
page and emulator must still answer.
"""

import argparse
import resource
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from socket import create_connection
from urllib.parse import urlsplit
from urllib.request import urlopen

import numpy as np
from harness.campaign import Listing, raise_priority

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
from palpate.robots.robot import load_robot
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime
from palpate.viewing import ANY_PORT, LiveView

ADDRESS, CONTROL_PORT = "127.0.9.3", 41239
PERIOD = 2e-3
MAX_RATIO = 1.2
"""Largest ratio of the 99 % lateness with foreign clients to that without."""

FOREIGN = 500
"""Foreign connections of a turn."""

WARM_UP = 1.0
"""Initial time of each turn that does not count [s]."""


def controller() -> Host:
    """Return the emulated controller, in its process."""
    raise_priority()
    server = UrServer(ADDRESS, unlock_delay=0.1)
    return Host(SimplePlant(), [server], control_port=CONTROL_PORT)


@contextmanager
def foreign_clients(count: int, where: tuple[str, ...]) -> Iterator[None]:
    """Run foreign clients that are connected, in a process of their own."""
    command = [sys.executable, str(Path(__file__).with_name("foreign_clients.py")), str(count), *where]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.readline()
        try:
            yield
        finally:
            process.kill()


def lateness(arm: UrArm, view: LiveView, periods: list, seconds: float) -> np.ndarray:
    """Return the lateness of each period of a loop [s]."""
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


def connections(options: argparse.Namespace) -> Iterator[Listing]:
    """Measure pairs of turns, then open connections without end."""
    config = ExploreConfig(width=0.01, depth=0.004, out=Path(tempfile.mkdtemp()))
    planned, periods = plan(config, load_robot(config.robot), {}), []
    RecordedRun(planned).run((lambda *period: periods.append(period),))
    turns: dict[bool, list[np.ndarray]] = {False: [], True: []}
    stalls = {False: 0.0, True: 0.0}
    with (
        EmulatorProcess(controller) as emulator,
        LiveView(planned.view(), port=ANY_PORT) as view,
        UrArm(ADDRESS, UrSettings(stale_after=10.0, watchdog=0.5)) as arm,
    ):
        where = (urlsplit(view.url).netloc, f"127.0.0.1:{CONTROL_PORT}", f"{ADDRESS}:{DASHBOARD_PORT}")
        for pair in range(options.tries or 5):
            for foreign in (False, True) if pair % 2 else (True, False):
                with foreign_clients(FOREIGN, where[:2]) if foreign else nullcontext():
                    arm.recover()  # it has waited for a command
                    before = emulator.control.state()["given_up"]
                    turns[foreign].append(lateness(arm, view, periods, options.seconds or 8.0))
                stalls[foreign] += float(emulator.control.state()["given_up"] - before)
        yield compared(turns, stalls)
        yield Listing(
            "1020 connections to each", ("address", "page served", "step"), survive(view, emulator, where)
        )


def compared(turns: dict[bool, list[np.ndarray]], stalls: dict[bool, float]) -> Listing:
    """Return both sides of each pair, and their ratio."""
    rows, ratios = [], []
    for i, (without, with_) in enumerate(zip(turns[False], turns[True], strict=True)):
        a, b = np.percentile(without, (50, 99)), np.percentile(with_, (50, 99))
        ratios.append(b[1] / a[1])
        rows.append((i + 1, *(f"{1e3 * each:.3f}" for each in (a[0], b[0], a[1], b[1])), f"{ratios[-1]:.2f}"))
    without, with_ = (np.percentile(np.concatenate(turns[each]), 99) for each in (False, True))
    notes = (
        f"median ratio of the 99 % lateness {np.median(ratios):.2f}, at most {MAX_RATIO:g} required; "
        f"{with_ / without:.2f} over all periods",
        f"emulator's loop stalled [s]: without {stalls[False]:.2f}, with {stalls[True]:.2f}",
    )
    heads = ("pair", "p50 without", "with", "p99 without", "with", "ratio")
    return Listing("lateness at 500 Hz [ms]", heads, rows, notes=notes)


def survive(view: LiveView, emulator: EmulatorProcess, where: tuple[str, ...]) -> list[tuple[object, ...]]:
    """Open 1020 connections to each address; return whether a client with the token is served, and the step."""
    resource.setrlimit(resource.RLIMIT_NOFILE, (4096, 4096))
    rows = []
    for each in where:
        host, port = each.rsplit(":", 1)
        opened = [create_connection((host, int(port)), 5.0) for _ in range(1020)]
        with urlopen(view.url, timeout=30.0) as page:
            rows.append((each, page.status == 200, emulator.control.state()["steps"]))
        for one in opened:
            one.close()
    return rows


PARTS = {"connections": connections}
