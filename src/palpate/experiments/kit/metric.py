"""What a run is measured by."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.experiments.kit.experiment import Experiment, Result

MetricValue = float | int | bool | str | None
"""None where there is no such metric, or nobody knows it."""


@dataclass(frozen=True, slots=True)
class Metric:
    """One metric of a run: a column of tables, an entry of --json.

    Attributes:
        column: Its name in tables, the unit at its end.
        meaning: What it is, in a few words.
        unit: Its unit; empty for a ratio, a count, a share of runs (of true or false) or a word.
        value: From the result of a run to its value.
    """

    column: str
    meaning: str
    unit: str
    value: Callable[[Any], MetricValue]


def metrics_of(experiment: "Experiment", result: "Result") -> dict[str, MetricValue]:
    """Return every metric of a result, by column; numbers that are not finite are None."""
    values = ((metric.column, metric.value(result)) for metric in experiment.metrics)
    return {column: number(value) if isinstance(value, float) else value for column, value in values}


def number(value: float | None) -> float | None:
    """Return a number as a plain float; None where there is none, or not a finite one."""
    return None if value is None or not math.isfinite(value) else float(value)


def is_share(values: Iterable[MetricValue]) -> bool:
    """Return whether a metric's values are true or false: shown is then the share of runs for which it is true."""
    known = [value for value in values if value is not None]
    return bool(known) and all(isinstance(value, bool) for value in known)
