"""A process that records at 1 kHz is killed: all but the last half second can be read."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from palpate.runtime.log import read_log
from runtime.log.log_examples import a_run, bits
from support.waiting import until

WRITER = """
import os, sys, time
sys.path.insert(0, {tests!r})
from dataclasses import replace
from pathlib import Path
from palpate.runtime.log import LogWriter, Recorder
from runtime.log.log_examples import PERIOD, a_run
periods = a_run(20)
counter = os.open({path!r} + ".count", os.O_CREAT | os.O_WRONLY)
print("ready", flush=True)
sys.stdin.readline()
writer = LogWriter(Path({path!r}))
recorder = Recorder(writer)
recorder.start(replace(periods[0][0], time=0.0), periods[0][1], PERIOD)
number = 0
while True:
    sample, *rest = periods[number % 20]
    recorder.record(replace(sample, time=number * PERIOD), *rest)
    number += 1
    os.pwrite(counter, b"%d" % number, 0)
    time.sleep(PERIOD)
    while number - writer._written >= {most}:  # no disk is that slow, but a busy machine may be
        time.sleep(PERIOD)
"""

MOST_LOST = 400
"""Periods, of 1 ms: one block that is being packed, and one that is being written."""


def killed(paths, rng):
    """Let processes record for a while, one after the other since cores are few, and kill them."""
    processes = []
    for path in paths:
        script = WRITER.format(tests=str(Path(__file__).parents[2]), path=str(path), most=MOST_LOST)
        words = [sys.executable, "-c", script]
        processes.append(subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE))
    for path, process in zip(paths, processes, strict=True):
        with process:
            assert process.stdout.readline() == b"ready\n"
            process.stdin.write(b"\n")
            process.stdin.flush()
            periods = rng.integers(300, 1800)
            until(lambda path=path, periods=periods: recorded(path) >= periods)
            process.kill()


def recorded(path):
    """How many periods were recorded, whether or not they got to the disk."""
    return int(path.with_name(path.name + ".count").read_bytes() or 0)


@pytest.mark.slow
def test_a_killed_process_loses_at_most_half_a_second(tmp_path):
    rng, periods = np.random.default_rng(2), a_run(20)
    paths = [tmp_path / f"{trial}.mcap" for trial in range(20)]
    for first in range(0, 20, 4):
        killed(paths[first : first + 4], rng)
    for path in paths:
        log = read_log(path)
        assert recorded(path) - len(log) <= MOST_LOST
        assert not log.complete
        assert log.sequence.tolist() == list(range(len(log)))
        for number, sample in zip(log.sequence, log.samples(), strict=True):
            assert bits(sample.arm) == bits(periods[number % 20][0].arm)
