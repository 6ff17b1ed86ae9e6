"""The result of a command as values: for `--json` and for the exit code."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from palpate.reporting.data import Quantity


class ExitCode(IntEnum):
    """Exit code of a command."""

    DONE = 0
    UNFINISHED = 1
    """The command could not finish, or found that something is not as it should be."""
    MISTAKE = 2
    """The arguments, or a file that they name, are wrong; nothing moved, nothing was written."""
    INTERRUPTED = 130
    """By Ctrl-C: 128 + SIGINT, the shell's convention. Of another signal the process returns 128 + its number."""


@dataclass(frozen=True, slots=True)
class CommandResult:
    """The result of a command.

    Attributes:
        exit_code: How it ended.
        outcome: The same in a sentence, or "".
        metrics: Numbers by name, whose suffix is the SI unit; text, or None, where there is no number.
        notes: Remarks on metrics of the report, by the metric's name.
        facts: Other values that JSON can represent, by name.
        files: Files that were written; with `--dry-run`, that would be written.
        warnings: One sentence each.
        error: Why there is no result; "" if there is one.
    """

    exit_code: int = ExitCode.DONE
    outcome: str = ""
    metrics: Mapping[str, object] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)
    facts: Mapping[str, object] = field(default_factory=dict)
    files: tuple[Path, ...] = ()
    warnings: tuple[str, ...] = ()
    error: str = ""


UNITS: Mapping[str, tuple[str, float]] = {
    "": ("", 1.0),
    "times": ("", 1.0),
    "%": ("share", 0.01),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "µm": ("m", 1e-6),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "µs": ("s", 1e-6),
    "Hz": ("hz", 1.0),
    "N": ("n", 1.0),
    "mN": ("n", 1e-3),
    "N m": ("n_m", 1.0),
    "mN m": ("n_m", 1e-3),
    "kg": ("kg", 1.0),
    "rad": ("rad", 1.0),
    "degrees": ("rad", math.pi / 180.0),
    "1/m": ("per_m", 1.0),
    "m/s": ("m_per_s", 1.0),
    "mm/s": ("m_per_s", 1e-3),
    "N/s": ("n_per_s", 1.0),
    "N/m": ("n_per_m", 1.0),
    "kN/m": ("n_per_m", 1e3),
    "m/s/N": ("m_per_s_per_n", 1.0),
    "mm/s/N": ("m_per_s_per_n", 1e-3),
    "mN/min": ("n_per_s", 1e-3 / 60.0),
}
"""For each unit of a report: suffix of the name in JSON, and factor to SI units; a percentage becomes a ratio."""

_PERCENTILE = re.compile(r"\b(\d+) %")


def quantity_key(words: str, unit: str = "") -> str:
    """Return the name of a metric in JSON: its words joined by underscores, then its SI unit."""
    plain = _PERCENTILE.sub(r"p\1", words.lower())
    parts = [re.sub(r"[^a-z0-9]+", "_", plain).strip("_"), UNITS[unit][0] if unit in UNITS else ""]
    return "_".join(part for part in parts if part)


def shown_figures(metrics: Iterable["Quantity"]) -> tuple[dict[str, object], dict[str, str]]:
    """Return the metrics of a report and their notes, by name and in SI units.

    A text that is a number becomes a number; other text keeps its unit, and its name has no suffix. A metric
    without a value has only a note.
    """
    values: dict[str, object] = {}
    notes: dict[str, str] = {}
    for metric in metrics:
        number = _number(metric.value)
        scaled = number is not None and metric.unit in UNITS
        name = _free(quantity_key(metric.name, metric.unit if scaled else ""), values)
        if number is None:
            if metric.value:  # a metric without value has only its note
                values[name] = f"{metric.value} {metric.unit}".strip()
        elif scaled:
            values[name] = number * UNITS[metric.unit][1]
        else:  # a unit without a suffix: as in the report
            values[name] = f"{metric.text} {metric.unit}"
        if metric.note:
            notes[name] = metric.note
    return values, notes


def reported_result(
    exit_code: int,
    outcome: str,
    measured: Mapping[str, object],
    shown: Iterable["Quantity"],
    files: tuple[Path, ...],
    **facts: object,
) -> CommandResult:
    """Return the result of an experiment that has a report.

    Args:
        exit_code: How it ended.
        outcome: The same in a sentence.
        measured: Its metrics by name, as `palpate sweep` has them in its tables.
        shown: The metrics of its report.
        files: That were written.
        facts: Everything else.
    """
    values, notes = shown_figures(shown)
    return CommandResult(exit_code, outcome, measured, notes, {**facts, "report": values}, files)


def _number(value: float | str) -> float | None:
    if not isinstance(value, str):
        return float(value)
    try:
        return float(value.replace(" ", ""))
    except ValueError:
        return None


def _free(name: str, taken: Mapping[str, object]) -> str:
    """Return the name, numbered if another metric has it already."""
    number = 2
    found = name
    while found in taken:
        found, number = f"{name}_{number}", number + 1
    return found
