"""What a control period costs: everything that is compared is measured in turns, in one run.

Times are of this thread's processor, so that whoever else has the core does not count; caches and clock rate they
share all the same. Trust the ratios.
"""

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from palpate.runtime import Command
from simulation.exploring import PERIOD, Exploration
from simulation.grasping import Hold

PERIODS = 100  # in each measurement: 1 to 10 ms
CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class Cost:
    """Processor time of one control period, one entry per round [s].

    Attributes:
        physics: Simulation and servos.
        sensing: The same, and sensing.
        whole: The same, and the controller; as sensing where there is none.
    """

    physics: tuple[float, ...]
    sensing: tuple[float, ...]
    whole: tuple[float, ...]

    @property
    def real_time_factors(self) -> tuple[float, float, float]:
        """Medians: of physics, with sensing, of a whole period."""
        physics, sensing, whole = (statistics.median(each) for each in (self.physics, self.sensing, self.whole))
        return PERIOD / physics, PERIOD / sensing, PERIOD / whole


class Timed:
    """Something whose period is timed: an exploration, or an object held."""

    def __init__(self, run: Exploration | Hold) -> None:
        self._run = run
        command = Command()
        backend, touch = run.backend, run.touch
        self._physics: Callable[[], object] = lambda: backend.step(command)
        self._sensing: Callable[[], object] = lambda: touch.sense(backend.step(command))
        self._taken: list[tuple[float, float, float]] = []

    def settle(self, periods: int) -> None:
        """Run whole periods, until what is timed is what goes on most of the time."""
        for _ in range(periods):
            if isinstance(self._run, Exploration):
                self._run.step()

    def measure(self) -> None:
        """Take one round."""
        whole = self._run.step if isinstance(self._run, Exploration) else self._sensing
        self._taken.append((_seconds(self._physics), _seconds(self._sensing), _seconds(whole)))

    def warm_up(self) -> None:
        """Fill caches; this round does not count."""
        self.measure()
        self._taken.clear()

    @property
    def cost(self) -> Cost:
        """All rounds so far."""
        physics, sensing, whole = zip(*self._taken, strict=True)
        return Cost(physics, sensing, whole)


Name = TypeVar("Name")


def measure(runs: Mapping[Name, Timed], rounds: int, done: Callable[[], None] = lambda: None) -> dict[Name, Cost]:
    """Time all runs in turns, there and back: none stands always after the same other one."""
    for timed in runs.values():
        timed.warm_up()
    for i in range(rounds):
        for timed in list(runs.values())[:: -1 if i % 2 else 1]:
            timed.measure()
        done()
    return {name: timed.cost for name, timed in runs.items()}


@dataclass(frozen=True, slots=True)
class Ratio:
    """Paired: of each round, one time over the other.

    Attributes:
        median: Of the ratios.
        low: Lower end of its 95 % interval, by order statistics: no distribution is assumed.
        high: Upper end.
    """

    median: float
    low: float
    high: float


def ratio(times: tuple[float, ...], others: tuple[float, ...]) -> Ratio:
    """Return the paired ratio of two costs measured in the same rounds."""
    ratios = sorted(a / b for a, b in zip(times, others, strict=True))
    n = len(ratios)
    rank = _rank(n)
    return Ratio(statistics.median(ratios), ratios[rank], ratios[n - 1 - rank])


def _rank(n: int) -> int:
    """Largest k with P(Binomial(n, 1/2) <= k - 1) <= (1 - confidence) / 2; 0 if there is none."""
    left, term, k = 0.0, 0.5**n, 0
    while left + term <= (1.0 - CONFIDENCE) / 2.0:
        left += term
        k += 1
        term *= (n - k + 1) / k
    return k


def _seconds(action: Callable[[], object]) -> float:
    began = time.thread_time()
    for _ in range(PERIODS):
        action()
    return (time.thread_time() - began) / PERIODS
