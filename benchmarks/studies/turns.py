"""Time of several functions, in turns: what else the computer does hits all of them alike."""

import time
from collections.abc import Callable, Mapping

SHORTEST = 2e-3
"""[s] A turn repeats what is quicker until it takes so long: clocks and calls are then nothing to it."""


def timed_in_turns(functions: Mapping[str, Callable[[], object]], turns: int) -> dict[str, float]:
    """Return the time of one call of each [s]: the least of all turns, for what disturbs only ever adds.

    Args:
        functions: By name. Each is called once before, for what only the first call has to do.
        turns: How often each has its turn.
    """
    counts = {name: _calls(function) for name, function in functions.items()}
    taken: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(turns):
        for name, function in functions.items():
            taken[name].append(_time(function, counts[name]) / counts[name])
    return {name: min(each) for name, each in taken.items()}


def _calls(function: Callable[[], object]) -> int:
    function()
    count = 1
    while True:
        taken = _time(function, count)
        if taken >= SHORTEST:
            return count
        count = max(2 * count, round(count * SHORTEST / max(taken, 1e-9)))


def _time(function: Callable[[], object], count: int) -> float:
    started = time.perf_counter()
    for _ in range(count):
        function()
    return time.perf_counter() - started
