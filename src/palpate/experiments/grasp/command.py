"""`palpate grasp`: a grasp with its progress, its files and its summary on the terminal."""

from dataclasses import replace

from rich.console import Console

from palpate.commands.answer import Answer, ExitCode, report_answer
from palpate.commands.earlier_run import earlier_told
from palpate.commands.progress import doing, run_progress
from palpate.commands.run_told import kept_if_interrupted, log_writer, run_shown, tell_of, written
from palpate.commands.said import say
from palpate.commands.sweep.grasped import figures_of
from palpate.experiments.grasp.config import GraspConfig
from palpate.experiments.grasp.dry import FILES
from palpate.experiments.grasp.foretold import foretold
from palpate.experiments.grasp.plan import GraspPlan, plan
from palpate.experiments.grasp.report import grasp_report
from palpate.experiments.grasp.report_page import grasp_table
from palpate.experiments.grasp.run import Grasp, GraspAttempt, without_spin, write_grasp
from palpate.experiments.kit.output_folder import make_folder
from palpate.robots.drivers import check_drivers
from palpate.runtime import Ending, result_until

STOPPED_BESIDE = (
    "Stopping: the report is of the first run alone, and is being written (Ctrl-C again: stop without it)"
)
"""Said at once after a Ctrl-C in the second run."""


def run_grasp(config: GraspConfig) -> Answer:
    """Grasp, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        How it went; it is done if the object was held and set down.

    Raises:
        InvalidValueError: The configuration cannot be realised, or the folder not be written.
        KeyboardInterrupt: While nothing had been grasped yet, or while the report was made.
        OSError: A file cannot be written.
    """
    console = Console()
    with doing(console, "planning"):
        planned = plan(config)
    check_drivers(config.robot)
    make_folder(config.out)
    notes = earlier_told(console, config.out, "grasp", FILES)
    warnings = foretold(planned)
    for text in warnings:
        say(console, text)
    attempt, beside = GraspAttempt(planned), None
    log = log_writer(planned)
    result, interrupted = run_shown(
        console, planned.expected_duration, lambda observer: attempt.run((observer,), (log,))
    )
    with kept_if_interrupted(result):
        if config.against_ignoring_spin and not interrupted:
            beside, interrupted = _beside(console, planned)
        with doing(console, "working out figures, and drawing the report"):
            grasp = attempt.found(result, beside)
            files = write_grasp(grasp, config.out)
    report = grasp_report(grasp)
    console.print(grasp_table(report))
    tell_of(console, result, files)
    held = result.ending is Ending.DONE and not grasp.dropped
    code = ExitCode.DONE if held else ExitCode.UNFINISHED
    answer = report_answer(
        ExitCode.INTERRUPTED if interrupted else code,
        report.outcome,
        figures_of(grasp),
        report.summary,
        written(result, files),
        ending=result.ending.value,
        ignoring_spin=None if beside is None else figures_of(beside),
    )
    return replace(answer, warnings=(*notes, *warnings))


def _beside(console: Console, planned: GraspPlan) -> tuple[Grasp | None, bool]:
    """Do it again with a control that ignores spin; None, and that it was interrupted, after a Ctrl-C."""
    try:
        with run_progress(console, planned.expected_duration) as observer:
            return without_spin(planned, (observer,)), False
    except KeyboardInterrupt as interruption:
        if result_until(interruption) is None:
            raise
        say(console, STOPPED_BESIDE)
        return None, True
