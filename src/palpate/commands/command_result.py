"""The result of a command as values: for `--json` and for the exit code."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from pathlib import Path
from typing import TYPE_CHECKING

from palpate.reporting.units import UNITS, quantity_key

if TYPE_CHECKING:
    from rich.console import RenderableType

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
        exit_code: Exit code of the command.
        outcome: Outcome in a sentence, or "".
        metrics: Numbers by name, whose suffix is the SI unit; text, or None, where there is no number.
        notes: Remarks on metrics of the report, by the metric's name.
        facts: Other values that JSON can represent, by name.
        files: Written files; with `--dry-run`, the files that a run would write.
        warnings: One sentence each.
        error: Reason why there is no result; "" if there is one.
        shown: Lines and tables that are printed at the end.
    """

    exit_code: int = ExitCode.DONE
    outcome: str = ""
    metrics: Mapping[str, object] = field(default_factory=dict)
    notes: Mapping[str, str] = field(default_factory=dict)
    facts: Mapping[str, object] = field(default_factory=dict)
    files: tuple[Path, ...] = ()
    warnings: tuple[str, ...] = ()
    error: str = ""
    shown: tuple["RenderableType", ...] = ()


def shown_quantities(metrics: Iterable["Quantity"]) -> tuple[dict[str, object], dict[str, str]]:
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
