"""The report of all studies: one HTML file."""

import math
import os
import platform
from collections.abc import Sequence

from palpate.experiments.kit.versions import versions_text
from palpate.reporting.report import Paragraph, Pictures, Report, Section, TextTable
from palpate.strict_yaml import read_yaml
from studies.picture import study_picture
from studies.study import Row, Study

PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def speed_error_report(studies: Sequence[Study], asked: str) -> Report:
    """Return the report.

    Args:
        studies: That are finished.
        asked: The command that repeats it.
    """
    return Report(
        title="Speed against error",
        asked="what each method costs on this computer, and how far it is off",
        outcome="Methods took turns: trust the ratios more than the times.",
        figures=(),
        sections=tuple(map(_section, studies)),
        repeat=(("All of it again:", asked),),
        settings=computer(),
        footer="Errors are against known truths; times are the least of many turns.",
    )


def computer() -> tuple[tuple[str, str], ...]:
    """Return on what it was measured."""
    found = read_yaml(versions_text())
    versions = tuple((str(k), str(v)) for k, v in found.items()) if isinstance(found, dict) else ()
    return (("computer", f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"), *versions)


def _section(study: Study) -> Section:
    least = min((row.cost for row in study.rows if math.isfinite(row.cost)), default=math.nan)
    heads = ("method", study.cost, "", f"error {study.error}", "", "")
    rows = [_cells(study, row, least) for row in study.rows]
    columns = ("name", "value", "unit", "value", "unit", "note")
    drawn = Pictures(lambda: [study_picture(study)])
    return Section(study.title, (Paragraph(study.about), drawn, TextTable(rows, columns, heads)))


def _cells(study: Study, row: Row, least: float) -> tuple[str, ...]:
    timed = study.cost_unit == "s" and row.cost > least
    beside = [f"{_ratio(row.cost / least)} times the least {study.cost}"] if timed else []
    beside += [f"largest error {quantity(row.worst, study.error_unit)}"] if math.isfinite(row.worst) else []
    beside += [row.note] if row.note else []
    return (
        row.method,
        *_parted(row.cost, study.cost_unit),
        *_parted(row.typical, study.error_unit),
        "; ".join(beside),
    )


def _ratio(ratio: float) -> str:
    return f"{ratio:.3g}" if ratio < 1e3 else f"{ratio:.0f}"


def _parted(value: float, unit: str) -> tuple[str, str]:
    """A number and its unit, each for a column of its own."""
    number, _, prefixed = quantity(value, unit).partition(" ")
    return number, prefixed


def quantity(value: float, unit: str) -> str:
    """Return a number with its unit, in thousandths of it and so on if it is small; a dash where there is none."""
    if not math.isfinite(value):
        return "-"
    if not unit:
        return f"{value:.2g}"
    factor, prefix = next(((f, p) for f, p in PREFIXES if abs(value) >= f), PREFIXES[-1] if value else PREFIXES[0])
    return f"{value / factor:.3g} {prefix}{unit}"
