"""A process that records at 1 kHz is killed: all but the last half second can be read."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from palpate.runtime.log import read_log
from runtime.log.log_examples import a_run, bits

WRITER = """
import sys, time
sys.path.insert(0, {tests!r})
from dataclasses import replace
from pathlib import Path
from palpate.runtime.log import LogWriter, Recorder
from runtime.log.log_examples import PERIOD, a_run
periods = a_run(20)
clock = time.monotonic  # the same for all processes
print("ready", flush=True)
sys.stdin.readline()
recorder = Recorder(LogWriter(Path({path!r})))
deadline = clock()
recorder.start(replace(periods[0][0], time=deadline), periods[0][1], PERIOD)
print("started", flush=True)
number = 0
while True:
    sample, *rest = periods[number % 20]
    recorder.record(replace(sample, time=deadline), *rest)
    number += 1
    deadline += PERIOD
    time.sleep(max(0.0, deadline - clock()))
"""


def killed(paths, rng):
    """Let processes record for a while, one after the other since cores are few, and kill them; returns when."""
    processes, moments = [], []
    for path in paths:
        script = WRITER.format(tests=str(Path(__file__).parents[2]), path=str(path))
        process = subprocess.Popen([sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        processes.append(process)
    for process in processes:
        with process:
            assert process.stdout.readline() == b"ready\n"
            process.stdin.write(b"\n")
            process.stdin.flush()
            assert process.stdout.readline() == b"started\n"
            time.sleep(rng.uniform(0.3, 1.8))
            moments.append(time.monotonic())
            process.kill()
    return moments


def check(folder, trials, seed):
    rng = np.random.default_rng(seed)
    periods, lost = a_run(20), []
    paths = [folder / f"{trial}.mcap" for trial in range(trials)]
    moments = [moment for some in batches(paths, 4) for moment in killed(some, rng)]
    for path, moment in zip(paths, moments, strict=True):
        log = read_log(path)
        lost.append(moment - log.rows[-1, 0])
        assert not log.complete
        assert log.sequence.tolist() == list(range(len(log)))
        for number, sample in zip(log.sequence, log.samples(), strict=True):
            assert bits(sample.arm) == bits(periods[number % 20][0].arm)
    assert max(lost) <= 0.5, f"lost {sorted(lost)} s"
    return lost


def batches(paths, size):
    return [paths[i : i + size] for i in range(0, len(paths), size)]


@pytest.mark.slow
def test_a_killed_process_loses_at_most_half_a_second(tmp_path):
    check(tmp_path, 3, seed=1)


@pytest.mark.slow
def test_a_killed_process_loses_at_most_half_a_second_in_20_trials(tmp_path):
    lost = check(tmp_path, 20, seed=2)
    print(f"lost {min(lost):.3f} to {max(lost):.3f} s, median {np.median(lost):.3f} s")  # noqa: T201
