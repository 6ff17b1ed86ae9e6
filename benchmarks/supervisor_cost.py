"""What distrust costs in a control period: pairs in one run, with and without the checks that compare.

    python benchmarks/supervisor_cost.py [--quick]

The periods of one recorded exploration on the simulated stage go again and again through what the loop does
with each of them besides control and recording: sense, `Supervisor.admits`, `Supervisor.check`, and the comparison
of commands with motion. Each period goes through both, by turns in either order: with all checks, and with
limits alone, without comparison of directions, sliding, motion and forces, and without a watch for readings that
cease to change. Asked: 5 us at the median.
"""

import argparse
import gc
import os
import time
from array import array
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from rich.console import Console
from rich.table import Table

from faults.dead_sensor import WithoutTipForce
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.experiment import Plan
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.robots.values import load_named_robot
from palpate.runtime import Backend, Finger, FingerDescription, Supervisor, Touch
from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.following import AnyMotion, Following
from palpate.runtime.supervision.bounds import first_broken_in
from palpate.runtime.touch import NOISELESS

ASKED, MICRO = 5.0, 1e6
FIRST_BROKEN = first_broken_in()
NOISE, MOMENT_NOISE = 0.003, 1.5e-5
"""Of the simulated sensor [N, N m], so that it is watched for readings that cease to change."""


class LimitsAlone(Supervisor):
    """Passes on what is within the limits, and compares nothing."""

    def admits(self, now: Observation) -> bool:
        """See `Supervisor`: bounds of guards alone."""
        watch = self._watch
        watch.look(now)
        bounds = watch._bounds
        broken = FIRST_BROKEN(bounds.places, bounds.limits, watch.seen, watch._known, 0, len(bounds.places))
        watch.keep()
        self._before = now
        return bool(broken < 0)


class Judge:
    """What the loop does with a period besides control and recording."""

    def __init__(
        self, supervisor: Supervisor, finger: FingerDescription, following: Following, period: float
    ) -> None:
        self.supervisor, self.touch, self.following = supervisor, Touch(finger), following
        supervisor.start(period)
        self.touch.start()

    def taken(self, sample: Sample, command: Command, after: Sample) -> float:
        """Return the time that a period takes [s]."""
        before = time.perf_counter()
        now = self.touch.sense(sample)
        passed = self.supervisor.admits(now)
        self.supervisor.check(now, command)
        self.following.take(command, now, after)
        took = time.perf_counter() - before
        if not passed:
            raise SystemExit(f"the benchmark itself went wrong: {self.supervisor.trip}")
        return took


@dataclass(frozen=True, slots=True)
class Periods:
    """Samples of a run, and the commands that came of them, but for the last sample."""

    samples: Sequence[Sample]
    commands: Sequence[Command]

    def medians(self, plan: Plan) -> tuple[float, float, float]:
        """Return median times of a period [s]: with limits alone, with all checks, and of the difference."""
        (finger,), period, first = plan.fingers, self.period, self.samples[0].arm
        assert isinstance(finger, Finger)
        bare = Judge(LimitsAlone(plan.limits), replace(finger, noise=NOISELESS), AnyMotion(period, first), period)
        full = Judge(Supervisor(plan.limits), finger, plan.following(period, first), period)
        times: dict[Judge, array[float]] = {bare: array("d"), full: array("d")}
        gc.collect()
        gc.disable()
        for k, command in enumerate(self.commands):
            for judge in (bare, full) if k % 2 else (full, bare):
                times[judge].append(judge.taken(self.samples[k], command, self.samples[k + 1]))
        gc.enable()
        without, with_all = np.array(times[bare]), np.array(times[full])
        return float(np.median(without)), float(np.median(with_all)), float(np.median(with_all - without))

    @property
    def period(self) -> float:
        """Of control [s]."""
        return self.samples[1].time - self.samples[0].time


def recorded(plan: Plan, backend: Backend) -> Periods:
    """Carry out a plan, and return its periods."""
    samples, commands = [], []

    def keep(sample: Sample, now: Observation, command: Command) -> None:
        samples.append(sample)
        commands.append(command)

    result = RecordedRun(plan, backend).run([keep])
    if result.trip is not None:
        raise SystemExit(f"the benchmark itself went wrong: {result.trip}")
    last = next(k for k, command in enumerate(commands) if command.phase.is_final)
    return Periods(samples[: last + 1], commands[:last])


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="three passes: does it run? the figures mean little")
    passes = 3 if parser.parse_args().quick else 40
    config = ExploreConfig(width=0.006, depth=0.002, force_noise=NOISE, moment_noise=MOMENT_NOISE)
    plan = Explore().plan(config, load_named_robot(config.robot), {})
    table = Table("arm", "limits alone us", "all checks us", "difference us", "half of the passes us", "asked us")
    for name, backend in (
        ("measures force", plan.backend()),
        ("measures none: servo model", WithoutTipForce(plan.backend())),
    ):
        periods = recorded(plan, backend)
        without, with_all, difference = MICRO * np.array([periods.medians(plan) for _ in range(passes)]).T
        low, middle, high = np.percentile(difference, [25, 50, 75])
        each = (np.median(without), np.median(with_all), middle)
        table.add_row(name, *(f"{x:.2f}" for x in each), f"{low:.2f} to {high:.2f}", f"{ASKED:g}")
    console = Console()
    console.print(table)
    console.print(f"{passes} passes over {len(periods.commands)} periods; load {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
