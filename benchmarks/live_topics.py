"""What topics that are sent to Foxglove cost a loop at 1 kHz.

    python benchmarks/live_topics.py [--pairs 4] [--seconds 6]

The loop senses random wrenches on a sphere and records, as in `benchmarks/recording.py`. In every second run its
topics are served as well, and a page that has subscribed to all of them reads them, in a process of its own. What
the machine does besides is in both runs of a pair.
"""

import argparse
import json
import multiprocessing
import os
import time
from dataclasses import dataclass
from multiprocessing.synchronize import Event

import numpy as np
from recording import MICRO, PERIOD, samples
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from palpate import Sphere
from palpate.runtime import Command, Finger, Touch
from palpate.runtime.interpreter import undisturbed
from palpate.runtime.log import MemoryLog, Recorder
from palpate.runtime.log.standard.topics import PLAIN_ROBOT
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime
from palpate.viewing import LOOPBACK
from palpate.viewing.live_topics import LiveTopics
from palpate.viewing.topic_viewers import FOXGLOVE


@dataclass(frozen=True, slots=True, eq=False)
class Paced:
    """Of one run: times of sending and lateness of each period, shape (n,) [s], and how many overran."""

    send: np.ndarray
    lateness: np.ndarray
    overruns: int


def paced(seconds: float, live: LiveTopics | None) -> Paced:
    """Run at 1 kHz."""
    given = samples(round(seconds / PERIOD))
    touch, pacer, command = Touch(Finger(Sphere(0.008))), RealTime(PERIOD, priority=USUAL_PRIORITY), Command()
    recorder = Recorder(MemoryLog(), *(() if live is None else live.sinks))
    recorder.start(given[0], touch.sense(given[0]), PERIOD)
    send, lateness, overruns = np.zeros(len(given)), np.zeros(len(given)), 0
    clock = time.perf_counter
    pacer.start()
    with undisturbed():
        for i, sample in enumerate(given):
            woken = clock()
            now = touch.sense(sample)
            sensed = clock()
            if live is not None:
                live.observe(sample, now, command)
            sent = clock()
            recorder.record(sample, now, command, sensed - woken, pacer.lateness)
            send[i], lateness[i] = sent - sensed, pacer.lateness
            overruns += pacer.lateness + clock() - woken > PERIOD
            pacer.wait()
    pacer.stop()
    recorder.close()
    return Paced(send[100:], lateness[100:], overruns)


def page(url: str, ready: Event) -> None:
    """Subscribe to everything, and read it until the server ends."""
    os.nice(10)
    with connect(url, subprotocols=["foxglove.sdk.v1"]) as socket:
        ready.set()
        try:
            while True:
                message = socket.recv()
                if isinstance(message, str) and (channels := json.loads(message).get("channels")):
                    time.sleep(0.1)  # who answers at once is told that there is no such channel
                    wanted = [{"id": each["id"], "channelId": each["id"]} for each in channels]
                    socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))
        except ConnectionClosed:
            return


def served(seconds: float) -> Paced:
    """Run with topics served to a page."""
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    with LiveTopics(FOXGLOVE, PLAIN_ROBOT, LOOPBACK, 0) as live:
        reader = context.Process(target=page, args=(live.url, ready), daemon=True)
        reader.start()
        ready.wait()
        found = paced(seconds, live)
    reader.join()
    return found


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=6.0)
    asked, console = parser.parse_args(), Console(width=130)
    without, with_it = [], []
    with Progress(console=console, transient=True) as progress:
        for _ in progress.track(range(asked.pairs), description="pairs"):
            without.append(paced(asked.seconds, None))
            with_it.append(served(asked.seconds))
    send = np.concatenate([run.send for run in with_it])
    table = Table("at 1 kHz", *(f"pair {i + 1}" for i in range(asked.pairs)), "median")
    late = [MICRO * np.array([np.percentile(run.lateness, 99) for run in runs]) for runs in (without, with_it)]
    for name, values in zip(("99 % lateness, us, alone", "served to a page"), late, strict=True):
        table.add_row(name, *(f"{x:.0f}" for x in values), f"{np.median(values):.0f}")
    ratio = late[1] / late[0]
    table.add_row("ratio", *(f"{x:.2f}" for x in ratio), f"{np.median(ratio):.2f}")
    for name, runs in (("overruns, alone", without), ("served to a page", with_it)):
        table.add_row(name, *(str(run.overruns) for run in runs), f"{np.median([run.overruns for run in runs]):g}")
    console.print(table)
    median, high, most = MICRO * np.percentile(send, (50, 99, 100))
    console.print(f"LiveTopics.observe: median {median:.1f}, 99 % {high:.1f}, longest {most:.0f} us")


if __name__ == "__main__":
    main()
