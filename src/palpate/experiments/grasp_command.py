"""`palpate grasp`: a grasp with its progress, its files and its summary on the terminal."""

from rich.console import Console

from palpate.experiments.grasp import GraspAttempt, without_spin, write_grasp
from palpate.experiments.grasp_config import GraspConfig
from palpate.experiments.grasp_plan import plan
from palpate.experiments.grasp_report import grasp_report
from palpate.experiments.output_folder import make_folder
from palpate.experiments.progress import run_progress
from palpate.experiments.run_told import INTERRUPTED, STOPPED, log_writer, tell_of
from palpate.reporting.grasp_report import grasp_table
from palpate.runtime import Ending, result_until


def run_grasp(config: GraspConfig) -> int:
    """Grasp, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        0 if the object was held and set down, 130 if the run was interrupted, else 1.

    Raises:
        InvalidValueError: The configuration cannot be realised, or the folder not be written.
        KeyboardInterrupt: While nothing had been grasped yet.
        OSError: A file cannot be written.
    """
    console = Console()
    with console.status("planning"):
        planned = plan(config)
    make_folder(config.out)
    attempt, interrupted = GraspAttempt(planned), False
    log = log_writer(planned)
    beside = None
    with run_progress(console, planned.expected_duration) as observer:
        try:
            result = attempt.run((observer,), (log,))
        except KeyboardInterrupt as interruption:
            until = result_until(interruption)
            if until is None:
                raise
            result, interrupted = until, True
            console.print(STOPPED)
    if not interrupted:
        with run_progress(console, planned.expected_duration) as observer:
            beside = without_spin(planned, (observer,))
    with console.status("working out figures, and drawing the report"):
        grasp = attempt.found(result, beside)
        files = write_grasp(grasp, config.out)
    console.print(grasp_table(grasp_report(grasp)))
    tell_of(console, result, files)
    if interrupted:
        return INTERRUPTED
    return 0 if result.ending is Ending.DONE and not grasp.dropped else 1
