"""The table: speed and error of every method on one page."""

import math

from rich import box
from rich.table import Table

from contact.categories import FAILED, Category, Errors
from contact.methods import Method
from contact.speed import BYTES, Speeds, Timing

WIDTH = 140
"""Characters that the table takes; cut off in a narrower terminal."""


def speed_error_table(
    methods: tuple[Method, ...],
    found: dict[str, dict[str, Errors]],
    speeds: Speeds,
    categories: tuple[Category, ...],
) -> Table:
    """Return the table; `found` is by method, then by category."""
    table = Table(title="Contact sensing: speed against error", box=box.SIMPLE, padding=(0, 1, 0, 0))
    table.add_column("method", no_wrap=True)
    for heading in ("batch\nns", "times\nthe copy", "single\nus", "times\npalpate"):
        table.add_column(heading, justify="right", no_wrap=True)
    for category in categories:
        table.add_column(category.name.replace(" ", "\n", 1), justify="right", no_wrap=True)
    table.add_row("copy (the floor)", number(1e9 * speeds.floor), "1", "", "", *[""] * len(categories))
    for method in methods:
        batch, single = speeds.batch.get(method.name), speeds.single[method.name]
        table.add_row(
            method.name,
            number(1e9 * batch.median) if batch else "-",
            ratios(batch) if batch else "-",
            number(1e6 * single.median),
            ratios(single),
            *[errors(found[method.name][category.name]) for category in categories],
        )
    return table


def explanation(categories: tuple[Category, ...], contacts: int, rounds: int, cases: int) -> str:
    """Return what the numbers are, for below the table."""
    hardness = "; ".join(f"{category.name}: {category.about}" for category in categories)
    return (
        "Under a category: median / largest / share failed, of |c - true c| / |true c| on "
        f"{cases} contacts (at most 200 for scipy root, 40 for least_squares). Failed: no number, or wrong by "
        f"more than {FAILED:.0e}. The median counts no number as infinitely wrong, the largest leaves it out. "
        f"{hardness}. The wrench axis neglects spin: that error is its own. Float32 includes rounding the wrench "
        "to it.\n"
        f"Times: medians, and least / median / largest ratio over {rounds} rounds, each to its neighbours in "
        f"time: trust the ratios. Batch of {contacts:.0e} (Newton and implicit: a tenth), one thread. The copy "
        f"moves {BYTES} bytes per contact into equally fresh arrays: as many as palpate's answer, all fields and "
        "a status. All but palpate return the centroid only. Single: to palpate's Contact object."
    )


def number(value: float) -> str:
    """Return three digits, or all before the point."""
    if value >= 100.0:
        return f"{value:.0f}"
    return f"{value:.1f}" if value >= 10.0 else f"{value:.2f}"


def ratios(timing: Timing) -> str:
    """Return least, median and largest ratio, one below the other."""
    return "\n".join(number(ratio) for ratio in timing.spread)


def errors(found: Errors) -> str:
    """Return median, largest and share failed, one below the other."""
    return "\n".join((_error(found.median), _error(found.largest), _share(found.failed)))


def _error(value: float) -> str:
    return f"{value:.0e}" if math.isfinite(value) else "none"


def _share(value: float) -> str:
    if value == 0.0:
        return "0 %"
    return f"{100.0 * value:.1f} %" if value < 0.1 else f"{100.0 * value:.0f} %"
