"""Metrics and findings of a run, each defined once for every place that shows them; imports nothing heavy."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from palpate.experiments.kit.experiment import Experiment, Result
    from palpate.reporting.data import Quantity

MetricValue = float | int | bool | str | None
"""Value of a metric; None if the result has none."""

NOT_KNOWN = "not known on a robot"
"""Text in the row of a metric that only a simulation knows."""

MAX_ROUNDING = 1e-12
"""Largest rounding error in the unit of a row; smaller values are shown as 0."""


def _always(result: Any) -> bool:
    return True


@dataclass(frozen=True, slots=True)
class Metric:
    """One number of merit of a run: a row of terminal and report, an entry of --json, a column of sweeps.

    Attributes:
        key: Name in tables and JSON, with the SI unit at its end.
        meaning: Name for people, in a few words.
        unit: SI unit; "" for a ratio, a count, a share of runs (true or false) or a word.
        value: Function from the result of a run to the value in SI units.
        shown_unit: Unit of the report's row, for example "mm"; "" for the SI unit.
        digits: Significant digits of the report's row.
        note: Remark beside the report's row, or a function from the result to it.
        interval: Function from the result to the ends of the 95 % interval in SI units; None without interval.
        needs_truth: Whether only a simulation knows the value.
        applies: Function from the result to whether the run has this metric at all.
        in_table: Whether the first table of the report has a row for it.
    """

    key: str
    meaning: str
    unit: str
    value: Callable[[Any], MetricValue]
    shown_unit: str = ""
    digits: int = 4
    note: str | Callable[[Any], str] = ""
    interval: Callable[[Any], tuple[float, float] | None] | None = None
    needs_truth: bool = False
    applies: Callable[[Any], bool] = _always
    in_table: bool = True

    def of(self, result: Any) -> MetricValue:
        """Return the value for programs: None where there is none, or where it is not a finite number."""
        value = self.value(result) if self.applies(result) else None
        return number(value) if isinstance(value, float) else value

    def row(self, result: Any) -> "Quantity | None":
        """Return the row of the report; None if there is nothing to show."""
        from palpate.reporting.data import Quantity, interval_words, value_words
        from palpate.reporting.units import UNITS

        if not (self.in_table and self.applies(result)):
            return None
        value, note = self.value(result), self.note if isinstance(self.note, str) else self.note(result)
        unknown = value is None or (isinstance(value, float) and math.isnan(value))
        if unknown and self.needs_truth:
            return Quantity(self.meaning, NOT_KNOWN)
        if value is None:
            return None
        if isinstance(value, bool):
            return Quantity(self.meaning, "yes" if value else "no", "", note)
        if isinstance(value, str):
            return Quantity(self.meaning, value, "", note)
        unit = self.shown_unit or self.unit
        factor = 1.0 / UNITS[unit][1] if unit in UNITS else 1.0
        ends = None if self.interval is None else self.interval(result)
        if ends is None:
            shown = value if factor == 1.0 else factor * value
            return Quantity(self.meaning, 0.0 if abs(shown) < MAX_ROUNDING else shown, unit, note, self.digits)
        scaled = factor * value, factor * ends[0], factor * ends[1]
        notes = "; ".join(each for each in (interval_words(*scaled), note) if each)
        return Quantity(self.meaning, value_words(*scaled), unit, notes)


def metrics_of(experiment: "Experiment", result: "Result") -> dict[str, MetricValue]:
    """Return every metric of a result, by key."""
    return {metric.key: metric.of(result) for metric in experiment.metrics}


def metric_rows(metrics: Iterable[Metric], result: "Result") -> "tuple[Quantity, ...]":
    """Return the rows of a report's first table."""
    rows = (metric.row(result) for metric in metrics)
    return tuple(row for row in rows if row is not None)


def metric_notes(metrics: Iterable[Metric], result: "Result") -> dict[str, str]:
    """Return the remarks on metrics, by key; only those that have one."""
    rows = ((metric.key, metric.row(result)) for metric in metrics)
    return {key: row.note for key, row in rows if row is not None and row.note}


def number(value: float | None) -> float | None:
    """Return a number as a plain float; None where there is none, or not a finite one."""
    return None if value is None or not math.isfinite(value) else float(value)


def is_share(values: Iterable[MetricValue]) -> bool:
    """Return whether the values of a metric are true or false, so that the share of runs is shown."""
    known = [value for value in values if value is not None]
    return bool(known) and all(isinstance(value, bool) for value in known)


@dataclass(frozen=True, slots=True)
class Finding:
    """A statement of the report that holds for some results, and the remedy.

    Attributes:
        when: Function from the result to whether the finding applies.
        sentence: Statement in the report's outcome, or a function from the result to it; "" for none.
        remedy: Advice to the user, or a function from the result to it; "" for none.
    """

    when: Callable[[Any], object]
    sentence: str | Callable[[Any], str] = ""
    remedy: str | Callable[[Any], str] = ""


def sentences(findings: Sequence[Finding], result: "Result") -> tuple[str, ...]:
    """Return the statements of the findings that apply."""
    texts = (_text(each.sentence, result) for each in findings if each.when(result))
    return tuple(text for text in texts if text)


def remedies(findings: Sequence[Finding], result: "Result") -> tuple[str, ...]:
    """Return the advice of the findings that apply."""
    texts = (_text(each.remedy, result) for each in findings if each.when(result))
    return tuple(text for text in texts if text)


def _text(text: str | Callable[[Any], str], result: "Result") -> str:
    return text if isinstance(text, str) else text(result)
