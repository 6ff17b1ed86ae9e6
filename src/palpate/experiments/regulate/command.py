"""`palpate regulate`: a regulation of force with its progress, its files and its summary on the terminal."""

from contextlib import nullcontext
from dataclasses import replace

from rich.console import Console

from palpate.commands.answer import Answer, ExitCode, report_answer
from palpate.commands.earlier_run import earlier_told
from palpate.commands.output_folder import make_folder
from palpate.commands.progress import doing
from palpate.commands.run_told import kept_if_interrupted, log_writer, run_shown, tell_of, written
from palpate.commands.sweep.regulated import figures_of
from palpate.experiments.regulate.config import RegulateConfig
from palpate.experiments.regulate.dry import FILES
from palpate.experiments.regulate.plan import plan
from palpate.experiments.regulate.report import regulation_report
from palpate.experiments.regulate.report_page import regulation_table
from palpate.experiments.regulate.run import Attempt, prepared, write_regulation
from palpate.robots.drivers import check_drivers
from palpate.runtime import Ending


def run_regulate(config: RegulateConfig) -> Answer:
    """Press first if asked to, regulate, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        What was found; it is done if the regulation finished.

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
    check_drivers(config.robot)
    make_folder(config.out)
    notes = earlier_told(console, config.out, "regulate", FILES)
    with doing(console, "pressing, to find stiffness and delay") if config.identify else nullcontext():
        planned, found = prepared(planned)
    attempt = Attempt(planned, found)
    log = log_writer(planned)
    result, interrupted = run_shown(
        console, planned.expected_duration, lambda observer: attempt.run((observer,), (log,))
    )
    with kept_if_interrupted(result), doing(console, "working out figures, and drawing the report"):
        regulation = attempt.found(result)
        files = write_regulation(regulation, config.out)
    report = regulation_report(regulation)
    console.print(regulation_table(report))
    tell_of(console, result, files)
    code = ExitCode.DONE if result.ending is Ending.DONE else ExitCode.UNFINISHED
    answer = report_answer(
        ExitCode.INTERRUPTED if interrupted else code,
        report.outcome,
        figures_of(regulation),
        (*report.summary, *report.margins),
        written(result, files),
        ending=result.ending.value,
    )
    return replace(answer, warnings=notes)
