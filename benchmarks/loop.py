"""What a control period costs, and how punctual it is, without physics.

    python benchmarks/loop.py [--quick]

The loop that drives robots, paced at 1 kHz: the exploration controller and the supervisor with its default limits
run on a force/torque sensor as its file describes it (calibration, bias, payload, a low-pass, health), whose
readings are made up: a fingertip that presses with about 2 N on a surface that turns a little, with noise. Every
period is recorded to a file. The tables say what was asked for (issue 4), and what this machine gives; maxima are
the machine's, and are told but not judged. It takes about four minutes. Close other programs: what they leave of
the caches decides what a period costs. For real-time priority run it as a user who may have it.
"""

import argparse
import gc
import math
import os
import subprocess
import sys
import tempfile
import threading
import time
from array import array
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from palpate.controllers import ExploreController, ExploreParameters, Raster, force_gain
from palpate.controllers.paths import Follow
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
from palpate.runtime.pacing import Pacer
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime
from palpate.runtime.timing import Distribution
from palpate.sensing.ft.filter_specs import Butterworth
from palpate.sensing.ft.sensor_file import CalibrationEntry, ContactEntry, PayloadEntry, SensorFile
from palpate.spatial import IDENTITY, ZERO, add_scaled
from palpate.surfaces import Ellipsoid

PERIOD = 1e-3
CANNED = 5000
"""Different samples before they repeat."""

MICRO = 1e6
clock = time.perf_counter


@dataclass(frozen=True, slots=True)
class Effort:
    """How much is measured: seconds of one run, pairs of runs with and without the recorder."""

    seconds: float
    pairs: int


FULL, QUICK = Effort(seconds=10.0, pairs=5), Effort(seconds=0.6, pairs=1)

SENSOR = SensorFile(
    model="made up",
    serial_number="1",
    date="2026-11-21",
    provenance="benchmarks/loop.py",
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


def readings(*, loaded: bool) -> tuple[tuple[float, ...], ...]:
    """What the sensor says, in volts: about 2 N on a surface that turns to and fro by 0.1 rad, with noise."""
    rng = np.random.default_rng(0)
    turn = 0.1 * np.sin(2.0 * np.pi * np.arange(CANNED) / CANNED)
    up = np.stack([np.sin(turn), 0.05 * np.sin(3.0 * turn), np.cos(turn)], axis=1)
    point = -up * np.array([0.008, 0.008, 0.012])  # near enough to where it touches
    force = 2.0 * up
    weight = 9.81 * np.array([0.0, 0.0, -0.030])
    moment = np.cross(point, force) + 2e-3 * up
    if not loaded:
        force, moment = np.zeros_like(force), np.zeros_like(moment)
    load = np.concatenate([force + weight, moment], axis=1) + np.array((*SENSOR.bias_force, *SENSOR.bias_moment))
    load += rng.normal(size=(CANNED, 6)) * np.repeat([0.01, 1e-4], 3)
    return tuple(map(tuple, (load / np.repeat([10.0, 0.2], 3)).tolist()))


READINGS, UNLOADED = readings(loaded=True), readings(loaded=False)

SIDE = 0.8
"""[m] of the strokes: longer than any run."""


class NoDevice:
    """A back end that takes a period to answer, and then says what was prepared; its tip goes where it is sent."""

    def __init__(self, pacer: Pacer) -> None:
        self.period = PERIOD
        self.pacer = pacer
        self.read_time = array("d")
        self._index = 0
        self._at, self._velocity = (-0.5 * SIDE, -0.5 * SIDE, 0.05), ZERO  # where the strokes begin
        self._loaded = False

    def start(self) -> Sample:
        return self._read()

    def step(self, command: Command) -> Sample:
        self._velocity, self._loaded = command.velocity_base_tip, command.phase not in (Phase.TRAVEL, Phase.LIFT)
        self.pacer.wait()
        before = clock()
        sample = self._read()
        self.read_time.append(clock() - before)
        return sample

    def _read(self) -> Sample:
        """The tip has gone on as commanded, and at once."""
        self._index += 1
        now = self._index * self.period
        self._at = add_scaled(self._at, self.period, self._velocity)
        arm = ArmSample(now, self._at, IDENTITY, self._velocity)
        reading = READINGS[self._index % CANNED] if self._loaded else UNLOADED[self._index % CANNED]
        return Sample(now, arm, (WrenchSample(now, reading, (0.0, 0.0, 9.81)),))

    def close(self) -> None:
        pass

    def __enter__(self) -> "NoDevice":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Stopwatch:
    """Does what another object does, and notes how long each call of some of its methods takes."""

    def __init__(self, timed: object, *names: str) -> None:
        self._timed = timed
        self.taken = {name: array("d") for name in names}
        for name in names:
            setattr(self, name, self._watched(getattr(timed, name), self.taken[name]))

    @staticmethod
    def _watched(method: Callable[..., object], taken: array) -> Callable[..., object]:
        def watched(*arguments: object, **named: object) -> object:
            before = clock()
            result = method(*arguments, **named)
            taken.append(clock() - before)
            return result

        return watched

    def __getattr__(self, name: str) -> object:
        return getattr(self._timed, name)


class TimedFinger(Stopwatch):
    """A finger whose pipeline is timed.

    Attributes:
        watch: Of the pipeline.
    """

    def pipeline(self) -> Stopwatch:
        self.watch = Stopwatch(self._timed.pipeline(), "step")
        return self.watch


def controller() -> ExploreController:
    gain = force_gain(20e3, 0.01)
    parameters = ExploreParameters(force=2.0, speed=0.01, gain=gain, lead=0.01)
    return ExploreController(parameters, Follow(Raster(SIDE, SIDE, 0.1)), PERIOD)


@dataclass(frozen=True, slots=True, eq=False)
class Measured:
    """One paced run: its result, and the times of its reads."""

    result: RunResult
    read: np.ndarray

    @property
    def work(self) -> np.ndarray:
        """Of each period but the first, for which nothing was read: from read to record [s]."""
        compute = self.result.timing.compute.values[1:]
        return compute + self.read[: len(compute)]

    @property
    def end(self) -> np.ndarray:
        """From the deadline that a period begins with to the end of its work [s]."""
        return self.work + self.result.timing.lateness.values[: len(self.work)]


def measure(
    seconds: float, pacer: Pacer, recorder: Recorder | None, watch: dict[str, Stopwatch] | None = None
) -> Measured:
    """Run the loop for so long; `watch` takes a stopwatch for each part, which cost 0.3 us apiece."""
    backend, touch, control, supervisor = (
        NoDevice(pacer),
        Touch(SensorFinger(TIP, SENSOR)),
        controller(),
        Supervisor(),
    )
    live = live_parameters_of(control)
    if watch is not None:
        finger = TimedFinger(SensorFinger(TIP, SENSOR))
        touch = watch["sense"] = Stopwatch(Touch(finger), "sense")
        watch["pipeline"] = finger.watch
        control = watch["control"] = Stopwatch(control, "step")
        supervisor = watch["supervise"] = Stopwatch(supervisor, "admits", "check")
        recorder = watch["record"] = Stopwatch(recorder, "record")
        live = watch["live"] = Stopwatch(live, "step")
    result = run(
        backend,
        touch,
        control,
        supervisor,
        duration=seconds,
        recorder=recorder,
        live=live,
    )
    if result.trip is not None or result.ending.value != "time is up":
        raise SystemExit(f"the benchmark itself went wrong: {result.ending.value}; {result.trip}")
    return Measured(result, np.array(backend.read_time))


@contextmanager
def file_recorder() -> Iterator[Recorder]:
    """A recorder that writes to disk, as a run has it."""
    with tempfile.TemporaryDirectory(prefix="palpate-loop-") as folder:
        recorder = Recorder(LogWriter(Path(folder) / "loop.mcap"), MemoryLog())
        yield recorder
        if problem := recorder.close().problem:
            raise SystemExit(f"the benchmark itself went wrong: {problem}")


@contextmanager
def busy_cores() -> Iterator[None]:
    """A process for every core that does nothing but compute."""
    hogs = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(os.cpu_count() or 1)]
    try:
        time.sleep(0.3)  # until they run
        yield
    finally:
        for hog in hogs:
            hog.kill()
            hog.wait()


def told(spread: Distribution) -> list[str]:
    return [f"{MICRO * value:.0f}" for value in (spread.p50, spread.p99, spread.largest)]


def verdict(got: float, asked: float) -> str:
    return "yes" if got <= asked else "[red]NO[/red]"


def table(title: str, first: str, *headings: str) -> Table:
    made = Table(title=title, title_justify="left")
    made.add_column(first, no_wrap=True)
    for heading in headings:
        made.add_column(heading, justify="right", no_wrap=True)
    return made


def parts(effort: Effort, done: Callable[[], None]) -> Table:
    """What a period is made of."""
    watch: dict[str, Stopwatch] = {}
    with file_recorder() as recorder:
        whole = measure(effort.seconds, RealTime(PERIOD, priority=USUAL_PRIORITY), recorder)
    done()
    with file_recorder() as recorder:
        parted = measure(effort.seconds, RealTime(PERIOD, priority=USUAL_PRIORITY), recorder, watch)
    done()
    count = len(parted.work)
    supervise = watch["supervise"].taken
    times = {
        "read": parted.read[:count],
        "sense": np.array(watch["sense"].taken["sense"])[1:][:count],  # the first is before the loop
        "live parameters": np.array(watch["live"].taken["step"])[1:],
        "control": np.array(watch["control"].taken["step"])[1:],
        "supervise": (np.array(supervise["admits"]) + np.array(supervise["check"]))[1:],
        "record": np.array(watch["record"].taken["record"])[1:][:count],
    }
    times["the loop itself, and the stopwatches"] = parted.work - sum(times.values())
    made = table(
        "One period, paced at 1 kHz: read, sense, control, supervise, record; us",
        "part",
        "median",
        "99 %",
        "max",
        "median asked",
        "99 % asked",
        "kept",
    )
    for name, taken in times.items():
        made.add_row(name, *told(Distribution.of(taken)), "6" if name == "record" else "", "", "")
        if name == "sense":
            pipeline = Distribution.of(np.array(watch["pipeline"].taken["step"])[1:])
            made.add_row("  the sensor's part", *told(pipeline), "30", "", verdict(pipeline.p50, 30e-6))
    made.add_section()
    spread = Distribution.of(whole.work)
    kept = verdict(max(spread.p50 / 60e-6, spread.p99 / 250e-6), 1.0)
    made.add_row("all of it, without stopwatches", *told(spread), "60", "250", kept)
    made.caption = f"{whole.result.timing.note or 'ordinary priority'}; overruns {whole.result.timing.overruns}"
    return made


def lateness(effort: Effort, done: Callable[[], None]) -> Table:
    """How long after its deadline a period begins."""
    made = table(
        "Lateness at 1 kHz, us", "thread", "median", "99 %", "max", "99 % asked", "kept", "overruns", "periods"
    )
    notes = set()
    for name, pacer, others, asked in (
        ("ordinary", RealTime(PERIOD), nullcontext(), 500e-6),
        ("real-time", RealTime(PERIOD, priority=USUAL_PRIORITY), nullcontext(), 250e-6),
        ("real-time, 100 us spin", RealTime(PERIOD, priority=USUAL_PRIORITY, spin=1e-4), nullcontext(), 250e-6),
        ("ordinary, all cores busy", RealTime(PERIOD), busy_cores(), math.inf),
        ("real-time, all cores busy", RealTime(PERIOD, priority=USUAL_PRIORITY), busy_cores(), 300e-6),
    ):
        with others, file_recorder() as recorder:
            timing = measure(effort.seconds, pacer, recorder).result.timing
        spread = timing.lateness_spread
        judged = (f"{MICRO * asked:.0f}", verdict(spread.p99, asked)) if asked < math.inf else ("", "")
        made.add_row(name, *told(spread), *judged, str(timing.overruns), str(spread.count))
        notes |= {timing.note} - {""}
        done()
    made.caption = "; ".join(sorted(notes))
    return made


def recorder_pairs(effort: Effort, done: Callable[[], None]) -> Table:
    """What recording adds to the end of a period, run against run."""
    ratios, on, off = [], [], []
    for pair in range(effort.pairs):
        found = {}
        for recording in (True, False) if pair % 2 else (False, True):
            with file_recorder() if recording else nullcontext() as recorder:
                pacer = RealTime(PERIOD, priority=USUAL_PRIORITY)
                found[recording] = Distribution.of(measure(effort.seconds, pacer, recorder).end)
            done()
        on.append(found[True].p99)
        off.append(found[False].p99)
        ratios.append(found[True].p99 / found[False].p99)
    made = table(
        "End of the period's work after its deadline, 99 %, us", "", "median", "each pair", "asked", "kept"
    )
    for name, values in (("without recorder", off), ("with", on)):
        made.add_row(
            name, f"{MICRO * np.median(values):.0f}", " ".join(f"{MICRO * v:.0f}" for v in values), "", ""
        )
    median = float(np.median(ratios))
    made.add_row(
        "ratio", f"{median:.2f}", " ".join(f"{ratio:.2f}" for ratio in ratios), "1.25", verdict(median, 1.25)
    )
    return made


class Cycle:
    """Garbage that only the collector finds."""

    def __init__(self, kept: object) -> None:
        self.me, self.kept = self, kept


def collections(done: Callable[[], None]) -> Table:
    """How long the garbage collector stops a loop whose controller makes cycles, and keeps objects."""
    made = table(
        "Garbage collections in 60 000 periods of a careless controller: count, and longest, us",
        "",
        "young",
        "middle",
        "full",
    )
    began, taken = [0.0], [array("d"), array("d"), array("d")]

    def note(stage: str, facts: dict[str, int]) -> None:
        if stage == "start":
            began[0] = clock()
        else:
            taken[facts["generation"]].append(clock() - began[0])

    gc.callbacks.append(note)
    try:
        for name, context in (("as Python comes", nullcontext()), ("undisturbed", undisturbed())):
            for generation in taken:
                del generation[:]
            with context:
                kept = []
                for index in range(60_000):
                    kept.append({"cycle": [Cycle(index)]})
                    Cycle([0.0] * 50)
            made.add_row(name, *(f"{len(g)}: {MICRO * max(g):.0f}" if g else "0" for g in taken))
            del kept
            gc.collect()
            done()
    finally:
        gc.callbacks.remove(note)
    return made


def switching(effort: Effort, done: Callable[[], None]) -> Table:
    """How late the loop is beside a thread that computes in Python for 20 ms, 8 times a second."""
    made = table(
        "Lateness beside a thread that computes for 20 ms, 8 times a second, us",
        "switch interval",
        "median",
        "99 %",
        "max",
        "overruns",
    )
    stop = threading.Event()

    def compute() -> None:
        while not stop.wait(0.1):
            until = clock() + 0.02
            while clock() < until:
                sum(range(100))

    before = sys.getswitchinterval()
    thread = threading.Thread(target=compute)
    thread.start()
    try:
        for interval in (5e-3, 1e-3, 2e-4, 5e-5, 2e-5):
            sys.setswitchinterval(interval + 5e-7)
            pacer = RealTime(PERIOD, priority=USUAL_PRIORITY)
            pacer.start()
            for _ in range(round(effort.seconds / PERIOD)):
                pacer.wait()
            kept = pacer.stop()
            made.add_row(f"{MICRO * interval:.0f}", *told(Distribution.of(kept.lateness)), str(kept.overruns))
            done()
    finally:
        sys.setswitchinterval(before + 5e-7)
        stop.set()
        thread.join()
    return made


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="a few seconds: does it run? the figures mean little")
    effort = QUICK if parser.parse_args(arguments).quick else FULL
    console = Console(width=max(115, Console().width))
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("running the loop", total=2 + 5 + 2 * effort.pairs + 2 + 5)

        def done() -> None:
            progress.advance(task)

        tables = [section(effort, done) for section in (parts, lateness, recorder_pairs, switching)]
        tables.append(collections(done))
    for made in tables:
        console.print(made)
    load = ", ".join(f"{value:.1f}" for value in os.getloadavg()) if hasattr(os, "getloadavg") else "unknown"
    console.print(f"{os.cpu_count()} cores, Python {sys.version.split()[0]}; load of the last minutes: {load}")


if __name__ == "__main__":
    main()
