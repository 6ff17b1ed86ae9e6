"""`palpate regulate`: a regulation of force with its progress, its files and its summary on the terminal."""

from rich.console import Console

from palpate.experiments.output_folder import make_folder
from palpate.experiments.progress import doing
from palpate.experiments.regulate import Attempt, prepared, write_regulation
from palpate.experiments.regulate_config import RegulateConfig
from palpate.experiments.regulate_plan import plan
from palpate.experiments.regulate_report import regulation_report
from palpate.experiments.run_told import INTERRUPTED, kept_if_interrupted, log_writer, run_shown, tell_of
from palpate.reporting.regulation_report import regulation_table
from palpate.runtime import Ending


def run_regulate(config: RegulateConfig) -> int:
    """Press first if asked to, regulate, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        0 if the regulation finished, 130 if it was interrupted, else 1.

    Raises:
        InvalidValueError: The configuration cannot be realised, pressing has found nothing, or the folder not be
            written.
        KeyboardInterrupt: While it pressed, before the regulation had begun: there is nothing to write yet; or
            while the report was made.
        OSError: A file cannot be written.
    """
    console = Console()
    with doing(console, "planning"):
        planned = plan(config)
    make_folder(config.out)
    with doing(console, "pressing, to find stiffness and delay"):
        planned, found = prepared(planned)
    attempt = Attempt(planned, found)
    log = log_writer(planned)
    result, interrupted = run_shown(
        console, planned.expected_duration, lambda observer: attempt.run((observer,), (log,))
    )
    with kept_if_interrupted(result), doing(console, "working out figures, and drawing the report"):
        regulation = attempt.found(result)
        files = write_regulation(regulation, config.out)
    console.print(regulation_table(regulation_report(regulation)))
    tell_of(console, result, files)
    if interrupted:
        return INTERRUPTED
    return 0 if result.ending is Ending.DONE else 1
