"""A sweep without a terminal: `sweep` for scripts, and the steps that `palpate sweep` takes, too."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from palpate.commands.sweep.attempt import RunCase
from palpate.commands.sweep.config import SweepConfig
from palpate.commands.sweep.plan import SweepPlan, simulated_durations, sweep_plan
from palpate.commands.sweep.ray_runner import RayRunner, check_ray
from palpate.commands.sweep.record import RunRecord
from palpate.commands.sweep.result import SweepResult, checked_columns, shown_figures
from palpate.commands.sweep.runner import LocalRunner, Runner, record_of
from palpate.commands.sweep.store import SweepFolder
from palpate.experiments.kit.figure import Figure
from palpate.runtime.batch import BatchProgress, ShowProgress, progress_bar

WORDS = ("shape", "contact", "mu_how", "spin_length_how")
"""Columns that hold words."""


def sweep(config: SweepConfig, progress: ShowProgress | None = None) -> SweepResult:
    """Do the runs that are not done yet, and write tables, picture and report of all of them.

    Args:
        config: What to do.
        progress: Told how far it is; a bar on the terminal after two seconds, if not given;
            `palpate.runtime.batch.quiet` for nothing.

    Raises:
        InvalidValueError: Something typed cannot be, or the folder is another sweep's; nothing has run.
        BatchError: No worker lives long enough to do anything. What is finished is kept.
        KeyboardInterrupt: Ctrl-C. What is finished is kept.
        OSError: A file cannot be written.
    """
    checked = check(sweep_plan(config))
    folder = SweepFolder(config.folder)
    with folder.alone():
        work = SweepAtWork(checked, folder, finished(checked, folder))
        if progress is None:
            with progress_bar() as show:
                work.carry_out(show)
        else:
            work.carry_out(progress)
        work.write()
    return work.result


@dataclass(frozen=True, slots=True, eq=False)
class CheckedSweep:
    """A sweep of which every combination can be realised.

    Attributes:
        plan: Its runs.
        figures: Every figure of a run.
        shown: Those that were asked for, for picture and report; none for the best ones there are.
        expected: Wall time of all its runs on one core, about [s].
    """

    plan: SweepPlan
    figures: tuple[Figure, ...]
    shown: tuple[Figure, ...]
    expected: float


def check(plan: SweepPlan) -> CheckedSweep:
    """Plan every combination; the simulator is imported for it.

    Raises:
        InvalidValueError: One cannot be realised, or a figure to show is none, or a cluster is not there.
        MissingLibraryError: ray was asked for, and is not installed.
    """
    config = plan.asked
    if config.ray is not None:
        check_ray(config.ray)
    carrier = plan.swept.carrier
    shown = checked_columns(config.show, carrier.FIGURES, WORDS)
    simulated = len(plan.seeds) * sum(simulated_durations(plan))
    return CheckedSweep(plan, carrier.FIGURES, tuple(shown), carrier.SECONDS * simulated)


def finished(checked: CheckedSweep, folder: SweepFolder) -> dict[int, RunRecord]:
    """Make the folder this sweep's, and return the runs that need not be done, by number.

    Raises:
        InvalidValueError: The folder cannot be written, or is another sweep's.
        OSError: A file cannot be written.
    """
    records = folder.begin(checked.plan)
    if not checked.plan.asked.repeat_failed:
        return records
    return {number: record for number, record in records.items() if record.done}


def runner_for(config: SweepConfig) -> Runner:
    """Return who does the runs."""
    return LocalRunner(config.jobs) if config.ray is None else RayRunner(config.ray, config.jobs)


@dataclass(frozen=True, slots=True, eq=False)
class SweepAtWork:
    """A sweep that has begun.

    Attributes:
        checked: What is asked.
        folder: Where everything is kept; nobody else is at work there.
        records: What is finished, by number; grows.
    """

    checked: CheckedSweep
    folder: SweepFolder
    records: dict[int, RunRecord]

    @property
    def left(self) -> Sequence[RunCase]:
        """Runs that are to be done."""
        return [run.case for run in self.checked.plan.runs if run.number not in self.records]

    @property
    def expected(self) -> float:
        """Wall time of what is left on one core, about [s]: by what is finished, if anything is."""
        known = [each.duration for each in self.records.values() if each.duration is not None and each.done]
        mean = sum(known) / len(known) if known else self.checked.expected / len(self.checked.plan.runs)
        return mean * len(self.left)

    @property
    def runner(self) -> Runner:
        """Who does the runs."""
        return runner_for(self.checked.plan.asked)

    def carry_out(self, progress: ShowProgress) -> None:
        """Do what is left; each run is kept as soon as it is there."""
        self.runner.run(self.left, self._keeping(progress))

    def _keeping(self, progress: ShowProgress) -> Callable[[BatchProgress], None]:
        def take(done: BatchProgress) -> None:
            if done.outcome is not None:
                record = record_of(done.outcome)
                self.folder.keep(record)
                self.records[record.run] = record
            progress(done)

        return take

    @property
    def result(self) -> SweepResult:
        """What it came to, once everything is done."""
        plan = self.checked.plan
        merits = plan.swept.carrier.MERITS
        shown = self.checked.shown or shown_figures(self.records.values(), self.checked.figures, merits)
        return SweepResult(plan, tuple(self.records[run.number] for run in plan.runs), tuple(shown))

    def write(self) -> tuple[Path, ...]:
        """Write tables, picture and report; return the files.

        Raises:
            OSError: A file cannot be written.
        """
        from palpate.commands.sweep.picture import write_summary
        from palpate.commands.sweep.report import write_report
        from palpate.commands.sweep.tables import columns_of, rows_of, write_csv, write_parquet

        result, path = self.result, self.folder.path
        columns = columns_of(result.plan, self.checked.figures)
        rows = rows_of(result.plan, result.records, self.checked.figures)
        write_csv(rows, columns, path / "runs.csv")
        parquet = ["runs.parquet"] if write_parquet(rows, columns, path / "runs.parquet") else []
        write_report(result, path / "report.html")
        write_summary(result, path / "summary.png")
        return tuple(path / name for name in ("report.html", "summary.png", "runs.csv", *parquet))
