"""`palpate friction`: rubbing a surface, with its progress, its files and its summary on the terminal."""

from dataclasses import replace

from rich.console import Console

from palpate.commands.answer import Answer, ExitCode, report_answer
from palpate.commands.earlier_run import earlier_told
from palpate.commands.output_folder import make_folder
from palpate.commands.progress import doing
from palpate.commands.run_told import kept_if_interrupted, log_writer, run_shown, tell_of, written
from palpate.commands.said import say
from palpate.commands.sweep.rubbed import figures_of
from palpate.errors import InvalidValueError
from palpate.experiments.friction.config import FrictionConfig
from palpate.experiments.friction.dry import FILES
from palpate.experiments.friction.library import library_of
from palpate.experiments.friction.plan import plan
from palpate.experiments.friction.report import friction_report
from palpate.experiments.friction.report_page import friction_table
from palpate.experiments.friction.run import Attempt, write_rubbing
from palpate.robots.drivers import check_drivers
from palpate.runtime import Ending, RunResult


def run_friction(config: FrictionConfig) -> Answer:
    """Rub, record, write the files and print the summary, also after a Ctrl-C.

    Returns:
        What was found; it is done if it finished, a surface that never slipped included. If the strokes tell
        nothing, as of a robot that did not move, where the log is.

    Raises:
        InvalidValueError: The configuration cannot be realised, or the folder not be written; nothing moved.
        KeyboardInterrupt: While nothing had been rubbed yet, or while the report was made.
        OSError: A file cannot be written.
    """
    console = Console()
    library_of(config)  # a library that cannot be read is refused before anything is built
    with doing(console, "planning"):
        planned = plan(config)
    check_drivers(config.robot)
    attempt = Attempt(planned)
    make_folder(config.out)
    notes = earlier_told(console, config.out, "friction", FILES)
    log = log_writer(planned)
    result, interrupted = run_shown(
        console, planned.expected_duration, lambda observer: attempt.run((observer,), (log,))
    )
    with kept_if_interrupted(result):
        try:
            with doing(console, "evaluating"):
                rubbing = attempt.found(result)
        except InvalidValueError as error:  # wrong is what was felt, not what was typed
            return replace(_untold(console, result, error, interrupted=interrupted), warnings=notes)
        with doing(console, "drawing the report"):
            files = write_rubbing(rubbing, config.out)
    report = friction_report(rubbing)
    console.print(friction_table(report))
    if report.recognition is not None:
        say(console, report.recognition.words)
    tell_of(console, result, files)
    code = ExitCode.DONE if result.ending is Ending.DONE else ExitCode.UNFINISHED
    answer = report_answer(
        ExitCode.INTERRUPTED if interrupted else code,
        report.outcome,
        figures_of(rubbing),
        report.summary,
        written(result, files),
        ending=result.ending.value,
        recognition=None if report.recognition is None else report.recognition.words,
    )
    return replace(answer, warnings=notes)


def _untold(console: Console, result: RunResult, error: InvalidValueError, *, interrupted: bool) -> Answer:
    """Say how a run went whose strokes tell nothing, and what is kept of it: its log."""
    files = written(result, ())
    say(console, str(result))
    tell_of(console, result, files)
    kept = f"its log is kept: {files[0]} (palpate view shows it)" if files else "there is no log"
    return Answer(
        ExitCode.INTERRUPTED if interrupted else ExitCode.UNFINISHED,
        outcome=str(result),
        facts={"ending": result.ending.value},
        files=files,
        error=f"what was rubbed tells of no friction: {error}; {kept}",
    )
