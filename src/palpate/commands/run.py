"""`palpate EXPERIMENT`: a run with its progress, its files and its summary on the terminal."""

from dataclasses import replace
from typing import Any

from rich.console import Console

from palpate.commands.command_result import CommandResult, ExitCode, reported_result
from palpate.commands.earlier_run import print_earlier_run
from palpate.commands.run_shown import kept_if_interrupted, print_outcome, run_shown, tell
from palpate.errors import InvalidValueError
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.metric import metrics_of
from palpate.experiments.kit.output_folder import make_folder
from palpate.experiments.kit.recorded_run import Recorded, RecordedRun
from palpate.experiments.kit.recording import log_writer, write_result, written
from palpate.experiments.kit.run_report import run_report
from palpate.experiments.kit.script import plan_for
from palpate.interruption import requested
from palpate.reporting.figure_kind import FigureKind
from palpate.reporting.terminal import quantities
from palpate.runtime import RunResult, result_until
from palpate.runtime.progress import doing, run_progress, say

SECOND_STOPPED = (
    "Stopping: the report is of the first run alone, and is being written (Ctrl-C again: stop without it)"
)
"""Printed immediately after Ctrl-C in the second run."""

UNUSABLE = (InvalidValueError, MemoryError, ImportError)
"""After a run: its measurements cannot be evaluated, although the arguments were right; or no memory is left, not
even to load what draws. Its log is there."""


def run_experiment(experiment: Experiment, config: Any, figures: FigureKind | None = None) -> CommandResult:
    """Prepare, run, record, write the files and print the summary, also after a Ctrl-C.

    Args:
        experiment: What to do.
        config: How; an instance of its `Config`.
        figures: As which files each figure is written, too; None: as none.

    Returns:
        The result; done if the run finished and reached its goal.

    Raises:
        InvalidValueError: The configuration cannot be realised, preparing has found nothing, or the folder cannot
            be written; nothing is left behind.
        MissingLibraryError: This computer lacks the robot's client library.
        KeyboardInterrupt: Before the run had begun: there is nothing to write yet; or while the report was made.
        OSError: A file cannot be written.
    """
    console = Console()
    with doing(console, "planning"):
        plan = plan_for(experiment, config)
    if plan.robot is not None:
        plan.robot.file.backend.check_drivers()
    expected = plan.dry_run()
    make_folder(config.out)
    notes = (*print_earlier_run(console, config.out, experiment.name, expected.files), *expected.notes)
    for note in expected.notes:
        say(console, note)
    if plan.preparation:
        with doing(console, plan.preparation):
            plan = plan.prepared()
    run, log = RecordedRun(plan), log_writer(experiment, plan, config.out)
    result, interrupted = run_shown(console, plan.expected_duration, lambda observer: run.run((observer,), (log,)))
    with kept_if_interrupted(result):
        companion = None
        if not interrupted:
            companion, interrupted = _companion(console, plan)
        try:
            with doing(console, "working out what was found"):
                found = experiment.evaluate(plan, run.recorded(result, companion, lambda step: say(console, step)))
            report = run_report(experiment, plan, found)
            with doing(console, "drawing the report"):
                files = write_result(experiment, found, report, config.out, figures)
            tell(console, plan, result, experiment.cloud(found))
        except UNUSABLE as error:
            tell(console, plan, result)
            return replace(_unusable_result(console, result, error, interrupted=interrupted), warnings=notes)
    console.print(quantities(report.title, report.outcome, report.all_metrics))
    print_outcome(console, result, files)
    code = ExitCode.DONE if result.done and report.reached else ExitCode.UNFINISHED
    summary = reported_result(
        ExitCode.INTERRUPTED if interrupted or requested() is not None else code,
        report.outcome,
        metrics_of(experiment, found),
        report.all_metrics,
        written(result, files),
        ending=result.ending.value,
        rest=result.rest,
    )
    return replace(summary, warnings=notes)


def _companion(console: Console, plan: Plan) -> tuple[Recorded | None, bool]:
    """Run the companion of the first run; None, and that it was interrupted, after Ctrl-C."""
    second = plan.companion()
    if second is None or requested() is not None:
        return None, False
    run = RecordedRun(second)
    try:
        with run_progress(console, second.expected_duration) as observer:
            return run.recorded(run.run((observer,))), False
    except KeyboardInterrupt as interruption:
        if result_until(interruption) is None:
            raise
        say(console, SECOND_STOPPED)
        return None, True


def _unusable_result(console: Console, result: RunResult, error: Exception, *, interrupted: bool) -> CommandResult:
    """Print how a run ended that cannot be evaluated, and where its log is."""
    files = written(result, ())
    say(console, str(result))
    print_outcome(console, result, files)
    kept = f"its log is kept: {files[0]} (palpate view shows it)" if files else "there is no log"
    return CommandResult(
        ExitCode.INTERRUPTED if interrupted else ExitCode.UNFINISHED,
        outcome=str(result),
        facts={"ending": result.ending.value, "rest": result.rest},
        files=files,
        error=f"the measurements cannot be evaluated: {str(error) or 'out of memory'}; {kept}",
    )
