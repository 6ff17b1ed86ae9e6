"""`palpate sweep`: carries out the runs with progress, writes the results, and prints a summary."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

import joblib
from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.start_up import interrupted_by
from palpate.commands.sweep.config import SweepConfig
from palpate.commands.sweep.plan import Combination, SweepPlan, sweep_plan
from palpate.commands.sweep.result import FEWEST_SEEDS, SweepResult, spread_of, time_text
from palpate.commands.sweep.run import SweepAtWork, check, finished
from palpate.commands.sweep.store import SweepFolder
from palpate.commands.typed_values import plain
from palpate.experiments.kit.metric import Metric, number
from palpate.reporting.page import WrittenReport
from palpate.runtime.batch import BatchError, BatchProgress, ShowProgress, batch_bar
from palpate.runtime.progress import LINE_INTERVAL, doing, say

START_UP_S = 3.0
"""Time in which a worker imports the simulator [s]."""

MOST_LISTED = 40
"""Largest number of combinations, and of failures, that a terminal shows."""


def run_sweep(config: SweepConfig) -> CommandResult:
    """Carry out the remaining runs, and write the results of all.

    Returns:
        Counts and metrics; the exit code is 0 if every run reached its end, else 1.

    Raises:
        InvalidValueError: If an option is impossible, or if the folder belongs to another sweep; nothing has run.
        KeyboardInterrupt: On Ctrl-C; finished runs are kept.
        OSError: If a file cannot be written.
    """
    console = Console()
    plan = sweep_plan(config)
    with doing(console, "checking every combination"):
        checked = check(plan)
    say(console, f"{plan.title}: {plan.size}")
    if config.dry_run:
        _list(console, plan)
        say(console, _expected_duration(config, checked.expected, len(plan.runs)))
        metrics = {"runs": len(plan.runs), "expected_one_core_s": checked.expected}
        return CommandResult(outcome=plan.size, metrics=metrics, facts={"dry_run": True})
    folder = SweepFolder(plan.folder)
    with folder.alone():
        work = SweepAtWork(checked, folder, finished(checked, folder))
        try:
            _carry_out(console, work)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(_kept(work, interrupted_by())) from None
        except BatchError as error:
            return CommandResult(ExitCode.UNFINISHED, error=_kept(work, str(error)))
        with doing(console, "writing tables, figure and report"):
            written = work.write()
    _print_result(console, work.result)
    for failure in written.warnings:
        say(console, failure)
    say(console, "Written: " + ", ".join(map(str, written.files)))
    return _result(work.result, written)


def _carry_out(console: Console, work: SweepAtWork) -> None:
    """Carry out the remaining runs, and show progress."""
    if work.records:
        later = "; --keep-reports is for those still to be done" if work.checked.plan.config.keep_reports else ""
        say(console, f"{len(work.records)} of them are there already{later}")
    left = len(work.left)
    if left:
        expected = _expected_duration(work.checked.plan.config, work.expected, left)
        say(console, f"{expected}, {work.runner.describe()}")
        with _progress(console) as show:
            work.carry_out(show)


def _kept(work: SweepAtWork, why: str) -> str:
    kept = f"{len(work.records)} of {len(work.checked.plan.runs)} runs are kept in {work.folder.path}"
    return f"{why}; {kept}: the same command goes on from there"


def _result(result: SweepResult, written: WrittenReport) -> CommandResult:
    """Return the result: counts, and the metrics shown for each combination."""
    plan = result.plan
    combinations = [
        {
            **{each.name: plain(value) for each, value in zip(plan.varied, combination.values, strict=True)},
            "runs": result.done_of(combination),
            **{metric.key: _spread_facts(result, metric, combination) for metric in result.metrics},
        }
        for combination in plan.combinations
    ]
    failures = [
        {"run": record.run, "status": record.status.value, "message": record.message} for record in result.failures
    ]
    return CommandResult(
        ExitCode.UNFINISHED if result.failures or written.failures else ExitCode.DONE,
        result.outcome,
        {
            "runs": len(result.records),
            "runs_done": len(result.records) - len(result.failures),
            "computed_s": result.computed,
        },
        facts={"combinations": combinations, "failures": failures},
        files=written.files,
        warnings=(*result.notes, *written.warnings),
    )


def _spread_facts(result: SweepResult, metric: Metric, combination: Combination) -> dict[str, float | None]:
    spread = spread_of(result.values(metric, [combination]))
    low, high = (spread.low, spread.high) if spread.count >= FEWEST_SEEDS else (None, None)
    return {"median": number(spread.middle), "p10": number(low), "p90": number(high)}


def _print_result(console: Console, result: SweepResult) -> None:
    """Print the results: a table by combination, and one of failures."""
    from palpate.commands.sweep.report import combination_rows, run_name

    columns = [combination_rows(result, i) for i in range(len(result.metrics))]
    if columns:
        table = Table(title=Text(result.plan.title), caption=Text(result.outcome))
        table.add_column("combination" if result.plan.varied else "", overflow="fold")
        for metric in result.metrics:
            table.add_column(Text(metric.meaning), justify="right")
        for row in list(zip(*columns, strict=True))[:MOST_LISTED]:
            cells = [f"{value} {unit}".rstrip() + (f" ({note})" if note else "") for _, value, unit, note in row]
            table.add_row(Text(row[0][0]), *map(Text, cells))
        console.print(table)
        if len(columns[0]) > MOST_LISTED:
            say(console, f"and {len(columns[0]) - MOST_LISTED} more combinations, in runs.csv")
    else:
        say(console, result.outcome)
    if result.failures:
        table = Table(title=Text("Runs that did not get to their end"))
        for heading in ("run", "how", "why"):
            table.add_column(heading, overflow="fold")
        for record in result.failures[:MOST_LISTED]:
            table.add_row(*map(Text, (run_name(result, record), record.status.value, record.message)))
        console.print(table)
        if len(result.failures) > MOST_LISTED:
            say(console, f"and {len(result.failures) - MOST_LISTED} more, in runs.csv")
        say(console, "To do these again: the same command with --repeat-failed")


def _list(console: Console, plan: SweepPlan) -> None:
    """List every run."""
    for run in plan.runs:
        name = plan.name_of(run.combination)
        say(console, f"{run.number:6d}  {name}{', ' if name else ''}seed={run.case.seed}")


def _expected_duration(config: SweepConfig, expected: float, runs: int) -> str:
    """Return the expected duration of some runs as text.

    Args:
        config: Options of the sweep.
        expected: Wall time of all runs, one after the other [s].
        runs: Number of runs.
    """
    to_do = f"{runs} run{'s' if runs > 1 else ''} to do"
    if config.ray is not None and config.jobs is None:
        return f"{to_do}, about {time_text(expected)} of computing on one core"
    jobs = min(config.jobs or joblib.cpu_count(), joblib.cpu_count() if config.ray is None else runs, runs)
    return f"{to_do}, about {time_text(START_UP_S + expected / jobs)}"


@contextmanager
def _progress(console: Console) -> Iterator[ShowProgress]:
    """Show a bar on a terminal, else a line now and then."""
    if console.is_terminal:
        with batch_bar(console) as show:
            yield show
        return
    shown = time.perf_counter()

    def show_line(progress: BatchProgress) -> None:
        nonlocal shown
        wall = time.perf_counter()
        if wall - shown > LINE_INTERVAL:
            shown = wall
            failed = f", {progress.failed} failed" if progress.failed else ""
            say(console, f"{progress.done} of {progress.cases} runs done{failed}")

    yield show_line
