"""What a sweep came to: its records, and what they are over the seeds."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice

import numpy as np

from palpate.commands.sweep.plan import Combination, SweepPlan
from palpate.commands.sweep.record import RunRecord, RunStatus
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.kit.figure import Figure, FigureValue
from palpate.nearest_name import nearest

LOW, HIGH = 10.0, 90.0
"""Percentiles of the band that is shown of several runs."""

LEAST_RUNS = 5
"""From so many on a band is told of: of fewer, a tenth is nobody's."""

SHOWN = 2
"""Number of figures that are shown by default."""


@dataclass(frozen=True, slots=True)
class FigureSpread:
    """What a figure is over several runs.

    Attributes:
        count: Of runs that have it.
        middle: Their median; of what is true or false, the share that is true; NaN if there are none.
        low: Below which a tenth of them lies,
        high: and above which.
    """

    count: int
    middle: float
    low: float
    high: float


def spread_of(values: Sequence[FigureValue]) -> FigureSpread:
    """Return the spread of those values that are numbers, or true or false."""
    known = [value for value in values if isinstance(value, bool | int | float)]
    if not known:
        return FigureSpread(0, math.nan, math.nan, math.nan)
    if all(isinstance(value, bool) for value in known):
        share = sum(known) / len(known)
        return FigureSpread(len(known), share, share, share)
    low, middle, high = np.percentile(np.array(known, dtype=float), (LOW, 50.0, HIGH)).tolist()
    return FigureSpread(len(known), middle, low, high)


@dataclass(frozen=True, eq=False)
class SweepResult:
    """Every run of a sweep with its record.

    Attributes:
        plan: The sweep.
        records: By number, one per run.
        figures: That picture and report show.
    """

    plan: SweepPlan
    records: tuple[RunRecord, ...]
    figures: tuple[Figure, ...]

    @cached_property
    def failures(self) -> tuple[RunRecord, ...]:
        """Runs that did not get to their end."""
        return tuple(record for record in self.records if not record.done)

    def counted(self, status: RunStatus) -> int:
        """Return how many runs went so."""
        return sum(record.status is status for record in self.records)

    def values(self, figure: Figure, combinations: Iterable[Combination]) -> list[FigureValue]:
        """Return a figure of all runs of some combinations that got to their end; None where it has none."""
        wanted = {id(combination) for combination in combinations}
        pairs = zip(self.plan.runs, self.records, strict=True)
        return [
            record.figures.get(figure.column)
            for run, record in pairs
            if record.done and id(run.combination) in wanted
        ]

    def done_of(self, combination: Combination) -> int:
        """Return how many runs of a combination got to their end."""
        first = next(i for i, each in enumerate(self.plan.combinations) if each is combination)
        count = len(self.plan.seeds)
        return sum(record.done for record in self.records[first * count : (first + 1) * count])

    @cached_property
    def seeds_alike(self) -> bool:
        """Whether several seeds changed nothing, in no combination: then nothing in these runs is random."""
        count, compared = len(self.plan.seeds), False
        for first in range(0, len(self.records), count):
            done = [record.figures for record in self.records[first : first + count] if record.done]
            if any(figures != done[0] for figures in done[1:]):
                return False
            compared |= len(done) > 1
        return compared

    @cached_property
    def versions(self) -> tuple[str, ...]:
        """Packages of which not all runs had the same version, with those."""
        names = dict.fromkeys(name for record in self.records for name in record.versions)
        differing = []
        for name in names:
            found = dict.fromkeys(record.versions[name] for record in self.records if name in record.versions)
            if len(found) > 1:
                differing.append(f"{name} {' and '.join(found)}")
        return tuple(differing)

    @property
    def computed(self) -> float:
        """Wall time of all runs together, each in its process [s]."""
        return sum(record.duration or 0.0 for record in self.records)

    @property
    def notes(self) -> tuple[str, ...]:
        """What people should know besides, a sentence each."""
        sentences = []
        if self.seeds_alike:
            sentences.append(
                "All seeds gave the same numbers: nothing in these runs is random (see the options for noise)."
            )
        words = [figure.column for figure in self.figures if self._is_words(figure)]
        if words:
            sentences.append(f"Of words there is no median: see {' and '.join(words)} in runs.csv.")
        if self.versions:
            sentences.append(f"Not all runs had the same versions: {'; '.join(self.versions)}.")
        return tuple(sentences)

    def _is_words(self, figure: Figure) -> bool:
        return any(isinstance(value, str) for value in self.values(figure, self.plan.combinations))

    @property
    def outcome(self) -> str:
        """How it went, in a sentence or two."""
        count, failed = len(self.records), len(self.failures)
        ended = f"{count - failed} of {count} runs" if failed else f"All {count} runs" if count > 1 else "The run"
        return " ".join((f"{ended} got to {'its' if count == 1 else 'their'} end.", *self.notes))


def checked_columns(columns: Sequence[str], figures: Sequence[Figure]) -> tuple[Figure, ...]:
    """Return the figures of columns that are typed.

    Args:
        columns: As typed.
        figures: That there are.

    Raises:
        InvalidValueError: There is no such column.
    """
    known = {figure.column: figure for figure in figures}
    for column in columns:
        if column not in known:
            near = nearest(column, list(known))
            advice = f"did you mean {near}?" if near else f"there are {', '.join(known)}"
            raise InvalidValueError(f"--show {column}: there is no such column; {advice}")
    return tuple(known[column] for column in dict.fromkeys(columns))


def shown_figures(records: Iterable[RunRecord], figures: Sequence[Figure]) -> tuple[Figure, ...]:
    """Return the figures to show by default: the first ones that are numbers in any run."""
    done = [record.figures for record in records if record.done]
    known = (f for f in figures if any(isinstance(each.get(f.column), bool | int | float) for each in done))
    return tuple(islice(known, SHOWN))


def numbers_of(values: Sequence[FigureValue]) -> FloatArray:
    """Return those values that are numbers, shape (n,)."""
    return np.array([float(value) for value in values if isinstance(value, bool | int | float)])
