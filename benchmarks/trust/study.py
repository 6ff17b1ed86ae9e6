"""Study of an estimator: how often its results are honest, reported as broken, or silently wrong."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from palpate.estimation import Verdict

SILENT = 4.0
"""Standard deviations from the truth beyond which a result with verdict OK is silently wrong."""

SHARE = 0.01
"""Share of the runs of a row that may be silently wrong: a normal distribution alone makes 6e-5."""

COVERED = (0.93, 0.98)
"""Share of intervals at 95 % that hold the truth, where all assumptions hold."""


def first_finding(verdict: Verdict) -> str:
    """Return the name of the assumption that a verdict says first is broken; nothing if it is OK."""
    return "" if verdict.ok else verdict.broken[0].assumption.value


@dataclass(frozen=True)
class Run:
    """One data set and the result of an estimator.

    Attributes:
        ok: Whether the verdict is OK; data that are refused are not.
        furthest: Largest distance of a value from the truth [standard deviations as printed].
        inside: Share of the printed 95 % intervals that hold the truth, by name.
        finding: First finding of the verdict.
    """

    ok: bool
    furthest: float
    inside: Mapping[str, float] = field(default_factory=dict)
    finding: str = ""


@dataclass(frozen=True)
class Row:
    """The runs of one kind of data.

    Attributes:
        study: Name of the estimator.
        case: Name of the case.
        holds: Whether all assumptions hold, so that coverage counts.
        runs: Number of runs.
        honest: Share of runs with verdict OK, and all values within `SILENT`.
        reported: Share of runs whose verdict is not OK.
        silent: Share of runs with verdict OK, and a value beyond.
        coverage: Coverage of the intervals by name, over runs with verdict OK.
        finding: Most frequent finding of the verdicts.
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
        """Figures that are missed."""
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
        name: What is broken in the data.
        run: Makes a data set from a seed, and estimates.
        holds: Whether all assumptions hold.
        weight: Times as many seeds as other cases have.
        shown: Whether the data can show what is broken; otherwise the user must state it.
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
