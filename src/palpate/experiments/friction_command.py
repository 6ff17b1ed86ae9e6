"""`palpate friction`: rubbing a surface, with its progress, its files and its summary on the terminal."""

from rich.console import Console

from palpate.experiments.friction_config import FrictionConfig
from palpate.experiments.friction_library import library_of
from palpate.experiments.friction_plan import plan
from palpate.experiments.friction_report import friction_report
from palpate.experiments.friction_run import Attempt, write_rubbing
from palpate.experiments.output_folder import make_folder
from palpate.experiments.progress import doing
from palpate.experiments.run_told import INTERRUPTED, kept_if_interrupted, log_writer, run_shown, tell_of
from palpate.reporting.friction_report import friction_table
from palpate.runtime import Ending


def run_friction(config: FrictionConfig) -> int:
    """Rub, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        0 if it finished, a surface that never slipped included; 130 if it was interrupted, else 1.

    Raises:
        InvalidValueError: The configuration cannot be realised, or the folder not be written.
        KeyboardInterrupt: While nothing had been rubbed yet, or while the report was made.
        OSError: A file cannot be written.
    """
    console = Console()
    library_of(config)  # a library that cannot be read is refused before anything is built
    with doing(console, "planning"):
        planned = plan(config)
    attempt = Attempt(planned)
    make_folder(config.out)
    log = log_writer(planned)
    result, interrupted = run_shown(
        console, planned.expected_duration, lambda observer: attempt.run((observer,), (log,))
    )
    with kept_if_interrupted(result):
        with doing(console, "evaluating"):
            rubbing = attempt.found(result)
        with doing(console, "drawing the report"):
            files = write_rubbing(rubbing, config.out)
    report = friction_report(rubbing)
    console.print(friction_table(report))
    if report.recognition is not None:
        console.print(report.recognition.words, highlight=False, markup=False)
    tell_of(console, result, files)
    if interrupted:
        return INTERRUPTED
    return 0 if result.ending is Ending.DONE else 1
