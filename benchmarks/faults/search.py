"""Search for the controller, sensor and motion that exceed a limit the most: at random first, then near the worst.

What is searched is in `PLUNGES` and in `Squeeze`. Sought is the largest ratio of a true force or grip, a commanded
or true speed, an acceleration or a position to its limit.
"""

import random
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Protocol

from rich.console import Console
from rich.progress import track
from rich.table import Table

from faults.mountings import PERIOD, K
from faults.on_the_loop import FORCE_EXCESS, MOTION_EXCESS
from faults.plunge import LIMITS, PLUNGES, SENSOR, PlungeCase
from faults.squeeze import Squeeze, SqueezeCase

LOCAL = 0.6
"""Share of the tries that begin at the worst case so far."""

STEP = 0.15
"""Standard deviation of a step of such a try, as a share of each parameter's range."""


class Attacked(Protocol):
    """Where cases are tried."""

    def excesses(self, case: Any) -> Mapping[str, float]:
        """Return the largest ratios to the limits in a run of a case."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class Search:
    """What is varied, and where.

    Attributes:
        name: For the table.
        where: Tries cases.
        case: Their class: all fields are numbers from 0 to 1.
        free: Those that are varied; the others are as they should be.
    """

    name: str
    where: Attacked
    case: type
    free: Sequence[str]

    def drawn(self, chance: random.Random, near: object) -> Any:
        """Return a case that is anywhere, or near another one."""
        around = {name: None if near is None else getattr(near, name) for name in self.free}
        values = {k: chance.random() if x is None else x + chance.gauss(0.0, STEP) for k, x in around.items()}
        return self.case(**{name: min(1.0, max(0.0, value)) for name, value in values.items()})

    def worst(self, tries: int, seed: int) -> dict[str, tuple[float, Any]]:
        """Return the largest ratio of each quantity that so many tries find, and its case."""
        chance = random.Random(seed)
        found: dict[str, tuple[float, Any]] = {}
        bar = Console(stderr=True)
        for index in track(range(tries), description=f"{self.name:60}", console=bar, transient=True):
            near = None
            if found and chance.random() < LOCAL * index / tries + 0.1:
                near = found[chance.choice(list(found))][1]
            case = self.drawn(chance, near)
            for name, ratio in self.where.excesses(case).items():
                if name not in found or ratio > found[name][0]:
                    found[name] = (ratio, case)
        return found


EVERYTHING = [field.name for field in fields(PlungeCase)]
CONTROLLER = [name for name in EVERYTHING if name not in SENSOR]

SEARCHES = (
    *(Search(f"controller, {name}", where, PlungeCase, CONTROLLER) for name, where in PLUNGES.items()),
    Search("sensor, onto a plate", PLUNGES["onto a plate"], PlungeCase, sorted(SENSOR)),
    Search("both, onto a plate", PLUNGES["onto a plate"], PlungeCase, EVERYTHING),
    Search("controller of a hand", Squeeze(), SqueezeCase, [field.name for field in fields(SqueezeCase)]),
)
"""Who is wrong, and where."""


def allowed(quantity: str) -> float:
    """Return the largest ratio that may be found."""
    adds = LIMITS.speed * PERIOD * K / LIMITS.force  # by what one period at the allowed speed presses harder
    return FORCE_EXCESS + adds if quantity == "force" else MOTION_EXCESS


def searched(tries: int, seed: int) -> int:
    """Search with each so many tries; print the worst, and return 1 if it is not allowed."""
    console, table = Console(width=200), Table("who is wrong", "quantity", "largest, per limit", "allowed", "with")
    exceeded = False
    for search in SEARCHES:
        for name, (ratio, case) in search.worst(tries, seed).items():
            exceeded |= ratio > allowed(name)
            shown = ", ".join(f"{each} {getattr(case, each):.2f}" for each in search.free)
            table.add_row(search.name, name, f"{ratio:.3f}", f"{allowed(name):.2f}", shown)
    console.print(table)
    sys.stdout.flush()
    return int(exceeded)
