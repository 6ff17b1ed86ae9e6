"""Real processes, real signals: the loop dies, the device stops itself; the device dies, the loop says so."""

import os
import random
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest

from faults import watchdog_device
from faults.device_client import PERIOD
from faults.loop_process import LIMITS
from faults.watchdog_device import TICK, WATCHDOG
from palpate.runtime.log import Level, read_log

HERE = Path(watchdog_device.__file__).parent
PYTHONPATH = os.pathsep.join(filter(None, (str(HERE.parent), os.environ.get("PYTHONPATH"))))
ENVIRONMENT = os.environ | {"PYTHONPATH": PYTHONPATH}
LATE = 0.02
"""[s]: for a signal to arrive, or a packet."""
MOST_LOST = 250
"""Of the log [periods]: two blocks of 0.2 s, and some that are on their way."""
RESTS = 1e-6
"""[m/s]"""
PROCESS_TIMEOUT = 30.0
"""For a process to do what it should [s]."""


class Device:
    """`watchdog_device` in its process."""

    def __init__(self, port: int = 0) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-I", str(HERE / "watchdog_device.py"), str(port)], stdout=subprocess.PIPE, text=True
        )
        self.port = int(self.reported("port")[0])

    def reported(self, what: str) -> list[float]:
        """Wait for the next line of a kind; return its numbers."""
        for line in self.process.stdout:
            kind, *numbers = line.split()
            if kind == what:
                return [float(x) for x in numbers]
        raise AssertionError(f"the device ended without a word of {what!r}")

    def rest(self) -> list[str]:
        """Have it end; return all that it has still to say."""
        self.process.terminate()
        return self.process.communicate(timeout=PROCESS_TIMEOUT)[0].splitlines()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()


@contextmanager
def loop_against(device: Device, log: Path, seconds: float = 60.0):
    """`loop_process`, once it moves the device."""
    process = subprocess.Popen(
        [sys.executable, "-m", "faults.loop_process", str(device.port), str(log), str(seconds)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ENVIRONMENT,
    )
    try:
        assert process.stdout.readline() == "running\n", process.stderr.read()
        yield process
    finally:
        process.kill()
        process.communicate()


@dataclass(frozen=True)
class Killed:
    """What was left of a run that was killed.

    Attributes:
        stop: From the last command that arrived to the device's standing still [its ticks].
        lost: Of the log, up to the last command that arrived [periods].
    """

    stop: int
    lost: int


def kill_nine(folder: Path, after: float) -> Killed:
    path = folder / "run.mcap"
    with Device() as device, loop_against(device, path) as loop:
        time.sleep(after)
        loop.kill()
        loop.wait()
        # on a busy machine it may have been stopped before, and moved again
        *_, stopped, final = device.rest()
        log = read_log(path)
    assert final == "final 0.0 0.0"
    assert log.gaps == ()
    assert not log.complete
    times = [log.heading.first_time, *log.record().time.tolist()]
    assert all(earlier <= later for earlier, later in pairwise(times))
    commands, ticks = map(int, stopped.split()[1:])
    return Killed(ticks, commands - len(times))


def check_killed(found: Killed) -> None:
    assert found.stop == round(WATCHDOG / TICK) + 1
    assert found.lost <= MOST_LOST


@pytest.mark.slow
@pytest.mark.parametrize("after", [0.05, 0.55, 0.85])
def test_after_kill_nine_the_device_stops_itself_and_the_log_is_readable(after, tmp_path):
    check_killed(kill_nine(tmp_path, after))


@pytest.mark.slow
@pytest.mark.parametrize("trial", range(20))
def test_after_kill_nine_at_any_time_the_device_stops_and_the_log_is_readable(trial, tmp_path):
    check_killed(kill_nine(tmp_path, random.Random(trial).uniform(0.0, 1.5)))


@pytest.mark.slow
@pytest.mark.parametrize(("number", "name"), [(signal.SIGINT, "Ctrl-C"), (signal.SIGTERM, "kill")])
def test_a_process_asked_to_stop_ends_in_good_order(number, name, tmp_path):
    path = tmp_path / "run.mcap"
    with Device() as device, loop_against(device, path) as loop:
        time.sleep(0.2)
        asked = time.monotonic()
        loop.send_signal(number)
        _, message = loop.communicate(timeout=PROCESS_TIMEOUT)
        *_, final = device.rest()
    assert loop.returncode == 130
    assert message == "interrupted; the robot was stopped; at rest: True\n"
    assert float(final.split()[1]) < RESTS
    log = read_log(path)
    assert log.complete
    assert log.events[-1].text == "ended: interrupted"
    record = log.record()
    late = record.time > asked + 2 * PERIOD + LATE
    assert late.sum() >= 9  # it stood still for 20 ms, recorded
    assert not record.command[late].any()


@pytest.mark.slow
def test_a_device_that_dies_ends_the_run_with_a_word(tmp_path):
    path = tmp_path / "run.mcap"
    with Device() as device, loop_against(device, path) as loop:
        died = time.monotonic()
        device.process.kill()
        _, message = loop.communicate(timeout=PROCESS_TIMEOUT)
    assert loop.returncode == 1
    assert "back end was ConnectionRefusedError" in message
    assert "at rest: False" in message  # nobody knows
    log = read_log(path)
    assert log.complete
    (trip,) = [event for event in log.events if event.source == "supervisor"]
    assert trip.level is Level.ERROR
    assert trip.time < died + LIMITS.sample_age + 2 * PERIOD


@pytest.mark.slow
def test_a_device_that_hangs_is_noticed_by_its_own_time_stamps_and_finds_only_stops_when_it_wakes(tmp_path):
    path = tmp_path / "run.mcap"
    with Device() as device, loop_against(device, path) as loop:
        device.process.send_signal(signal.SIGSTOP)
        hung = time.monotonic()
        _, message = loop.communicate(timeout=PROCESS_TIMEOUT)
        device.process.send_signal(signal.SIGCONT)
        time.sleep(0.1)
        *_, final = device.rest()
    assert loop.returncode == 1
    assert "age of the sample of the arm" in message
    assert "at rest: False" in message
    assert float(final.split()[1]) < RESTS
    record = read_log(path).record()
    late = record.time > hung + LIMITS.sample_age + 2 * PERIOD + LATE
    assert late.sum() > 50
    assert not record.command[late].any()


@pytest.mark.slow
def test_a_device_that_restarts_is_not_moved_until_somebody_looks(tmp_path):
    path = tmp_path / "run.mcap"
    with Device() as device, loop_against(device, path) as loop:
        device.process.kill()
        device.process.wait()
        with Device(device.port) as again:
            _, message = loop.communicate(timeout=PROCESS_TIMEOUT)
            left = again.rest()
    assert loop.returncode == 1
    assert "stopped by the supervisor" in message
    assert left == ["final 0.0 0.0"]  # nothing to be stopped by the watchdog: it was never commanded to move
    assert read_log(path).complete
