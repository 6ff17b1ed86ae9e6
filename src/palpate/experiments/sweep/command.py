"""`palpate sweep`: the runs with their progress, what is kept of them, and the summary on the terminal."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import joblib
from rich.console import Console
from rich.table import Table
from rich.text import Text

from palpate.experiments.answer import Answer, ExitCode
from palpate.experiments.progress import LINE_INTERVAL, doing
from palpate.experiments.sweep.config import SweepConfig
from palpate.experiments.sweep.figure import Figure, number
from palpate.experiments.sweep.plan import Combination, SweepPlan, simulated_durations, sweep_plan
from palpate.experiments.sweep.ray_runner import RayRunner, check_ray
from palpate.experiments.sweep.record import RunRecord
from palpate.experiments.sweep.result import SweepResult, checked_columns, shown_figures, spread_of
from palpate.experiments.sweep.runner import LocalRunner, Runner, record_of
from palpate.experiments.sweep.store import SweepFolder
from palpate.experiments.sweep.typed_values import plain
from palpate.experiments.sweep.words import time_text
from palpate.runtime.batch import BatchError, BatchProgress, ShowProgress, progress_bar

WORDS = ("shape", "contact", "mu_how", "spin_length_how")
"""Columns that hold words."""

START_UP = 3.0
"""For a worker to import the simulator [s]."""

MOST_LISTED = 40
"""Combinations, and failures, that a terminal shows."""


def run_sweep(config: SweepConfig) -> Answer:
    """Do the runs that are not done yet, and write what came out of all of them.

    Returns:
        What came out; the exit code is 0 if every run got to its end, else 1.

    Raises:
        InvalidValueError: Something typed cannot be, or the folder is another sweep's; nothing has run.
        KeyboardInterrupt: Ctrl-C. What is finished is kept.
        OSError: A file cannot be written.
    """
    console = Console()
    plan = sweep_plan(config)
    if config.ray is not None:
        check_ray(config.ray)
    with doing(console, "checking every combination"):
        carrier = plan.swept.carrier
        asked = checked_columns(config.show, carrier.FIGURES, WORDS)
        simulated = len(plan.seeds) * sum(simulated_durations(plan))
    _say(console, f"{plan.title}: {plan.size}")
    expected = carrier.SECONDS * simulated
    if config.dry_run:
        _list(console, plan)
        _say(console, _foretold(config, expected, len(plan.runs)))
        return Answer(outcome=plan.size, figures={"runs": len(plan.runs), "expected_one_core_s": expected})
    folder = SweepFolder(config.folder)
    with folder.alone():
        records = folder.begin(plan)
        if config.repeat_failed:
            records = {number: record for number, record in records.items() if record.done}
        try:
            _do(console, config, plan, folder, records, expected)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(_kept(folder, records, plan, "interrupted")) from None
        except BatchError as error:
            return Answer(ExitCode.UNFINISHED, error=_kept(folder, records, plan, str(error)))
        shown = asked or shown_figures(records.values(), carrier.FIGURES, carrier.MERITS)
        result = SweepResult(plan, tuple(records[run.number] for run in plan.runs), shown)
        with doing(console, "writing tables, picture and report"):
            files = _write(result, carrier.FIGURES, folder)
    _tell(console, result)
    _say(console, "Written: " + ", ".join(map(str, files)))
    return _answer(result, files)


def _do(
    console: Console,
    config: SweepConfig,
    plan: SweepPlan,
    folder: SweepFolder,
    records: dict[int, RunRecord],
    expected: float,
) -> None:
    """Do what is left, and put it into records and folder as it comes."""
    left = [run.case for run in plan.runs if run.number not in records]
    if records:
        _say(console, f"{len(records)} of them are there already")
        known = [record.duration for record in records.values() if record.duration is not None and record.done]
        expected = sum(known) / len(known) * len(left) if known else expected * len(left) / len(plan.runs)
    if not left:
        return
    runner = runner_for(config)
    _say(console, f"{_foretold(config, expected, len(left))}, {runner.describe()}")
    with _progress(console) as show:

        def take(progress: BatchProgress) -> None:
            if progress.outcome is not None:
                record = record_of(progress.outcome)
                folder.keep(record)
                records[record.run] = record
            show(progress)

        runner.run(left, take)


def runner_for(config: SweepConfig) -> Runner:
    """Return who does the runs."""
    return LocalRunner(config.jobs) if config.ray is None else RayRunner(config.ray, config.jobs)


def _kept(folder: SweepFolder, records: Mapping[int, RunRecord], plan: SweepPlan, why: str) -> str:
    kept = f"{len(records)} of {len(plan.runs)} runs are kept in {folder.path}"
    return f"{why}; {kept}: the same command goes on from there"


def _write(result: SweepResult, figures: Sequence[Figure], folder: SweepFolder) -> tuple[Path, ...]:
    from palpate.experiments.sweep.picture import write_summary
    from palpate.experiments.sweep.report import write_report
    from palpate.experiments.sweep.tables import columns_of, rows_of, write_csv, write_parquet

    path, columns = folder.path, columns_of(result.plan, figures)
    rows = rows_of(result.plan, result.records, figures)
    write_csv(rows, columns, path / "runs.csv")
    parquet = ["runs.parquet"] if write_parquet(rows, columns, path / "runs.parquet") else []
    write_report(result, path / "report.html")
    write_summary(result, path / "summary.png")
    names = ["report.html", "summary.png", "runs.csv", *parquet]
    return tuple(path / name for name in names)


def _answer(result: SweepResult, files: tuple[Path, ...]) -> Answer:
    """What a program is told: counts, and the figures that are shown for each combination."""
    plan = result.plan
    combinations = [
        {
            **{each.name: plain(value) for each, value in zip(plan.varied, combination.values, strict=True)},
            "runs": result.done_of(combination),
            **{figure.column: _spread_facts(result, figure, combination) for figure in result.figures},
        }
        for combination in plan.combinations
    ]
    failures = [
        {"run": record.run, "status": record.status.value, "message": record.message} for record in result.failures
    ]
    return Answer(
        ExitCode.UNFINISHED if result.failures else ExitCode.DONE,
        result.outcome,
        {
            "runs": len(result.records),
            "runs_done": len(result.records) - len(result.failures),
            "computed_s": result.computed,
        },
        facts={"combinations": combinations, "failures": failures},
        files=files,
        warnings=result.notes,
    )


def _spread_facts(result: SweepResult, figure: Figure, combination: Combination) -> dict[str, float | None]:
    spread = spread_of(result.values(figure, [combination]))
    return {"median": number(spread.middle), "p10": number(spread.low), "p90": number(spread.high)}


def _tell(console: Console, result: SweepResult) -> None:
    """Say what came out: a table by combination, and one of failures."""
    from palpate.experiments.sweep.report import combination_rows, run_name

    columns = [combination_rows(result, i) for i in range(len(result.figures))]
    if columns:
        table = Table(title=Text(result.plan.title), caption=Text(result.outcome))
        table.add_column("combination" if result.plan.varied else "", overflow="fold")
        for figure in result.figures:
            table.add_column(Text(figure.words), justify="right")
        for row in list(zip(*columns, strict=True))[:MOST_LISTED]:
            cells = [f"{value} {unit}".rstrip() + (f" ({note})" if note else "") for _, value, unit, note in row]
            table.add_row(Text(row[0][0]), *map(Text, cells))
        console.print(table)
        if len(columns[0]) > MOST_LISTED:
            _say(console, f"and {len(columns[0]) - MOST_LISTED} more combinations, in runs.csv")
    else:
        _say(console, result.outcome)
    if result.failures:
        table = Table(title=Text("Runs that did not get to their end"))
        for heading in ("run", "how", "why"):
            table.add_column(heading, overflow="fold")
        for record in result.failures[:MOST_LISTED]:
            table.add_row(*map(Text, (run_name(result, record), record.status.value, record.message)))
        console.print(table)
        if len(result.failures) > MOST_LISTED:
            _say(console, f"and {len(result.failures) - MOST_LISTED} more, in runs.csv")
        _say(console, "To do these again: the same command with --repeat-failed")


def _list(console: Console, plan: SweepPlan) -> None:
    """List every run."""
    for run in plan.runs:
        name = plan.name_of(run.combination)
        _say(console, f"{run.number:6d}  {name}{', ' if name else ''}seed={run.case.config.seed}")


def _foretold(config: SweepConfig, expected: float, runs: int) -> str:
    """About how long so many runs take, in words.

    Args:
        config: What was typed.
        expected: Wall time of all of them, one after the other [s].
        runs: How many they are.
    """
    to_do = f"{runs} run{'s' if runs > 1 else ''} to do"
    if config.ray is not None and config.jobs is None:
        return f"{to_do}, about {time_text(expected)} of computing on one core"
    jobs = min(config.jobs or joblib.cpu_count(), joblib.cpu_count() if config.ray is None else runs, runs)
    return f"{to_do}, about {time_text(START_UP + expected / jobs)}"


@contextmanager
def _progress(console: Console) -> Iterator[ShowProgress]:
    """A bar on a terminal, else a line every now and then."""
    if console.is_terminal:
        with progress_bar(console) as show:
            yield show
        return
    shown = time.perf_counter()

    def show_line(progress: BatchProgress) -> None:
        nonlocal shown
        wall = time.perf_counter()
        if wall - shown > LINE_INTERVAL:
            shown = wall
            failed = f", {progress.failed} failed" if progress.failed else ""
            _say(console, f"{progress.done} of {progress.cases} runs done{failed}")

    yield show_line


def _say(console: Console, text: str) -> None:
    # whoever reads the output may have had enough, upon which rich exits: that must cost no run
    with suppress(OSError, SystemExit):
        console.print(text, highlight=False, markup=False, soft_wrap=True)
