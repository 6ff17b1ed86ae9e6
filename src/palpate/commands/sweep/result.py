"""Result of a sweep: its records, and the metrics over the seeds."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from palpate.commands.sweep.plan import Combination, SweepPlan
from palpate.commands.sweep.store import RunRecord, RunStatus
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.kit.metric import Metric, MetricValue
from palpate.experiments.kit.registry import ShownResult
from palpate.nearest_name import nearest

if TYPE_CHECKING:
    from palpate.reporting.report import Report

MINUTE, HOUR = 60.0, 3600.0


def time_text(seconds: float) -> str:
    """Return a time [s] with two digits or so, in a unit that suits it."""
    if seconds < 10.0:
        return f"{seconds:.2g} s"
    if seconds < 1.5 * MINUTE:
        return f"{seconds:.0f} s"
    if seconds < 1.5 * HOUR:
        return f"{seconds / MINUTE:.0f} min"
    return f"{seconds / HOUR:.2g} h" if seconds < 100 * HOUR else f"{seconds / HOUR / 24:.0f} days"


LOW, HIGH = 10.0, 90.0
"""Percentiles of the band that is shown of several runs."""

FEWEST_SEEDS = 5
"""Smallest number of runs of a combination for which a spread is shown. All runs of one combination lie above or
below all runs of another by chance with a probability of 2 / C(10, 5) = 0.8 %; with four runs each, 2.9 %."""

DEFAULT_METRICS = 2
"""Number of metrics shown by default."""


@dataclass(frozen=True, slots=True)
class MetricSpread:
    """Spread of a metric over several runs.

    Attributes:
        count: Number of runs that have the metric.
        middle: Median, or the share of true values; NaN without runs.
        low: 10th percentile.
        high: 90th percentile.
    """

    count: int
    middle: float
    low: float
    high: float

    def scaled(self, factor: float) -> "MetricSpread":
        """Return the spread in another unit."""
        return MetricSpread(self.count, factor * self.middle, factor * self.low, factor * self.high)


def spread_of(values: Sequence[MetricValue]) -> MetricSpread:
    """Return the spread of those values that are numbers, or true or false."""
    known = [value for value in values if isinstance(value, bool | int | float)]
    if not known:
        return MetricSpread(0, math.nan, math.nan, math.nan)
    if all(isinstance(value, bool) for value in known):
        share = sum(known) / len(known)
        return MetricSpread(len(known), share, share, share)
    low, middle, high = np.percentile(np.array(known, dtype=float), (LOW, 50.0, HIGH)).tolist()
    return MetricSpread(len(known), middle, low, high)


@dataclass(frozen=True, eq=False)
class SweepResult(ShownResult):
    """Every run of a sweep with its record.

    Attributes:
        plan: The sweep.
        records: By number, one per run.
        metrics: Metrics that figure and report show.
    """

    plan: SweepPlan
    records: tuple[RunRecord, ...]
    metrics: tuple[Metric, ...]

    def _report(self) -> "Report":
        from palpate.commands.sweep.report import sweep_report  # which imports this module

        return sweep_report(self)

    @cached_property
    def failures(self) -> tuple[RunRecord, ...]:
        """Runs that did not get to their end."""
        return tuple(record for record in self.records if not record.done)

    def counted(self, status: RunStatus) -> int:
        """Return the number of runs with a status."""
        return sum(record.status is status for record in self.records)

    def values(self, metric: Metric, combinations: Iterable[Combination]) -> list[MetricValue]:
        """Return a metric of all runs of some combinations that got to their end; None where it has none."""
        wanted = {id(combination) for combination in combinations}
        pairs = zip(self.plan.runs, self.records, strict=True)
        return [
            record.metrics.get(metric.key)
            for run, record in pairs
            if record.done and id(run.combination) in wanted
        ]

    def by_combination(self, metric: Metric) -> list[list[MetricValue]]:
        """Return a metric of the runs that got to their end, combination by combination."""
        count = len(self.plan.seeds)
        each = (self.records[first : first + count] for first in range(0, len(self.records), count))
        return [[record.metrics.get(metric.key) for record in records if record.done] for records in each]

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
            done = [record.metrics for record in self.records[first : first + count] if record.done]
            if any(metrics != done[0] for metrics in done[1:]):
                return False
            compared |= len(done) > 1
        return compared

    @cached_property
    def versions(self) -> tuple[str, ...]:
        """Packages whose version differs between runs, with the versions."""
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
        """Further remarks, a sentence each."""
        sentences = []
        if self.seeds_alike:
            sentences.append("All seeds gave the same numbers: nothing in these runs is random.")
        words = [metric.key for metric in self.metrics if self._is_words(metric)]
        if words:
            sentences.append(f"Words have no median: see {' and '.join(words)} in runs.csv.")
        if self.versions:
            sentences.append(f"Not all runs had the same versions: {'; '.join(self.versions)}.")
        return tuple(sentences)

    def _is_words(self, metric: Metric) -> bool:
        return any(isinstance(value, str) for value in self.values(metric, self.plan.combinations))

    @property
    def outcome(self) -> str:
        """Outcome in a sentence or two."""
        count, failed = len(self.records), len(self.failures)
        ended = f"{count - failed} of {count} runs" if failed else f"All {count} runs" if count > 1 else "The run"
        return " ".join((f"{ended} got to {'its' if count == 1 else 'their'} end.", *self.notes))


def checked_columns(columns: Sequence[str], metrics: Sequence[Metric]) -> tuple[Metric, ...]:
    """Return the metrics of columns that are typed.

    Args:
        columns: Keys as typed.
        metrics: Metrics of the experiment.

    Raises:
        InvalidValueError: If there is no such column.
    """
    known = {metric.key: metric for metric in metrics}
    for column in columns:
        if column not in known:
            near = nearest(column, list(known))
            advice = f"did you mean {near}?" if near else f"there are {', '.join(known)}"
            raise InvalidValueError(f"--show {column}: there is no such column; {advice}")
    return tuple(known[column] for column in dict.fromkeys(columns))


def shown_metrics(records: Iterable[RunRecord], metrics: Sequence[Metric]) -> tuple[Metric, ...]:
    """Return the metrics to show by default: the first ones that are numbers in any run."""
    done = [record.metrics for record in records if record.done]
    known = (f for f in metrics if any(isinstance(each.get(f.key), bool | int | float) for each in done))
    return tuple(islice(known, DEFAULT_METRICS))


def numbers_of(values: Sequence[MetricValue]) -> FloatArray:
    """Return those values that are numbers, shape (n,)."""
    return np.array([float(value) for value in values if isinstance(value, bool | int | float)])
