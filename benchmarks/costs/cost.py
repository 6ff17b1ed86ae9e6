"""A cost: alternatives that are timed in turns, each with its ratio to the first one."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from harness.study import Check, Effort, Measure, Study
from harness.tables import grid, quantity
from harness.timing import Timed, rounds


def timed_cost(
    title: str,
    set_up: Callable[[Effort], Mapping[str, Timed]],
    counts: tuple[int, int],
    limits: Mapping[str, float] | None = None,
    item: str = "call",
) -> Measure:
    """Return the cost of alternatives, in time per item and relative to the first one.

    Args:
        title: What is timed.
        set_up: Returns the alternatives by name.
        counts: Rounds in full and in the quick form.
        limits: Largest ratio to the first one that is asked of an alternative.
        item: What the time is per.
    """
    return partial(_measure, title, set_up, counts, limits or {}, item)


def _measure(
    title: str,
    set_up: Callable[[Effort], Mapping[str, Timed]],
    counts: Sequence[int],
    limits: Mapping[str, float],
    item: str,
    effort: Effort,
) -> Study:
    found = rounds(set_up(effort), effort.of(*counts))
    rows, checks = [], []
    for name, each in found.items():
        ratio = each.ratio
        rows.append(
            (name, quantity(each.median, "s"), f"{ratio.median:.3g}", f"{ratio.low:.3g} to {ratio.high:.3g}")
        )
        if name in limits:
            checks.append(Check.at_most(f"{name}, ratio", limits[name], ratio.median))
    first = next(iter(found))
    table = grid(title, "", f"per {item}", f"to {first}", "95 % interval", rows=rows)
    return Study(title, checks=tuple(checks), tables=(table,))
