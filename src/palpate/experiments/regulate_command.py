"""`palpate regulate`: a regulation of force with its progress, its files and its summary on the terminal."""

from rich.console import Console

from palpate.experiments.output_folder import make_folder
from palpate.experiments.progress import run_progress
from palpate.experiments.regulate import Attempt, prepared, write_regulation
from palpate.experiments.regulate_config import RegulateConfig
from palpate.experiments.regulate_plan import plan
from palpate.experiments.regulate_report import regulation_report
from palpate.experiments.run_told import INTERRUPTED, STOPPED, log_writer, tell_of
from palpate.reporting.regulation_report import regulation_table
from palpate.runtime import Ending, result_until


def run_regulate(config: RegulateConfig) -> int:
    """Press first if asked to, regulate, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        0 if the regulation finished, 130 if it was interrupted, else 1.

    Raises:
        InvalidValueError: The configuration cannot be realised, pressing has found nothing, or the folder not be
            written.
        KeyboardInterrupt: While it pressed, before the regulation had begun: there is nothing to write yet.
        OSError: A file cannot be written.
    """
    console = Console()
    with console.status("planning"):
        planned = plan(config)
    make_folder(config.out)
    with console.status("pressing, to find stiffness and delay"):
        planned, found = prepared(planned)
    attempt, interrupted = Attempt(planned, found), False
    log = log_writer(planned)
    with run_progress(console, planned.expected_duration) as observer:
        try:
            result = attempt.run((observer,), (log,))
        except KeyboardInterrupt as interruption:
            until = result_until(interruption)
            if until is None:
                raise
            result, interrupted = until, True
            console.print(STOPPED)
    with console.status("working out figures, and drawing the report"):
        regulation = attempt.found(result)
        files = write_regulation(regulation, config.out)
    console.print(regulation_table(regulation_report(regulation)))
    tell_of(console, result, files)
    if interrupted:
        return INTERRUPTED
    return 0 if result.ending is Ending.DONE else 1
