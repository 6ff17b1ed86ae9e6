"""`palpate friction`: rubbing a surface, with its progress, its files and its summary on the terminal."""

from rich.console import Console

from palpate.experiments.friction_config import FrictionConfig
from palpate.experiments.friction_plan import plan
from palpate.experiments.friction_report import friction_report
from palpate.experiments.friction_run import Attempt, write_rubbing
from palpate.experiments.output_folder import make_folder
from palpate.experiments.progress import run_progress
from palpate.experiments.run_told import INTERRUPTED, log_writer, tell_of
from palpate.reporting.friction_report import friction_table
from palpate.runtime import Ending, result_until


def run_friction(config: FrictionConfig) -> int:
    """Rub, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        0 if it finished, a surface that never slipped included; 130 if it was interrupted, else 1.

    Raises:
        InvalidValueError: The configuration cannot be realised, or the folder not be written.
        OSError: A file cannot be written.
    """
    console = Console()
    with console.status("planning"):
        planned = plan(config)
    attempt, interrupted = Attempt(planned), False
    make_folder(config.out)
    log = log_writer(planned)
    with run_progress(console, planned.expected_duration) as observer:
        try:
            result = attempt.run((observer,), (log,))
        except KeyboardInterrupt as interruption:
            until = result_until(interruption)
            if until is None:
                raise
            result, interrupted = until, True
    with console.status("evaluating"):
        rubbing = attempt.found(result)
    with console.status("drawing the report"):
        files = write_rubbing(rubbing, config.out)
    console.print(friction_table(friction_report(rubbing)))
    if rubbing.recognised is not None:
        console.print(rubbing.recognised.words, highlight=False, markup=False)
    tell_of(console, result, files)
    if interrupted:
        return INTERRUPTED
    return 0 if result.ending is Ending.DONE else 1
