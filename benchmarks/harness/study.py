"""Methods, cases and judges, and the study that they make."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True, slots=True)
class Method:
    """One way to an answer.

    Attributes:
        name: Name in tables and pictures.
        prepare: Takes the setting of an input (a fingertip, a grasp); returns the function from data to answer.
        most: Largest number of inputs per case on which the error is measured.
    """

    name: str
    prepare: Callable[[Any], Callable[[Any], Any]]
    most: int = 10**9


@dataclass(frozen=True, slots=True, eq=False)
class Input:
    """One problem: its setting, the data that the method receives, and the true answer."""

    setting: Any
    data: Any
    truth: Any


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """Inputs of one kind; `about` says what is hard about them."""

    name: str
    inputs: Sequence[Input]
    about: str = ""


Judge = Callable[[Any, Input], float]
"""Error of an answer; NaN if there is no answer."""


@dataclass(frozen=True, slots=True)
class Errors:
    """Errors of a method on a case.

    Attributes:
        typical: Median (inputs without an answer count as infinitely wrong) or root mean square.
        largest: Largest error of the answers given; NaN without any.
        failed: Share of inputs without an answer, or with an error above the limit.
        silent: Share of inputs without an answer.
    """

    typical: float
    largest: float = math.nan
    failed: float = 0.0
    silent: float = 0.0

    @classmethod
    def of(cls, values: Sequence[float], limit: float = math.inf, *, rms: bool = False) -> "Errors":
        """Summarise errors; those above `limit` count as failed."""
        errors = np.asarray(values, dtype=float)
        given = errors[np.isfinite(errors)]
        failed, silent = float(np.mean(~(errors <= limit))), 1.0 - len(given) / len(errors)
        if not len(given):
            return cls(math.nan, math.nan, failed, silent)
        typical = np.sqrt(np.mean(given**2)) if rms else np.median(np.where(np.isfinite(errors), errors, np.inf))
        return cls(float(typical), float(given.max()), failed, silent)


def judged(method: Method, case: Case, judge: Judge) -> list[float]:
    """Return the error of every answer of a method on a case."""
    return [judge(method.prepare(each.setting)(each.data), each) for each in case.inputs[: method.most]]


@dataclass(frozen=True, slots=True)
class Ratio:
    """Median of paired ratios and its 95 % interval, by order statistics: no distribution is assumed."""

    median: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class Row:
    """Cost and errors of one method on one case.

    Attributes:
        case: Name of the case.
        method: Name of the method, or of one setting of it.
        cost: Cost [SI].
        errors: One entry per quantity of the study.
        series: Rows of one series are joined by a line in the picture; the method's name if empty.
        ratio: Cost relative to the neighbour in time.
        note: Remark of the last column.
        drawn: Whether the picture shows it.
    """

    case: str
    method: str
    cost: float
    errors: tuple[Errors, ...]
    series: str = ""
    ratio: Ratio | None = None
    note: str = ""
    drawn: bool = True


@dataclass(frozen=True, slots=True)
class Check:
    """A figure that was asked for: requirement, result, and whether it is met (None: shown, not judged)."""

    what: str
    asked: str
    got: str
    kept: bool | None = None

    @classmethod
    def at_most(cls, what: str, limit: float, got: float) -> "Check":
        """Return the check of a number that may not exceed a limit; NaN misses it."""
        return cls(what, f"<= {limit:.3g}", f"{got:.3g}", bool(got <= limit))


@dataclass(frozen=True, slots=True)
class Study:
    """Result of one family of benchmarks.

    Attributes:
        title: Short heading.
        about: Setup and truth, in sentences.
        cost: Quantity of `Row.cost`, without its unit.
        cost_unit: SI unit.
        quantities: Name and SI unit ("" for a ratio) of each error.
        rows: In the order of the table.
        checks: Figures that were asked for.
        tables: Further tables (rich), each as it stands.
        pictured: Number of quantities, from the first on, that the picture shows.
    """

    title: str
    about: str = ""
    cost: str = ""
    cost_unit: str = "s"
    quantities: tuple[tuple[str, str], ...] = ()
    rows: tuple[Row, ...] = ()
    checks: tuple[Check, ...] = ()
    tables: tuple[Any, ...] = ()
    pictured: int = 9


@dataclass(frozen=True, slots=True)
class Effort:
    """How much to measure: `quick` takes fewer inputs and rounds; `tell` reports progress."""

    quick: bool = False
    seed: int = 0
    tell: Callable[[str], None] = lambda _: None

    def of(self, full: int, quick: int) -> int:
        """Return the full number or the quick one."""
        return quick if self.quick else full


Measure = Callable[[Effort], Study]
"""Carries out a study."""
