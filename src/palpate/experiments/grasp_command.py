"""`palpate grasp`: a grasp with its progress, its files and its summary on the terminal."""

from rich.console import Console

from palpate.experiments.grasp import Grasp, GraspAttempt, without_spin, write_grasp
from palpate.experiments.grasp_config import GraspConfig
from palpate.experiments.grasp_foretold import foretold
from palpate.experiments.grasp_plan import GraspPlan, plan
from palpate.experiments.grasp_report import grasp_report
from palpate.experiments.output_folder import make_folder
from palpate.experiments.progress import doing, run_progress
from palpate.experiments.run_told import INTERRUPTED, kept_if_interrupted, log_writer, run_shown, tell_of
from palpate.reporting.grasp_report import grasp_table
from palpate.runtime import Ending, result_until


def run_grasp(config: GraspConfig) -> int:
    """Grasp, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        0 if the object was held and set down, 130 if the run was interrupted, else 1.

    Raises:
        InvalidValueError: The configuration cannot be realised, or the folder not be written.
        KeyboardInterrupt: While nothing had been grasped yet, or while the report was made.
        OSError: A file cannot be written.
    """
    console = Console()
    with doing(console, "planning"):
        planned = plan(config)
    make_folder(config.out)
    for text in foretold(planned):
        console.print(text, markup=False, highlight=False)
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
    console.print(grasp_table(grasp_report(grasp)))
    tell_of(console, result, files)
    if interrupted:
        return INTERRUPTED
    return 0 if result.ending is Ending.DONE and not grasp.dropped else 1


def _beside(console: Console, planned: GraspPlan) -> tuple[Grasp | None, bool]:
    """Do it again with a control that ignores spin; None, and that it was interrupted, after a Ctrl-C."""
    try:
        with run_progress(console, planned.expected_duration) as observer:
            return without_spin(planned, (observer,)), False
    except KeyboardInterrupt as interruption:
        if result_until(interruption) is None:
            raise
        console.print(
            "Stopping: the report is of the first run alone, and is being written (Ctrl-C again leaves it)"
        )
        return None, True
