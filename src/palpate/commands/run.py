"""`palpate EXPERIMENT`: a run with its progress, its files and its summary on the terminal."""

from dataclasses import replace
from typing import Any

from rich.console import Console

from palpate.commands.command_result import CommandResult, ExitCode, report_answer
from palpate.commands.earlier_run import earlier_told
from palpate.commands.progress import doing, run_progress
from palpate.commands.run_shown import kept_if_interrupted, run_shown, tell_of
from palpate.commands.say import say
from palpate.errors import InvalidValueError
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.figure import figures_of
from palpate.experiments.kit.output_folder import make_folder
from palpate.experiments.kit.recorded_run import Recorded, RecordedRun
from palpate.experiments.kit.recording import log_writer, write_result, written
from palpate.experiments.kit.registry import reference_to
from palpate.experiments.kit.repeat_words import repeat_commands
from palpate.experiments.kit.script import plan_for
from palpate.interruption import requested
from palpate.reporting.terminal import key_figures
from palpate.robots.drivers import check_drivers
from palpate.runtime import Ending, RunResult, result_until

SECOND_STOPPED = (
    "Stopping: the report is of the first run alone, and is being written (Ctrl-C again: stop without it)"
)
"""Said at once after a Ctrl-C in the second run."""


def run_experiment(experiment: Experiment, config: Any) -> CommandResult:
    """Prepare, run, record, write the files and print the summary, also after a Ctrl-C.

    Args:
        experiment: What to do.
        config: How; an instance of its `Config`.

    Returns:
        What was found; it is done if the run finished and came to what it was for.

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
        check_drivers(plan.robot)
    expected = plan.dry_run()
    make_folder(config.out)
    notes = (*earlier_told(console, config.out, experiment.name, expected.files), *expected.notes)
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
        with doing(console, "working out what was found"):
            try:
                found = experiment.found(plan, run.recorded(result, companion, lambda step: say(console, step)))
            except InvalidValueError as error:  # wrong is what was felt, not what was typed
                return replace(_untold(console, result, error, interrupted=interrupted), warnings=notes)
        report = experiment.report(found)
        report = replace(report, repeat=repeat_commands(reference_to(experiment), config, result))
        with doing(console, "drawing the report"):
            files = write_result(experiment, found, report, config.out)
    console.print(key_figures(report.title, report.outcome, report.all_figures))
    tell_of(console, result, files)
    code = ExitCode.DONE if result.ending is Ending.DONE and report.reached else ExitCode.UNFINISHED
    answer = report_answer(
        ExitCode.INTERRUPTED if interrupted or requested() is not None else code,
        report.outcome,
        figures_of(experiment, found),
        report.all_figures,
        written(result, files),
        ending=result.ending.value,
    )
    return replace(answer, warnings=notes)


def _companion(console: Console, plan: Plan) -> tuple[Recorded | None, bool]:
    """Run what the first run is to be compared with; None, and that it was interrupted, after a Ctrl-C."""
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


def _untold(console: Console, result: RunResult, error: InvalidValueError, *, interrupted: bool) -> CommandResult:
    """Say how a run went that tells nothing, and what is kept of it: its log."""
    files = written(result, ())
    say(console, str(result))
    tell_of(console, result, files)
    kept = f"its log is kept: {files[0]} (palpate view shows it)" if files else "there is no log"
    return CommandResult(
        ExitCode.INTERRUPTED if interrupted else ExitCode.UNFINISHED,
        outcome=str(result),
        facts={"ending": result.ending.value},
        files=files,
        error=f"what was felt tells nothing: {error}; {kept}",
    )
