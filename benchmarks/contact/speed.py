"""Time per contact, as ratios of things measured next to each other in one run.

The floor of a batch is a copy of as many bytes into equally fresh arrays. "As many bytes" is the size of palpate's
answer, 121 bytes per contact: 15 float64 (centroid, normal, force, tangential force, normal force, spin torque,
condition) and one byte of status. "Equally fresh": one block of 15 n float64 and one of n bytes, allocated in the
measured time, as `contacts_from_wrenches` allocates them. The copy reads 121 and writes 121 bytes per contact;
palpate reads 48 (the wrench) and writes 121. The other methods return the centroid only, 24 bytes, so the ratios
flatter them.

Every measurement stands between two of what it is compared with, copy, method, copy, method, copy, and its ratio
is to the mean of the two: these machines are shared, and memory is fresh in the same way for both.
"""

import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from contact.closed_forms import Rows
from contact.methods import PALPATE, Method, Pace

SEMI_AXES = np.array([0.010, 0.012, 0.020])  # [m], about a thumb
BYTES = 15 * 8 + 1
SINGLE_SECONDS = 6e-3
"""A single call is repeated for about so long in each round: thousands of resolutions of the clock."""
REPEATS = 3
"""In so many parts, of which the fastest counts: whoever else has the core interrupts for longer than a part."""


@dataclass(frozen=True, slots=True)
class Timing:
    """What one method took.

    Attributes:
        seconds: Per contact, one entry per round.
        ratios: To the neighbours in time: the copy for a batch, `contact_from_wrench` for a single call.
    """

    seconds: tuple[float, ...]
    ratios: tuple[float, ...]

    @property
    def median(self) -> float:
        """Median time per contact [s]."""
        return statistics.median(self.seconds)

    @property
    def spread(self) -> tuple[float, float, float]:
        """Least, median and largest ratio."""
        return min(self.ratios), statistics.median(self.ratios), max(self.ratios)


@dataclass(frozen=True, slots=True)
class Speeds:
    """Timings by method name, and the floor's [s per contact]."""

    batch: dict[str, Timing]
    single: dict[str, Timing]
    floor: float


def built_wrenches(n: int) -> Rows:
    """Return the wrenches of n ordinary soft contacts on the ellipsoid, shape (n, 6) [N, N m]."""
    generator = np.random.default_rng(7)
    direction = generator.normal(size=(n, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    centroid = direction * SEMI_AXES
    normal = direction / SEMI_AXES
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    tangent = np.cross(normal, generator.normal(size=(n, 3)))
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    force = generator.uniform(0.5, 5.0, (n, 1)) * (-normal + generator.uniform(0.0, 1.0, (n, 1)) * tangent)
    spin = generator.normal(scale=2e-3, size=(n, 1))
    return np.hstack([force, np.cross(centroid, force) + spin * normal])


def measure(
    methods: tuple[Method, ...], contacts: int, rounds: int, done: Callable[[], None] = lambda: None
) -> Speeds:
    """Time all methods in turns.

    Args:
        methods: To be compared.
        contacts: In the whole batch.
        rounds: Of every measurement.
        done: Called after each round.
    """
    wrenches = built_wrenches(contacts)
    batches = [_batch(method, wrenches) for method in methods if method.pace is not Pace.SINGLE]
    singles = [_single(method, wrenches[0]) for method in methods]
    copy, call = _copy(contacts), _single(PALPATE, wrenches[0])
    with np.errstate(all="ignore"):
        for run in (*batches, *singles, copy, call):
            run.warm_up()
        for _ in range(rounds):
            _interleave(batches, copy)
            _interleave(singles, call)
            done()
    return Speeds(
        {run.name: run.timing() for run in batches},
        {run.name: run.timing() for run in singles},
        copy.timing().median,
    )


class _Run:
    """An action that is timed again and again."""

    def __init__(self, name: str, action: Callable[[], object], contacts: int, calls: int = 1) -> None:
        self.name, self._action, self._contacts, self._calls = name, action, contacts, calls
        self._taken: list[tuple[float, float]] = []

    def warm_up(self) -> None:
        """Compile and fill caches; find how many calls make up a measurement of one contact."""
        self._action()
        if self._contacts == 1:
            self._calls = max(1, int(SINGLE_SECONDS / REPEATS / self.seconds()))

    def seconds(self) -> float:
        """Return the time per contact [s]."""
        return min(self._once() for _ in range(REPEATS if self._contacts == 1 else 1))

    def _once(self) -> float:
        started = time.perf_counter()
        for _ in range(self._calls):
            self._action()
        return (time.perf_counter() - started) / (self._calls * self._contacts)

    def keep(self, taken: float, beside: float) -> None:
        """Remember a measurement and what its neighbour took."""
        self._taken.append((taken, taken / beside))

    def timing(self) -> Timing:
        """Return all that was remembered."""
        seconds, ratios = zip(*self._taken, strict=True)
        return Timing(seconds, ratios)


def _interleave(runs: list[_Run], beside: _Run) -> None:
    beside.seconds()  # takes back the memory that others had, which the first copy should not pay for
    before = beside.seconds()
    for run in runs:
        taken = run.seconds()
        after = beside.seconds()
        run.keep(taken, 0.5 * (before + after))
        beside.keep(after, after)
        before = after


def _batch(method: Method, wrenches: Rows) -> _Run:
    rows = wrenches[: max(1, int(method.pace.value * len(wrenches)))].astype(method.dtype)
    solve = method.prepare(SEMI_AXES)
    return _Run(method.name, lambda: solve(rows), len(rows))


def _single(method: Method, wrench: Rows) -> _Run:
    row = wrench.astype(method.dtype)
    solve = method.one(SEMI_AXES)
    return _Run(method.name, lambda: solve(row), 1)


def _copy(contacts: int) -> _Run:
    numbers, status = np.ones(15 * contacts), np.ones(contacts, np.int8)
    return _Run("copy", lambda: (numbers.copy(), status.copy()), contacts)
