"""What a study finds of one kind of data: how often results were honest, reported as broken, or silently wrong."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from palpate.estimation import Verdict

SILENT = 4.0
"""Standard deviations from the truth beyond which a result with verdict OK is silently wrong."""

SHARE = 0.01
"""Of the runs of a row that may be: chance alone makes 6e-5 of a normal distribution."""

COVERED = (0.93, 0.98)
"""Share of intervals at 95 % that hold the truth, where all assumptions hold."""


def first_finding(verdict: Verdict) -> str:
    """Return the name of the assumption that a verdict says first is broken; nothing if it is OK."""
    return "" if verdict.ok else verdict.broken[0].assumption.value


@dataclass(frozen=True)
class Run:
    """One data set, and what an estimator made of it.

    Attributes:
        ok: Whether the verdict is OK; data that are refused are not.
        furthest: Largest distance of a value from the truth [standard deviations as printed].
        inside: Of each interval at 95 % that is printed, by its name, whether it holds the truth, or which share
            of several does.
        finding: What the verdict says first.
    """

    ok: bool
    furthest: float
    inside: Mapping[str, float] = field(default_factory=dict)
    finding: str = ""


@dataclass(frozen=True)
class Row:
    """The runs of one kind of data.

    Attributes:
        study: What is estimated.
        case: What is done to the data.
        holds: Whether all assumptions hold, so that coverage counts.
        runs: How many.
        honest: Share of runs with verdict OK, and all values within `SILENT`.
        reported: Share of runs whose verdict is not OK.
        silent: Share of runs with verdict OK, and a value beyond.
        coverage: Of the intervals by name, over runs with verdict OK.
        finding: What verdicts say most often.
        shown: Whether the data can show what is broken.
    """

    study: str
    case: str
    holds: bool
    runs: int
    honest: float
    reported: float
    silent: float
    coverage: Mapping[str, float]
    finding: str
    shown: bool

    @property
    def misses(self) -> Iterator[str]:
        """What is not as asked."""
        if self.silent > SHARE and self.shown:
            yield f"{self.study}, {self.case}: silently wrong in {self.silent:.1%} of {self.runs}"
        for name, share in self.coverage.items() if self.holds else ():
            # two standard deviations of what so many runs can tell
            doubt = 2.0 * (0.95 * 0.05 / self.runs) ** 0.5
            if not COVERED[0] - doubt <= share <= COVERED[1] + doubt:
                yield f"{self.study}, {self.case}: coverage of {name} {share:.1%}"


@dataclass(frozen=True)
class Case:
    """One kind of data.

    Attributes:
        name: What is done to them.
        run: Makes a data set from a seed, and what comes of it.
        holds: Whether all assumptions hold.
        weight: Times as many seeds as other cases have.
        shown: Whether the data can show at all what is broken; what they cannot, their user must state.
    """

    name: str
    run: Callable[[int], Run]
    holds: bool = False
    weight: float = 1.0
    shown: bool = True


@dataclass(frozen=True)
class Study:
    """One estimator's kinds of data."""

    name: str
    cases: tuple[Case, ...]

    def row(self, case: Case, seeds: int) -> Row:
        """Run a case with so many seeds."""
        runs = [case.run(seed) for seed in range(max(1, round(seeds * case.weight)))]
        ok = np.array([run.ok for run in runs])
        far = np.array([not run.furthest <= SILENT for run in runs])
        kept = [run.inside for run in runs if run.ok]
        names = list(dict.fromkeys(name for inside in kept for name in inside))
        found = [run.finding for run in runs if run.finding]
        return Row(
            self.name,
            case.name,
            case.holds,
            len(runs),
            float((ok & ~far).mean()),
            float((~ok).mean()),
            float((ok & far).mean()),
            {name: float(np.mean([inside[name] for inside in kept if name in inside])) for name in names},
            max(found, key=found.count, default=""),
            case.shown,
        )
