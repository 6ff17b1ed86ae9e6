"""Steps of a sweep, with a terminal or without: check, run on this computer or a ray cluster, write."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from palpate.commands.sweep.config import SweepConfig
from palpate.commands.sweep.plan import RunCase, SweepPlan, expected_durations
from palpate.commands.sweep.ray_runner import RayRunner, check_ray
from palpate.commands.sweep.result import SweepResult, checked_columns, shown_metrics
from palpate.commands.sweep.store import RunRecord, RunStatus, SweepFolder, without_result
from palpate.experiments.kit.metric import Metric
from palpate.runtime.batch import BatchProgress, Failure, FailureKind, Outcome, ShowProgress, run_batch

if TYPE_CHECKING:
    from palpate.reporting.page import WrittenReport


@dataclass(frozen=True, slots=True)
class LocalRunner:
    """Processes of this computer, by joblib's loky.

    Attributes:
        jobs: Number of processes; None for one per core.
    """

    jobs: int | None = None

    def describe(self) -> str:
        """Return where the runs take place, as text."""
        return "on all cores" if self.jobs is None else f"{self.jobs} at a time"

    def run(self, cases: Sequence[RunCase], progress: ShowProgress, longest: float) -> None:
        """Run every case once, by `palpate.commands.sweep.attempt.attempt`.

        A case whose process dies runs again in another process; if it dies there, too, its outcome is a `Failure`.

        Args:
            cases: Runs to do.
            progress: Called once with each outcome as soon as it is known, in any order.
            longest: Longest wall time of a case [s]; a case that takes longer counts as one whose process died.

        Raises:
            BatchError: If no case can run at all.
            KeyboardInterrupt: On Ctrl-C; all processes have ended.
        """
        from palpate.commands.sweep.attempt import attempt  # with the simulator

        if cases:
            run_batch(attempt, cases, self.jobs, progress, longest=longest)


def record_of(outcome: Outcome[RunCase, RunRecord]) -> RunRecord:
    """Return the record of an outcome."""
    if isinstance(outcome, Failure):
        status = RunStatus.DIED if outcome.kind is FailureKind.DIED else RunStatus.FAILED
        return without_result(outcome.case, status, outcome.error, outcome.traceback)
    return outcome.result


WALL_PER_SIMULATED = 0.1
"""Wall time of a simulated second, before any run is finished: measured from 0.05 to 0.2 on a core of 2023."""

HANGING_FACTOR = 50.0
"""Factor of the expected wall time after which a run counts as hanging: 25 times the slowest measured run."""

COMPILE_TIME_S = 300.0
"""Additional time of the first run, which may compile every kernel: a minute on a free core [s]."""


@dataclass(frozen=True, slots=True, eq=False)
class CheckedSweep:
    """A sweep whose combinations can all be realised.

    Attributes:
        plan: Runs.
        shown: Metrics for figure and report; empty for the first ones.
        expected: Expected wall time of all runs on one core [s].
        longest: Longest wall time that a run may take [s].
    """

    plan: SweepPlan
    shown: tuple[Metric, ...]
    expected: float
    longest: float


def check(plan: SweepPlan) -> CheckedSweep:
    """Plan every combination; the simulator is imported for it.

    Raises:
        InvalidValueError: If a combination cannot be realised, a metric is unknown, or a cluster does not respond.
        MissingLibraryError: If ray was requested and is not installed.
    """
    config = plan.config
    if config.ray is not None:
        check_ray(config.ray)
    shown = checked_columns(config.show, plan.experiment.metrics)
    durations = expected_durations(plan)
    expected = WALL_PER_SIMULATED * len(plan.seeds) * sum(durations)
    return CheckedSweep(
        plan, shown, expected, COMPILE_TIME_S + HANGING_FACTOR * WALL_PER_SIMULATED * max(durations)
    )


def finished(checked: CheckedSweep, folder: SweepFolder) -> dict[int, RunRecord]:
    """Claim the folder for this sweep, and return the finished runs by number.

    Raises:
        InvalidValueError: If the folder cannot be written, or if it belongs to another sweep.
        OSError: If a file cannot be written.
    """
    records = folder.begin(checked.plan)
    if not checked.plan.config.repeat_failed:
        return records
    return {number: record for number, record in records.items() if record.done}


def runner_for(config: SweepConfig) -> LocalRunner | RayRunner:
    """Return the runner that the options name."""
    return LocalRunner(config.jobs) if config.ray is None else RayRunner(config.ray, config.jobs)


@dataclass(frozen=True, slots=True, eq=False)
class SweepAtWork:
    """A sweep at work.

    Attributes:
        checked: Plan of the sweep.
        folder: Locked output folder.
        records: Finished runs by number; grows.
    """

    checked: CheckedSweep
    folder: SweepFolder
    records: dict[int, RunRecord]

    @property
    def left(self) -> Sequence[RunCase]:
        """Remaining runs."""
        return [run.case for run in self.checked.plan.runs if run.number not in self.records]

    @property
    def expected(self) -> float:
        """Expected wall time of the remaining runs on one core [s], from the finished ones if there are any."""
        known = [each.duration for each in self.records.values() if each.duration is not None and each.done]
        mean = sum(known) / len(known) if known else self.checked.expected / len(self.checked.plan.runs)
        return mean * len(self.left)

    @property
    def runner(self) -> LocalRunner | RayRunner:
        """Runner on this computer or on a cluster."""
        return runner_for(self.checked.plan.config)

    def carry_out(self, progress: ShowProgress) -> None:
        """Carry out the remaining runs; each record is written as soon as it is known."""
        self.runner.run(self.left, self._keeping(progress), self.checked.longest)

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
        """Result, once every run has a record."""
        plan = self.checked.plan
        shown = self.checked.shown or shown_metrics(self.records.values(), plan.experiment.metrics)
        return SweepResult(plan, tuple(self.records[run.number] for run in plan.runs), shown)

    def write(self) -> "WrittenReport":
        """Write tables, summary figure and report; return the files, and the figures that could not be drawn.

        Raises:
            OSError: If a file cannot be written.
        """
        from palpate.commands.sweep.figure import write_summary
        from palpate.commands.sweep.report import sweep_report
        from palpate.commands.sweep.store import columns_of, rows_of, write_csv, write_parquet
        from palpate.reporting.page import WrittenReport, write_report

        result, path = self.result, self.folder.path
        columns, rows = columns_of(result.plan), rows_of(result.plan, result.records)
        write_csv(rows, columns, path / "runs.csv")
        parquet = ["runs.parquet"] if write_parquet(rows, columns, path / "runs.parquet") else []
        report = sweep_report(result)
        written = write_report(report, path / "report.html", self.checked.plan.config.figures)
        page, *figures = written.files
        if not written.failures:
            write_summary(result, path / "summary.png")
        tables = [path / name for name in (*(() if written.failures else ("summary.png",)), "runs.csv", *parquet)]
        return WrittenReport((page, *tables, *figures), written.failures)
