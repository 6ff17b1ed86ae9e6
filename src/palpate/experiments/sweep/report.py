"""The report on a sweep: one HTML file."""

from html import escape
from pathlib import Path

import numpy as np

from palpate.atomic_file import replacing
from palpate.experiments.sweep.plan import DIGITS, Combination
from palpate.experiments.sweep.record import RunRecord, RunStatus
from palpate.experiments.sweep.result import HIGH, LOW, SweepResult, numbers_of, spread_of
from palpate.experiments.sweep.scale import scale_of
from palpate.experiments.sweep.typed_values import shown_value
from palpate.experiments.sweep.words import time_text

MOST_ROWS = 60
"""Of a table in the report: the rest is in runs.csv."""

COLUMNS = ("name", "value", "unit", "note")


def write_report(result: SweepResult, path: Path) -> None:
    """Write the report; a former one is replaced once the new one is whole.

    Raises:
        OSError: The file cannot be written.
    """
    text = report_html(result)
    with replacing(path) as file:
        file.write(text.encode("utf-8"))


def report_html(result: SweepResult) -> str:
    """Return the report as the text of an HTML document."""
    from palpate.experiments.sweep.picture import pictures
    from palpate.reporting.page import page, picture_cards, section, table

    plan = result.plan
    shown = [_section_rows(result, i) for i in range(len(result.figures))]
    tables = [
        f'<h3 style="margin-top: 1.4em">{escape(figure.words)}</h3>\n{table(rows, COLUMNS)}'
        for figure, rows in zip(result.figures, shown, strict=True)
    ]
    return page(
        plan.title,
        [
            f'<h1>{escape(plan.title)}</h1>\n<p class="outcome">{escape(result.outcome)}</p>',
            table(key_rows(result), COLUMNS),
            section("What came out", [picture_cards(pictures(result))]),
            section("By combination" if plan.varied else "In figures", tables),
            section(
                "Runs that did not get to their end", [table(failure_rows(result), ("name", "value", "note"))]
            ),
            section("Settings", [table(setting_rows(result), ("name", "value"))]),
            "<footer>Every run is a row of runs.csv, in SI units. Written by palpate.</footer>",
        ],
    )


def key_rows(result: SweepResult) -> list[tuple[str, str, str, str]]:
    """Return how many runs there are, how they went and what they cost: name, value, unit, note."""
    rows = [("asked for", str(len(result.records)), "runs", result.plan.size.partition(": ")[2])]
    rows += [
        (_STATUS_WORDS[status], str(result.counted(status)), "runs", "")
        for status in RunStatus
        if status is RunStatus.DONE or result.counted(status)
    ]
    durations = numbers_of([record.duration for record in result.records])
    if durations.size:
        rows.append(("computing time of a run", time_text(float(np.median(durations))), "", "median"))
        rows.append(("of all runs together", time_text(float(durations.sum())), "", _hosts(result)))
    return rows


def combination_rows(result: SweepResult, index: int) -> list[tuple[str, str, str, str]]:
    """Return what a figure is for each combination: name, value, unit, note."""
    figure, plan = result.figures[index], result.plan
    values = numbers_of(result.values(figure, plan.combinations))
    scale = scale_of(figure.unit, float(np.abs(values).max()) if values.size else 0.0)
    rows = []
    for combination in plan.combinations:
        spread = spread_of(result.values(figure, [combination]))
        name = plan.name_of(combination) or "all runs"
        value = f"{scale.factor * spread.middle:.4g}" if spread.count else "-"
        note = (
            f"{scale.factor * spread.low:.4g} to {scale.factor * spread.high:.4g}"
            if spread.low < spread.high
            else ""
        )
        rows.append((name, value, scale.unit if spread.count else "", _with_count(result, combination, note)))
    return rows


def failure_rows(result: SweepResult) -> list[tuple[str, str, str]]:
    """Return the runs that did not get to their end: which, how it went, why."""
    rows = [(run_name(result, record), record.status.value, record.message) for record in result.failures]
    return (
        rows
        if len(rows) <= MOST_ROWS
        else [*rows[:MOST_ROWS], (f"and {len(rows) - MOST_ROWS} more", "", "in runs.csv")]
    )


def run_name(result: SweepResult, record: RunRecord) -> str:
    """Return which run it is, in words."""
    name = result.plan.name_of(result.plan.runs[record.run].combination)
    return f"run {record.run}: " + (f"{name}, " if name else "") + f"seed={record.seed}"


def setting_rows(result: SweepResult) -> list[tuple[str, str]]:
    """Return what was asked: name, value."""
    plan = result.plan
    seeds = f"{plan.seeds.start}" + (f" to {plan.seeds[-1]}" if len(plan.seeds) > 1 else "")
    rows = [("experiment", plan.swept.name)]
    for each in plan.varied:
        values = ", ".join(shown_value(value, DIGITS) for value in each.values)
        rows.append((f"{each.name}, varied", f"{values} {plan.swept.unit(each.name)}".rstrip()))
    for name, value in plan.fixed.items():
        rows.append((name, f"{shown_value(value)} {plan.swept.unit(name)}".rstrip()))
    rows.append(("seeds of each combination", seeds))
    versions = next((record.versions for record in result.records if record.versions), {})
    rows.append(("versions", ", ".join(f"{name} {version}" for name, version in versions.items())))
    return rows


_STATUS_WORDS = {
    RunStatus.DONE: "got to their end",
    RunStatus.UNFINISHED: "stopped before",
    RunStatus.FAILED: "failed",
    RunStatus.DIED: "processes died",
}


def _section_rows(result: SweepResult, index: int) -> list[tuple[str, str, str, str]]:
    rows = combination_rows(result, index)
    heading = ("combination", "median", "", f"{LOW:g} to {HIGH:g} % of the runs")
    more = [(f"and {len(rows) - MOST_ROWS} more", "", "", "in runs.csv")] if len(rows) > MOST_ROWS else []
    return [heading, *rows[:MOST_ROWS], *more]


def _with_count(result: SweepResult, combination: Combination, note: str) -> str:
    done, count = result.done_of(combination), len(result.plan.seeds)
    if done == count:
        return note
    return f"{note}; {done} of {count} runs" if note else f"{done} of {count} runs"


def _hosts(result: SweepResult) -> str:
    hosts = dict.fromkeys(record.host for record in result.records if record.host)
    return f"on {len(hosts)} computers" if len(hosts) > 1 else ""
