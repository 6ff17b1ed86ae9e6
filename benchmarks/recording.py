"""What recording costs the loop, and the disk.

    python benchmarks/recording.py [--quick]

The loop here senses random wrenches on a sphere and records: no physics, no controller, so that what recording
adds is not hidden by what else varies. benchmarks/loop.py measures the whole period. Judge on a quiet machine:
what sleeps most of the time runs with cold caches, and whatever runs beside makes them colder. The loop has
real-time priority where the system grants it, so that it is not the scheduler that is measured.
"""

import argparse
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from palpate import Sphere
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.plan import plan
from palpate.experiments.kit.recorded_run import carry_out
from palpate.robots.values import load_named_robot
from palpate.runtime import ArmSample, Command, Finger, Sample, Touch, WrenchSample
from palpate.runtime.interpreter import undisturbed
from palpate.runtime.log import Heading, Layout, LogWriter, MemoryLog, Recorder
from palpate.runtime.log.chunk import PERIOD_CHANNEL, PackedRows, encode_chunk
from palpate.runtime.log.mcap_builder import run_builder
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.real_time import USUAL_PRIORITY, RealTime

PERIOD = 1e-3
MICRO = 1e6
ROTATION = ((0.8, 0.0, 0.6), (0.36, 0.8, -0.48), (-0.48, 0.6, 0.64))


@dataclass(frozen=True, slots=True, eq=False)
class Paced:
    """Times of one paced run [s], each of shape (n,): of recording, and from the deadline to the period's end.

    And what the system granted.
    """

    record: np.ndarray
    end: np.ndarray
    note: str


def samples(count: int) -> list[Sample]:
    """As a six-axis arm and a fingertip sensor would give them."""
    rng = np.random.default_rng(0)
    found = []
    for i in range(count):
        joints, position, velocity, noise = (tuple(rng.normal(size=n).tolist()) for n in (6, 3, 3, 6))
        wrench = tuple(x + y for x, y in zip((0.0, 0.0, 2.0, 0.0, 0.0, 0.0), noise, strict=True))
        arm = ArmSample(i * PERIOD, position, ROTATION, velocity, joints)
        found.append(Sample(i * PERIOD, arm, (WrenchSample(i * PERIOD, wrench, (0.0, 0.0, 9.81)),)))
    return found


def paced(seconds: float, recorder: Recorder | None) -> Paced:
    """Run at 1 kHz, with or without a recorder."""
    given = samples(round(seconds / PERIOD))
    touch, pacer, command = (
        Touch(Finger(Sphere(0.008))),
        RealTime(PERIOD, priority=USUAL_PRIORITY),
        Command((0.01, 0.02, 0.03)),
    )
    if recorder is not None:
        recorder.start(given[0], touch.sense(given[0]), PERIOD)
    record, end = np.zeros(len(given)), np.zeros(len(given))
    clock = time.perf_counter
    pacer.start()
    with undisturbed():
        for i, sample in enumerate(given):
            woken = clock()
            now = touch.sense(sample)
            sensed = clock()
            if recorder is not None:
                recorder.record(sample, now, command, sensed - woken, pacer.lateness)
            done = clock()
            record[i], end[i] = done - sensed, pacer.lateness + done - woken
            pacer.wait()
    return Paced(record[100:], end[100:], pacer.stop().note)


def recorded(seconds: float, folder: Path) -> Paced:
    """Run at 1 kHz and record to disk and memory, as an experiment does."""
    path = folder / f"{time.monotonic_ns()}.mcap"
    recorder = Recorder(LogWriter(path), MemoryLog())
    found = paced(seconds, recorder)
    summary = recorder.close()
    if summary.rows_lost:
        raise RuntimeError(summary.problem)
    path.unlink()
    return found


def hot() -> np.ndarray:
    """Time of one call in a tight loop, shape (50,) [s]."""
    (sample,) = samples(1)
    now, command = Touch(Finger(Sphere(0.008))).sense(sample), Command()
    recorder = Recorder()
    recorder.start(sample, now, PERIOD)
    taken = []
    for _ in range(50):
        started = time.perf_counter()
        for _ in range(1000):
            recorder.record(sample, now, command, 0.0, 0.0)
        taken.append((time.perf_counter() - started) / 1000)
    return np.array(taken)


def costs(runs: list[Paced]) -> Table:
    """What `record` takes."""
    table = Table("Recorder.record, us", "median", "99 %", "longest", "asked, median")
    record = np.concatenate([run.record for run in runs])
    for name, values in (("in a tight loop", hot()), ("at 1 kHz, the writer running", record)):
        table.add_row(name, *(f"{MICRO * x:.1f}" for x in np.percentile(values, (50, 99, 100))), "6")
    return table


def pairs(without: list[Paced], with_it: list[Paced]) -> Table:
    """End of period with and without recording, pair by pair."""
    table = Table("end of period at 1 kHz, 99 %, us", *(f"pair {i + 1}" for i in range(len(without))), "median")
    off, on = (MICRO * np.array([np.percentile(run.end, 99) for run in runs]) for runs in (without, with_it))
    for name, values in (("not recording", off), ("recording", on)):
        table.add_row(name, *(f"{x:.0f}" for x in values), f"{np.median(values):.0f}")
    ratio = on / off
    table.caption = with_it[0].note
    table.add_row("ratio (asked: 1.25)", *(f"{x:.2f}" for x in ratio), f"{np.median(ratio):.2f}")
    return table


def sizes(folder: Path) -> Table:
    """Bytes per second of log at 1 kHz, and what the writer's thread does for them."""
    table = Table("on disk at 1 kHz", "doubles a period", "MB/s", "asked", "writer, us per 200 periods")
    layout = Layout(8, None, (6,), 2)
    codec = PeriodCodec(Heading(layout, PERIOD, 0.0, time.time_ns(), "benchmark"), PERIOD_CHANNEL)
    doubles = sum(quantity.count for group in codec.groups for quantity in group.fields if quantity.dtype == "<f8")
    random = np.random.default_rng(0).normal(size=(200, codec.width))
    random[:, [codec.columns[f"finger_0.{name}"].start for name in ("status", "touching", "health")]] = 0.0
    random[:, [codec.columns[f"command.{name}"].start for name in ("grip_count", "phase")]] = 0.0
    builder, taken, size = run_builder(codec), [], 0
    for block in range(25):
        random[:, 0] = (200 * block + np.arange(200)) * PERIOD
        started = time.thread_time()
        rows = PackedRows(200 * block, memoryview(random.tobytes()))
        piece = builder.piece(encode_chunk([rows], codec))
        taken.append(time.thread_time() - started)
        builder.written(piece)
        size += len(piece.data)
    spent = f"{MICRO * np.median(taken):.0f}"
    table.add_row("random doubles, the worst case", str(doubles), f"{size / 5.0 / 1e6:.3f}", "0.5", spent)
    for noise in (0.0, 0.01):
        path = folder / f"explore {noise}.mcap"
        config = ExploreConfig(force_noise=noise, moment_noise=0.01 * noise)
        found = carry_out(plan(config, load_named_robot(config.robot), {}), sinks=(LogWriter(path),))
        rate = path.stat().st_size / found.run.duration / 1e6
        name = f"an exploration in simulation, {'noisy' if noise else 'clean'}"
        table.add_row(name, str(doubles - 8), f"{rate:.3f}", "0.5", "")
    return table


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="shorter runs")
    seconds = 4.0 if parser.parse_args().quick else 15.0
    console = Console(width=130)
    without, with_it = [], []
    with tempfile.TemporaryDirectory() as name, Progress(console=console, transient=True) as progress:
        folder = Path(name)
        for _ in progress.track(range(5), description="paced runs, pair by pair"):
            without.append(paced(seconds, None))
            with_it.append(recorded(seconds, folder))
        progress.track((), description="files")
        console.print(costs(with_it))
        console.print(pairs(without, with_it))
        console.print(sizes(folder))


if __name__ == "__main__":
    main()
