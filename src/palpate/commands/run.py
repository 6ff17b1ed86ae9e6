"""`palpate EXPERIMENT`: a run with its progress, its files and its summary on the terminal; and its --dry-run."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from mcap.opcode import Opcode
from rich.console import Console

from palpate.bounded_file import open_regular
from palpate.commands.command_result import CommandResult, ExitCode, shown_quantities
from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import check_folder, make_folder
from palpate.experiments.kit.config_file import EXPERIMENT_TEXT, experiment_in
from palpate.experiments.kit.experiment import Experiment, Plan
from palpate.experiments.kit.metric import metric_notes, metrics_of
from palpate.experiments.kit.recorded_run import Recorded, RecordedRun
from palpate.experiments.kit.recording import REPORT_FILE, log_writer, tell_log, write_result, written
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.run_report import run_report
from palpate.experiments.kit.script import plan_for
from palpate.extras import MissingLibraryError
from palpate.interruption import finishing, requested
from palpate.open_kinds import name_of_kind
from palpate.reporting.data import FigureKind, Quantity
from palpate.reporting.report import quantity_table
from palpate.robots.robot import Robot
from palpate.robots.robot_kind import RobotKind
from palpate.runtime import Observer, RunResult, result_until, speaks_for_itself
from palpate.runtime.log import log_in
from palpate.runtime.log.mcap_walk import DamageError, McapWalk, attachment_of
from palpate.runtime.log.standard.cloud import Cloud
from palpate.runtime.progress import doing, run_progress, say

SWEEP_FILE = "sweep.json"
"""File that marks the folder of a sweep."""


def earlier_run(folder: Path, command: str, names: Sequence[str]) -> tuple[str, ...]:
    """Return which files of an earlier run will be overwritten.

    Args:
        folder: Output folder; need not exist.
        command: Command of the new run, as typed after `palpate`.
        names: Names of the files that the new run writes besides report and log.

    Returns:
        One sentence, or none if nothing is overwritten.

    Raises:
        InvalidValueError: If the folder holds a run of another command, of which a part would remain.
    """
    before, log = _command_in(folder)
    if before is not None and before != command:
        raise InvalidValueError(
            f"out = {folder}: holds a run of `palpate {before}`, which would be partly overwritten; choose "
            "another folder (--out)"
        )
    there = [folder / name for name in (REPORT_FILE, *names) if (folder / name).is_file()]
    if not there:
        return ()
    more = len(there) - 1
    others = f" and {more} more file{'s' if more > 1 else ''}" if more else ""
    of = "" if before is None else " of an earlier run"
    stays = "; its log stays" if log else ""
    return (f"{there[0]}{others}{of} {'are' if more else 'is'} overwritten{stays}.",)


def print_earlier_run(console: Console, folder: Path, command: str, names: Sequence[str]) -> tuple[str, ...]:
    """Print the note of `earlier_run`, and return it."""
    notes = earlier_run(folder, command, names)
    for text in notes:
        say(console, f"Note: {text}")
    return notes


def _command_in(folder: Path) -> tuple[str | None, bool]:
    """Return which command wrote to a folder, None if unknown, and whether its log is there."""
    if not folder.is_dir():
        return None, False
    if (folder / SWEEP_FILE).is_file():
        return "sweep", False
    try:
        return _experiment_of(log_in(folder)), True
    except (InvalidValueError, DamageError, OSError):  # no log, or an unreadable one
        return None, False


def _experiment_of(path: Path) -> str | None:
    """Return the experiment of a log from its beginning alone: the whole file may be gigabytes."""
    with open_regular(path) as file:
        for record in McapWalk(file).records():
            if record.opcode == Opcode.CHUNK:
                break
            if record.opcode == Opcode.ATTACHMENT:
                found = attachment_of(record)
                if found.name == EXPERIMENT_TEXT:
                    return experiment_named(experiment_in(found.data.decode())).name
    return None


LOG_FILE = "<date>_<time>.mcap"
"""Name of the log; `latest.mcap` is a link to it."""


def dry_run_experiment(experiment: Experiment, config: Any) -> CommandResult:
    """Plan a run and print its preview.

    Raises:
        InvalidValueError: If the run cannot be realised, or if the folder cannot be written or holds the run of
            another command.
    """
    plan = plan_for(experiment, config)
    if plan.robot is None:
        plan.backend()  # building refuses what cannot be simulated; nothing moves before start()
    plan.controller()  # a wrong factory fails here, not in the run
    would = plan.dry_run()
    check_folder(config.out)
    warnings = (*would.notes, *earlier_run(config.out, experiment.name, would.files))
    robot = "the simulation alone" if plan.robot is None else _robot_text(config.robot, plan.robot)
    files = tuple(config.out / name for name in (REPORT_FILE, *would.files, LOG_FILE))
    outcome = "Everything is in order: nothing was moved, nothing was written."
    if plan.preparation:
        warnings = (f"Before that: {plan.preparation}.", *warnings)
    console = Console()
    metrics = (Quantity("robot", "", "", robot), *would.metrics)
    console.print(quantity_table(metrics, f"{would.task} (dry run)", outcome))
    for warning in warnings:
        say(console, f"Note: {warning}")
    say(console, f"Would be written: {', '.join(map(str, files))}")
    values, notes = shown_quantities(would.metrics)
    facts = {"dry_run": True, "task": would.task, "robot": robot}
    return CommandResult(ExitCode.DONE, outcome, values, notes, facts, files, warnings)


def _robot_text(name: str, robot: Robot) -> str:
    """Return the robot as text, with a remark that no device was connected."""
    backend = robot.file.backend
    real = "; its devices were not connected to" if backend.REAL else ""
    return f"{name} ({name_of_kind(backend)}){real}{_lacking(backend)}"


def _lacking(backend: RobotKind) -> str:
    try:
        backend.check_drivers()
    except MissingLibraryError:
        return "; not to be run on this computer, which lacks a client library of its devices"
    return ""


STOPPING_TEXT = "Stopping: writing log and report (Ctrl-C again: stop without them)"
"""Printed immediately after Ctrl-C."""


def run_shown(
    console: Console, expected_duration: float, run: Callable[[Observer], RunResult]
) -> tuple[RunResult, bool]:
    """Carry out a run and show its progress; Ctrl-C ends the run, but not its evaluation.

    Args:
        console: Output.
        expected_duration: Expected duration of the run [s].
        run: Function that carries out the run with an observer.

    Returns:
        The result of the run, and whether it was interrupted.

    Raises:
        KeyboardInterrupt: On Ctrl-C before the run begins, and on a second one.
    """
    if requested() is not None:  # and an extension module has swallowed it: nothing moves
        raise KeyboardInterrupt
    with run_progress(console, expected_duration) as observer:
        try:
            return run(observer), False
        except KeyboardInterrupt as interruption:
            until = result_until(interruption)
            if until is None:
                raise
            say(console, STOPPING_TEXT)
            return until, True


@contextmanager
def kept_if_interrupted(result: RunResult) -> Iterator[None]:
    """Turn Ctrl-C during the evaluation of a run into a message that names its log.

    Any other signal waits until both are done: a terminal may be closed at any time.

    Raises:
        KeyboardInterrupt: Ctrl-C, with that message.
    """
    try:
        with finishing():
            yield
    except KeyboardInterrupt:
        recording = result.recording
        path = None if recording is None else recording.path
        kept = "there is no log" if path is None else f"its log is kept: {path} (palpate view shows it)"
        raise KeyboardInterrupt(
            f"interrupted while the run was evaluated, not finished; the run was over, {result.rest}; {kept}"
        ) from None


def tell(console: Console, plan: Plan, result: RunResult, cloud: Cloud | None = None) -> None:
    """Add topics that other tools read to the log of a run; where that fails, print why: the log is as it was."""
    try:
        tell_log(plan, result, cloud)
    except OSError as error:
        reason = error.strerror or str(error)
        say(console, f"The log has no topics for other tools: {reason}; `palpate log ros2` makes them of any log")


def print_outcome(console: Console, result: RunResult, files: tuple[Path, ...]) -> None:
    """Print what ended the run, its log, and the files that were written.

    The traceback is printed only for an exception that the outcome does not explain.
    """
    if result.error is not None and not speaks_for_itself(result.error):
        import traceback

        say(console, "".join(traceback.format_exception(result.error)))
    recording = result.recording
    if recording is not None and recording.path is not None:
        say(console, f"Log: {recording}")
    say(console, "Written: " + ", ".join(map(str, files)))


SECOND_STOPPING_TEXT = (
    "Stopping: the report is of the first run alone, and is being written (Ctrl-C again: stop without it)"
)
"""Printed immediately after Ctrl-C in the second run."""

UNUSABLE_ERRORS = (InvalidValueError, MemoryError, ImportError)
"""Exceptions after a run whose measurements cannot be evaluated, or when memory runs out; the log is kept."""


def run_experiment(experiment: Experiment, config: Any, figures: FigureKind | None = None) -> CommandResult:
    """Prepare, run, record, write the files and print the summary, also after a Ctrl-C.

    Args:
        experiment: Experiment to carry out.
        config: Configuration, an instance of its `Config`.
        figures: Kind of files in which the figures are written, too; None for none.

    Returns:
        The result; done if the run finished and reached its goal.

    Raises:
        InvalidValueError: If the configuration cannot be realised, the preparation fails, or the folder cannot be
            written; nothing is left behind.
        MissingLibraryError: If this computer lacks the robot's client library.
        KeyboardInterrupt: On Ctrl-C before the run begins, or while the report is made.
        OSError: If a file cannot be written.
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
                drawn = write_result(experiment, found, report, config.out, figures)
            tell(console, plan, result, experiment.cloud(found))
        except UNUSABLE_ERRORS as error:
            tell(console, plan, result)
            return replace(_unusable_result(console, result, error, interrupted=interrupted), warnings=notes)
    console.print(quantity_table(report.all_metrics, report.title, report.outcome))
    for failure in drawn.warnings:
        say(console, failure)
    print_outcome(console, result, drawn.files)
    code = ExitCode.DONE if result.done and report.reached and not drawn.failures else ExitCode.UNFINISHED
    tables, table_notes = shown_quantities(report.section_quantities)
    return CommandResult(
        ExitCode.INTERRUPTED if interrupted or requested() is not None else code,
        report.outcome,
        metrics_of(experiment, found),
        {**table_notes, **metric_notes(experiment.metrics, found)},
        {"ending": result.ending.value, "rest": result.rest, "tables": tables},
        written(result, drawn.files),
        (*notes, *drawn.warnings),
    )


def _companion(console: Console, plan: Plan) -> tuple[Recorded | None, bool]:
    """Run the companion of the first run; return its record, and whether Ctrl-C interrupted it."""
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
        say(console, SECOND_STOPPING_TEXT)
        return None, True


def _unusable_result(console: Console, result: RunResult, error: Exception, *, interrupted: bool) -> CommandResult:
    """Print the ending of a run that cannot be evaluated, and the path of its log."""
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
