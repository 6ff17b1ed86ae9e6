"""Time by rounds against neighbours: other load on the computer hits all methods alike, so ratios can be trusted.

Every measurement is compared with its neighbours in time: with the mean of the two measurements of `beside` around
it, or, without `beside`, with the first method in the same round.
"""

import statistics
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TypeVar

from harness.study import Ratio

SHORTEST = 2e-3
"""[s] Shorter actions are repeated until they take this long, so that clock and call overhead vanish."""

CONFIDENCE = 0.95
Name = TypeVar("Name")


@dataclass(slots=True)
class Timed:
    """An action whose time is measured.

    Attributes:
        action: The action.
        items: Items that one call handles; times are per item.
        clock: Clock [s].
        before: Prepares each measurement; not timed.
        calls: Calls in one measurement, found by `warm_up`.
    """

    action: Callable[[], object]
    items: int = 1
    clock: Callable[[], float] = time.perf_counter
    before: Callable[[], object] = lambda: None
    calls: int = 0

    def warm_up(self) -> None:
        """Compile, fill caches, and find the number of calls."""
        self.before()
        self.action()
        self.calls = 1
        while (taken := self.seconds() * self.calls * self.items) < SHORTEST:
            self.calls = max(2 * self.calls, round(self.calls * SHORTEST / max(taken, 1e-9)))

    def seconds(self) -> float:
        """Return the time per item [s]."""
        self.before()
        started = self.clock()
        for _ in range(self.calls):
            self.action()
        return (self.clock() - started) / (self.calls * self.items)


@dataclass(frozen=True, slots=True)
class Timing:
    """Times per item [s] and their ratios to the neighbours, one entry per round."""

    seconds: tuple[float, ...]
    ratios: tuple[float, ...]

    @property
    def median(self) -> float:
        """Median time per item [s]."""
        return statistics.median(self.seconds)

    @property
    def least(self) -> float:
        """Least time per item [s]: disturbances only ever add."""
        return min(self.seconds)

    @property
    def ratio(self) -> Ratio:
        """Ratio to the neighbours."""
        return interval(self.ratios)


def rounds(runs: Mapping[Name, Timed], count: int, beside: Timed | None = None) -> dict[Name, Timing]:
    """Time all runs in turns, there and back."""
    for each in (*runs.values(), *([beside] if beside else [])):
        each.warm_up()
    taken: dict[Name, list[tuple[float, float]]] = {name: [] for name in runs}
    for i in range(count):
        order = list(runs)[:: -1 if i % 2 else 1]
        found, before = {}, beside.seconds() if beside else 0.0
        if beside:  # the first copy takes back memory that others had
            before = beside.seconds()
        for name in order:
            seconds = runs[name].seconds()
            after = beside.seconds() if beside else 0.0
            found[name] = seconds, 0.5 * (before + after)
            before = after
        first = found[next(iter(runs))][0]
        for name, (seconds, neighbour) in found.items():
            taken[name].append((seconds, seconds / (neighbour or first)))
    return {name: Timing(*zip(*each, strict=True)) for name, each in taken.items()}


def interval(ratios: tuple[float, ...]) -> Ratio:
    """Return the median of paired ratios and its 95 % interval; their whole range if there are fewer than six."""
    ordered, n = sorted(ratios), len(ratios)
    below, term, k = 0.0, 0.5**n, 0
    while below + term <= (1.0 - CONFIDENCE) / 2.0:  # largest k with P(Binomial(n, 1/2) < k) within one tail
        below += term
        k += 1
        term *= (n - k + 1) / k
    rank = max(k - 1, 0)
    return Ratio(statistics.median(ordered), ordered[rank], ordered[n - 1 - rank])
