"""How many control periods a second an agent gets through, against the bare back end and against the loop.

    python benchmarks/learning.py [--seconds 2] [--rounds 5] [--quick]

The same scene (a stage with a Nano17 over a sphere, 1 kHz) is stepped in five ways, one after the other in
every round, so that what else the machine does falls on all of them: the back end alone; with sensing; under
`GuardedRobot`, that is with the supervisor; by `TouchEnv`, with reward and what is seen, 20 periods to an
action; and by `run`, the loop, with a controller that does as little. Ratios are medians over rounds of periods
per second over those of the bare back end.
"""

import argparse
import time
from collections.abc import Callable
from statistics import median

import numpy as np
from rich.console import Console
from rich.table import Table

from palpate.experiments.explore.worlds import ExploredWorlds
from palpate.learning import GuardedRobot, TouchEnv, World
from palpate.learning.guarded_robot import approach
from palpate.runtime import Command, Observation, Sample, Supervisor, Touch, run
from palpate.runtime.wrapped_backend import WrappedBackend

SLIDE = (0.0, 0.002, 0.0)
"""What all of them do [m/s]: slowly sideways, in touch."""


class Slide:
    """A controller that does no more than that."""

    def start(self, first: Observation) -> None:
        pass

    def step(self, now: Observation) -> Command:
        return Command(SLIDE)


class Going(WrappedBackend):
    """A back end that has been started: another start goes on from where it is."""

    def start(self) -> Sample:
        return self.step(Command())


def landed() -> tuple[World, GuardedRobot]:
    """Return a world in which the tip touches the object, and the robot that has brought it there."""
    world = ExploredWorlds()(np.random.default_rng(0))
    robot = GuardedRobot(world.backend, Touch(world.finger), Supervisor(world.limits))
    robot.start()
    assert approach(robot, world.approach, world.farthest)
    return world, robot


def bare(periods: int) -> float:
    """Return how long the back end alone takes [s]."""
    world, _ = landed()
    begun = time.perf_counter()
    for _ in range(periods):
        world.backend.step(Command(SLIDE))
    return time.perf_counter() - begun


def sensed(periods: int) -> float:
    """Return how long it takes with sensing [s]."""
    world, _ = landed()
    touch = Touch(world.finger)
    begun = time.perf_counter()
    for _ in range(periods):
        touch.sense(world.backend.step(Command(SLIDE)))
    return time.perf_counter() - begun


def guarded(periods: int) -> float:
    """Return how long it takes with the supervisor [s]."""
    _, robot = landed()
    begun = time.perf_counter()
    for _ in range(periods):
        robot.step(SLIDE)
    return time.perf_counter() - begun


def looped(periods: int) -> float:
    """Return how long the loop takes [s]."""
    world, _ = landed()
    duration = periods * world.backend.period
    backend, touch = Going(world.backend), Touch(world.finger)
    return run(backend, touch, Slide(), Supervisor(world.limits), duration=duration).wall_time


def learnt(periods: int) -> float:
    """Return how long the environment takes [s], resets left out."""
    env = TouchEnv(duration=0.02 * (periods // 20 + 1))
    env.reset(seed=0)
    action = np.array(SLIDE, np.float32)
    begun = time.perf_counter()
    for _ in range(periods // 20):
        env.step(action)
    taken = time.perf_counter() - begun
    env.close()
    return taken


def reset_time() -> float:
    """Return how long a reset takes [s]: a new world, and the way down to the surface."""
    env = TouchEnv()
    env.reset(seed=0)
    begun = time.perf_counter()
    for _ in range(5):
        env.reset()
    taken = (time.perf_counter() - begun) / 5
    env.close()
    return taken


WAYS: dict[str, Callable[[int], float]] = {
    "back end alone": bare,
    "with sensing": sensed,
    "GuardedRobot": guarded,
    "TouchEnv": learnt,
    "run, the loop": looped,
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=2.0, help="simulated, each way and round")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--quick", action="store_true", help="half a second, two rounds")
    asked = parser.parse_args()
    seconds, rounds = (0.5, 2) if asked.quick else (asked.seconds, asked.rounds)
    periods = 20 * round(50 * seconds)
    for way in WAYS.values():
        way(20)  # compile and import what is not yet there
    taken: dict[str, list[float]] = {name: [] for name in WAYS}
    for _ in range(rounds):
        for name, way in WAYS.items():
            taken[name].append(way(periods))
    table = Table(title=f"{periods} periods, {rounds} rounds")
    for heading in ("", "periods/s", "of the bare back end", "times real time"):
        table.add_column(heading, justify="right" if heading else "left")
    for name, times in taken.items():
        ratio = median(b / a for a, b in zip(times, taken["back end alone"], strict=True))
        rate = periods / median(times)
        table.add_row(name, f"{rate:.0f}", f"{ratio:.2f}", f"{rate / 1000.0:.0f}")
    console = Console()
    console.print(table)
    console.print(f"a reset: {1e3 * reset_time():.0f} ms")


if __name__ == "__main__":
    main()
