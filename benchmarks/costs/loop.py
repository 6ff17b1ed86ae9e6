"""The control loop at 1 kHz without physics: its parts, its punctuality, and what recording adds."""

import gc
import json
import multiprocessing
import os
import subprocess
import sys
import tempfile
import threading
import time
from array import array
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from multiprocessing.synchronize import Event
from pathlib import Path

import numpy as np
from harness.study import Check, Effort, Study
from harness.tables import grid
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from palpate.controllers import ExploreController, ExploreParameters, Raster, force_gain
from palpate.controllers.paths import Follow
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.robots.values import load_named_robot
from palpate.runtime import (
    ArmSample,
    Command,
    Phase,
    RunResult,
    Sample,
    SensorFinger,
    Supervisor,
    Touch,
    WrenchSample,
    run,
)
from palpate.runtime.interpreter import undisturbed
from palpate.runtime.live import live_parameters_of
from palpate.runtime.log import LogWriter, MemoryLog, Recorder
from palpate.runtime.log.standard.topics import PLAIN_ROBOT
from palpate.runtime.loop import Observer
from palpate.runtime.pacing import Pacer
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime
from palpate.runtime.timing import Distribution
from palpate.sensing.ft.filter_specs import Butterworth
from palpate.sensing.ft.sensor_file import CalibrationEntry, ContactEntry, PayloadEntry, SensorFile
from palpate.spatial import IDENTITY, ZERO, add_scaled
from palpate.surfaces import Ellipsoid
from palpate.viewing import LOOPBACK
from palpate.viewing.live_topics import LiveTopics
from palpate.viewing.topic_viewers import FOXGLOVE

PERIOD, MICRO = 1e-3, 1e6
CANNED = 5000
"""Different samples before they repeat."""

SIDE = 0.8
"""[m] Length of the strokes: longer than any run."""

SENSOR = SensorFile(
    model="made up",
    serial_number="1",
    date="2026-11-21",
    provenance="benchmarks/costs",
    sample_rate=1.0 / PERIOD,
    force_range=(50.0, 50.0, 50.0),
    moment_range=(1.0, 1.0, 1.0),
    noise_force=(0.01, 0.01, 0.01),
    noise_moment=(1e-4, 1e-4, 1e-4),
    bias_force=(0.1, -0.2, 0.3),
    bias_moment=(1e-3, 0.0, -2e-4),
    payload=PayloadEntry(mass=0.030, center_of_mass=(0.0005, 0.001, 0.018)),
    filters=(Butterworth(100.0),),  # one, as in the presets; each costs about 1 us
    contact=ContactEntry(touch_force=0.2, release_force=0.1, touch_time=0.003, release_time=0.002),
    calibration=CalibrationEntry(
        raw_unit="V",
        matrix=tuple(tuple(row) for row in np.diag([10.0, 10.0, 10.0, 0.2, 0.2, 0.2]).tolist()),
        offset=(0.0,) * 6,
        raw_range=(-5.0, 5.0),
        condition=50.0,
    ),
)
TIP = Ellipsoid(semi_axes=(0.008, 0.008, 0.012))
clock = time.perf_counter


def readings(*, loaded: bool) -> tuple[tuple[float, ...], ...]:
    """Return noisy readings [V] of about 2 N on a surface that turns to and fro by 0.1 rad."""
    rng = np.random.default_rng(0)
    turn = 0.1 * np.sin(2.0 * np.pi * np.arange(CANNED) / CANNED)
    up = np.stack([np.sin(turn), 0.05 * np.sin(3.0 * turn), np.cos(turn)], axis=1)
    force = 2.0 * up * loaded
    moment = np.cross(-up * np.array(TIP.semi_axes), force) + 2e-3 * up * loaded
    weight = 9.81 * np.array([0.0, 0.0, -0.030])
    load = np.concatenate([force + weight, moment], axis=1) + np.array((*SENSOR.bias_force, *SENSOR.bias_moment))
    load += rng.normal(size=(CANNED, 6)) * np.repeat([0.01, 1e-4], 3)
    return tuple(map(tuple, (load / np.repeat([10.0, 0.2], 3)).tolist()))


class CannedBackend:
    """A back end that waits for the period and returns prepared readings; its tip moves as commanded, at once."""

    def __init__(self, pacer: Pacer) -> None:
        self.period, self.pacer, self.read_time = PERIOD, pacer, array("d")
        self._loaded, self._unloaded = readings(loaded=True), readings(loaded=False)
        self._index, self._touching = 0, False
        self._at, self._velocity = (-0.5 * SIDE, -0.5 * SIDE, 0.05), ZERO  # where the strokes begin

    def start(self) -> Sample:
        return self._read()

    def step(self, command: Command) -> Sample:
        self._velocity, self._touching = command.velocity_base_tip, command.phase not in (Phase.TRAVEL, Phase.LIFT)
        self.pacer.wait()
        before = clock()
        sample = self._read()
        self.read_time.append(clock() - before)
        return sample

    def _read(self) -> Sample:
        self._index += 1
        now = self._index * self.period
        self._at = add_scaled(self._at, self.period, self._velocity)
        reading = (self._loaded if self._touching else self._unloaded)[self._index % CANNED]
        arm = ArmSample(now, self._at, IDENTITY, self._velocity)
        return Sample(now, arm, (WrenchSample(now, reading, (0.0, 0.0, 9.81)),))

    def close(self) -> None:
        pass

    def __enter__(self) -> "CannedBackend":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Stopwatch:
    """Wraps an object and notes how long each call of one of its methods takes [s]."""

    def __init__(self, timed: object, name: str) -> None:
        self._timed, self.taken = timed, array("d")
        method = getattr(timed, name)

        def watched(*arguments: object, **named: object) -> object:
            before = clock()
            result = method(*arguments, **named)
            self.taken.append(clock() - before)
            return result

        setattr(self, name, watched)

    def __getattr__(self, name: str) -> object:
        return getattr(self._timed, name)


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """One paced run: its result, and the times of its reads [s]."""

    result: RunResult
    read: np.ndarray

    @property
    def work(self) -> np.ndarray:
        """Time from read to record of each period but the first, for which nothing was read [s]."""
        compute = self.result.timing.compute.values[1:]
        return compute + self.read[: len(compute)]

    @property
    def end(self) -> np.ndarray:
        """Time from the deadline at which a period begins to the end of its work [s]."""
        return self.work + self.result.timing.lateness.values[: len(self.work)]


def measure(
    seconds: float,
    pacer: Pacer | None = None,
    recorder: Recorder | None = None,
    watch: dict[str, Stopwatch] | None = None,
    observers: tuple[Observer, ...] = (),
) -> Measured:
    """Run the loop; `watch` takes a stopwatch for each part, which costs 0.3 us apiece."""
    backend = CannedBackend(pacer or RealTime(PERIOD, priority=USUAL_PRIORITY))
    touch, supervisor = Touch(SensorFinger(TIP, SENSOR)), Supervisor()
    parameters = ExploreParameters(force=2.0, speed=0.01, gain=force_gain(20e3, 0.01), lead=0.01)
    control = ExploreController(parameters, Follow(Raster(SIDE, SIDE, 0.1)), PERIOD)
    live = live_parameters_of(control)
    if watch is not None:
        touch = watch["sense"] = Stopwatch(touch, "sense")
        control = watch["control"] = Stopwatch(control, "step")
        admits = watch["admit"] = Stopwatch(supervisor, "admits")
        supervisor = watch["supervise"] = Stopwatch(admits, "check")
        recorder = watch["record"] = Stopwatch(recorder, "record")
        live = watch["live parameters"] = Stopwatch(live, "step")
    kept = {"recorder": recorder, "live": live, "observers": observers}
    result = run(backend, touch, control, supervisor, duration=seconds, **kept)
    if result.trip is not None or result.ending.value != "time is up":
        raise SystemExit(f"the benchmark itself went wrong: {result.ending.value}; {result.trip}")
    return Measured(result, np.array(backend.read_time))


@contextmanager
def file_recorder(*sinks: object) -> Iterator[Recorder]:
    """Return a recorder that writes to disk, as in an experiment, and to further sinks."""
    with tempfile.TemporaryDirectory(prefix="palpate-loop-") as folder:
        recorder = Recorder(LogWriter(Path(folder) / "loop.mcap"), MemoryLog(), *sinks)
        yield recorder
        if problem := recorder.close().problem:
            raise SystemExit(f"the benchmark itself went wrong: {problem}")


@contextmanager
def busy_cores() -> Iterator[None]:
    """Run a process per core that only computes."""
    hogs = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count() or 1)]
    try:
        time.sleep(0.3)  # until they run
        yield
    finally:
        for hog in hogs:
            hog.kill()
            hog.wait()


def micros(spread: Distribution) -> list[str]:
    """Return median, 99th percentile and largest value [us]."""
    return [f"{MICRO * value:.0f}" for value in (spread.p50, spread.p99, spread.largest)]


def seconds_of(effort: Effort) -> float:
    """Return how long a paced run lasts [s]."""
    return 0.6 if effort.quick else 10.0


def period_parts(seconds: float) -> tuple[Measured, dict[str, np.ndarray]]:
    """Return a paced run without stopwatches, and the times of the parts of another one with them [s]."""
    with file_recorder() as recorder:
        whole = measure(seconds, recorder=recorder)
    watch: dict[str, Stopwatch] = {}
    with file_recorder() as recorder:
        parted = measure(seconds, recorder=recorder, watch=watch)
    count = len(parted.work)
    parts = {name: np.array(each.taken)[1:][:count] for name, each in watch.items()}
    return whole, {"read": parted.read[:count], **parts}


def period(effort: Effort) -> Study:
    """Measure what a period is made of."""
    whole, parts = period_parts(seconds_of(effort))
    table = grid(
        "One period, paced at 1 kHz: read, sense, control, supervise, record; us", "", "median", "99 %", "max"
    )
    for name, taken in parts.items():
        table.add_row(name, *micros(Distribution.of(taken)))
    spread = Distribution.of(whole.work)
    table.add_row("all of it, without stopwatches", *micros(spread))
    table.caption = f"{whole.result.timing.note or 'ordinary priority'}; overruns {whole.result.timing.overruns}"
    record = float(np.median(parts["record"]))
    checks = (
        Check.at_most("median, us", 60.0, MICRO * spread.p50),
        Check.at_most("99 %, us", 250.0, MICRO * spread.p99),
        Check.at_most("record, us", 6.0, MICRO * record),
    )
    return Study("Parts of a control period", checks=checks, tables=(table,))


def lateness(effort: Effort) -> Study:
    """Measure how long after its deadline a period begins."""
    table = grid("Lateness at 1 kHz, us", "thread", "median", "99 %", "max", "overruns", "periods")
    ordinary, real_time = RealTime(PERIOD), RealTime(PERIOD, priority=USUAL_PRIORITY)
    cases: tuple[tuple[str, Pacer, AbstractContextManager[None], float], ...] = (
        ("ordinary", ordinary, nullcontext(), 500e-6),
        ("real-time", real_time, nullcontext(), 250e-6),
        ("real-time, 100 us spin", RealTime(PERIOD, priority=USUAL_PRIORITY, spin=1e-4), nullcontext(), 250e-6),
        ("ordinary, all cores busy", RealTime(PERIOD), busy_cores(), np.inf),
        ("real-time, all cores busy", RealTime(PERIOD, priority=USUAL_PRIORITY), busy_cores(), 300e-6),
    )
    checks = []
    for name, pacer, others, limit in cases:
        effort.tell(f"lateness: {name}")
        with others, file_recorder() as recorder:
            timing = measure(seconds_of(effort), pacer, recorder).result.timing
        spread = timing.lateness_spread
        table.add_row(name, *micros(spread), str(timing.overruns), str(spread.count))
        checks += [Check.at_most(f"{name}, 99 %, us", MICRO * limit, MICRO * spread.p99)] if limit < np.inf else []
        table.caption = timing.note or table.caption
    return Study("Lateness", checks=tuple(checks), tables=(table,))


def read_page(url: str, ready: Event) -> None:
    """Subscribe to all topics and read them until the server ends."""
    os.nice(10)
    with connect(url, subprotocols=["foxglove.sdk.v1"]) as socket:
        ready.set()
        try:
            while True:
                message = socket.recv()
                if isinstance(message, str) and (channels := json.loads(message).get("channels")):
                    time.sleep(0.1)  # a subscription sent at once is refused: there is no such channel yet
                    every = [{"id": each["id"], "channelId": each["id"]} for each in channels]
                    socket.send(json.dumps({"op": "subscribe", "subscriptions": every}))
        except ConnectionClosed:
            return


def unrecorded(seconds: float) -> Measured:
    """Run without a recorder."""
    return measure(seconds)


def recorded(seconds: float) -> Measured:
    """Run with a recorder to disk and memory, as in an experiment."""
    with file_recorder() as recorder:
        return measure(seconds, recorder=recorder)


def served(seconds: float) -> Measured:
    """Run with a recorder, and with topics served to a page in a process of its own."""
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    with LiveTopics(FOXGLOVE, PLAIN_ROBOT, LOOPBACK, 0) as live:
        reader = context.Process(target=read_page, args=(live.url, ready), daemon=True)
        reader.start()
        ready.wait()
        with file_recorder(*live.sinks) as recorder:
            found = measure(seconds, recorder=recorder, observers=(live.observe,))
    reader.join()
    return found


def recording(effort: Effort) -> Study:
    """Measure what recording and live topics add to the end of a period, run against run."""
    ways: dict[str, Callable[[float], Measured]] = {
        "alone": unrecorded,
        "recorded": recorded,
        "and served": served,
    }
    ends: dict[str, list[float]] = {name: [] for name in ways}
    overruns = dict.fromkeys(ways, 0)
    for turn in range(effort.of(5, 1)):
        for name in list(ways)[:: -1 if turn % 2 else 1]:
            effort.tell(f"recording: {name}, turn {turn + 1}")
            found = ways[name](seconds_of(effort))
            ends[name].append(Distribution.of(found.end).p99)
            overruns[name] += found.result.timing.overruns
    table = grid(
        "End of the period's work after its deadline, 99 %, us", "", "median", "each", "ratio", "overruns"
    )
    checks = []
    before: list[float] = []
    for name, values in ends.items():
        ratio = float(np.median(np.divide(values, before))) if before else 1.0
        each = " ".join(f"{MICRO * value:.0f}" for value in values)
        table.add_row(name, f"{MICRO * np.median(values):.0f}", each, f"{ratio:.2f}", str(overruns[name]))
        if name == "recorded":
            checks.append(Check.at_most("recorded over alone, 99 %", 1.25, ratio))
        before = values
    with tempfile.TemporaryDirectory() as folder:
        path, config = Path(folder) / "log.mcap", ExploreConfig(force_noise=0.01, moment_noise=1e-4)
        found = carry_out(plan(config, load_named_robot(config.robot), {}), sinks=(LogWriter(path),))
        rate = path.stat().st_size / found.run.duration / 1e6
    checks.append(Check.at_most("log of a noisy exploration, MB/s", 0.5, rate))
    about = "Ratio: recorded to alone, served to recorded."
    return Study("Recording and live topics", about, checks=tuple(checks), tables=(table,))


def switching(effort: Effort) -> Study:
    """Measure lateness beside a thread that computes in Python for 20 ms, 8 times a second."""
    title = "Lateness beside a thread that computes for 20 ms, 8 times a second, us"
    table = grid(title, "switch interval", "median", "99 %", "max", "overruns")
    stop = threading.Event()

    def compute() -> None:
        while not stop.wait(0.1):
            until = clock() + 0.02
            while clock() < until:
                sum(range(100))

    before, thread = sys.getswitchinterval(), threading.Thread(target=compute)
    thread.start()
    try:
        for interval in (5e-3, 1e-3, 2e-4, 5e-5, 2e-5):
            sys.setswitchinterval(interval + 5e-7)
            pacer = RealTime(PERIOD, priority=USUAL_PRIORITY)
            pacer.start()
            for _ in range(round(seconds_of(effort) / PERIOD)):
                pacer.wait()
            kept = pacer.stop()
            table.add_row(f"{MICRO * interval:.0f}", *micros(Distribution.of(kept.lateness)), str(kept.overruns))
    finally:
        sys.setswitchinterval(before + 5e-7)
        stop.set()
        thread.join()
    return Study("Switch interval", tables=(table,))


class Cycle:
    """Garbage that only the collector finds."""

    def __init__(self, kept: object) -> None:
        self.me, self.kept = self, kept


def collections(effort: Effort) -> Study:
    """Measure how long the garbage collector stops a loop whose controller makes cycles and keeps objects."""
    title = "Garbage collections in 60 000 periods of a careless controller: count, and longest, us"
    table = grid(title, "", "young", "middle", "full")
    began, taken = [0.0], [array("d"), array("d"), array("d")]

    def note(stage: str, facts: dict[str, int]) -> None:
        if stage == "start":
            began[0] = clock()
        else:
            taken[facts["generation"]].append(clock() - began[0])

    gc.callbacks.append(note)
    try:
        for name, context in (("Python's default", nullcontext()), ("undisturbed", undisturbed())):
            for generation in taken:
                del generation[:]
            kept = []
            with context:
                for index in range(effort.of(60_000, 6_000)):
                    kept.append({"cycle": [Cycle(index)]})
                    Cycle([0.0] * 50)
            table.add_row(name, *(f"{len(g)}: {MICRO * max(g):.0f}" if g else "0" for g in taken))
            del kept
            gc.collect()
    finally:
        gc.callbacks.remove(note)
    return Study("Garbage collections", tables=(table,))


COSTS = {
    "period": period,
    "lateness": lateness,
    "recording": recording,
    "switching": switching,
    "collections": collections,
}
