"""`palpate replay`: a log through sensing, control and supervision again, with progress, verdict and report."""

import traceback
from pathlib import Path

from rich.console import Console

from palpate.commands.command_result import CommandResult, ExitCode, shown_quantities
from palpate.commands.replay.config import ReplayConfig
from palpate.commands.replay.report import (
    ending_recorded,
    ending_replayed,
    first_differences,
    quantities,
    remarks,
    replay_report,
    verdict,
    version_differences,
)
from palpate.commands.replay.run import ReplayedLog, load_controller_maker, replay_log, unchangeable
from palpate.commands.typed_values import set_options
from palpate.experiments.kit.checks import make_folder
from palpate.experiments.kit.from_log import LoggedRun
from palpate.reporting.page import WrittenReport, write_report
from palpate.reporting.report import quantity_table
from palpate.runtime import Command, Observation, Sample
from palpate.runtime.log import log_in, read_log
from palpate.runtime.progress import doing, progress_bar, say

SHOWN_EVERY = 500
"""Periods between two updates of the progress bar: a few times a second."""


def run_replay(config: ReplayConfig) -> CommandResult:
    """Replay a log, print how its commands compare, and draw the difference.

    Returns:
        How the commands differ; unfinished if nothing was changed and something differs, or if another controller
        raised an exception.

    Raises:
        InvalidValueError: If there is no log of an experiment, or if a change is impossible.
        OSError: If the log cannot be read, or if the report cannot be written.
    """
    console = Console()
    path = log_in(config.log)
    maker = None if config.controller is None else load_controller_maker(config.controller)
    folder = path.resolve().parent if config.out is None else config.out
    if config.set or maker is not None:
        make_folder(folder)  # before the work, so that nothing is lost after it
    with progress_bar(console, "reading") as bar:
        log = read_log(path, bar.show)
        kind = LoggedRun.of(log).experiment.Config
        settings = set_options(config.set, kind, unchangeable(kind))
        done, count = 0, max(len(log), 1)

        def observe(sample: Sample, now: Observation, command: Command) -> None:
            nonlocal done
            done += 1
            if done % SHOWN_EVERY == 0:
                bar.show(done / count, words="replaying")

        found = replay_log(log, settings, maker, (observe,))
    say(console, f"{path.resolve()}: {verdict(found)}")
    for remark in remarks(found):
        say(console, remark)
    if found.should_be_identical:
        if found.identical and found.sensing.first is None:
            return _result(found, ExitCode.DONE, WrittenReport((), ()))
        _explain(console, found)
    else:
        console.print(quantity_table(quantities(found)))
    make_folder(folder)
    report = _new_report_path(folder, path.resolve().stem)
    with doing(console, "drawing the report"):
        said = replay_report(found, config.controller)
        written = write_report(said, report, config.figures)
    for line in written.lines:
        say(console, line)
    wrong = found.should_be_identical or _failed(console, found) or bool(written.failures)
    return _result(found, ExitCode.UNFINISHED if wrong else ExitCode.DONE, written)


def _result(found: ReplayedLog, code: ExitCode, written: WrittenReport) -> CommandResult:
    """Return the result as metrics and facts."""
    metrics, notes = shown_quantities(quantities(found))
    differing = found.commands.first is not None or found.sensing.first is not None
    return CommandResult(
        code,
        verdict(found),
        {
            **metrics,
            "commands": found.commands.count,
            "commands_identical": found.commands.identical,
            "periods_sensed": found.sensing.count,
            "periods_sensed_alike": found.sensing.identical,
        },
        notes,
        {
            "log": found.log.path.resolve(),
            "changed": dict(found.settings),
            "other_controller": found.other_controller,
            "identical": not differing,
            "ending_recorded": ending_recorded(found),
            "ending_replayed": ending_replayed(found),
            "first_differences": first_differences(found),
            "versions_differ": version_differences(found) if found.should_be_identical and differing else (),
        },
        written.files,
        (*remarks(found), *written.warnings),
    )


def _explain(console: Console, found: ReplayedLog) -> None:
    """Print the first differences of commands and sensing, and the versions that differ."""
    for sentence in first_differences(found):
        say(console, f"Differs: {sentence}")
    others = version_differences(found)
    say(console, f"Versions: {'; '.join(others) if others else 'the same as then'}")


def _failed(console: Console, found: ReplayedLog) -> bool:
    """Whether an exception ended the replay; shows where it came from."""
    error = found.replay.result.error
    if error is None or found.replay.reached_end:
        return False
    say(console, "".join(traceback.format_exception(error)))
    return True


def _new_report_path(folder: Path, stem: str) -> Path:
    """A name that no report in the folder has: that of the log, and a number if need be."""
    path, number = folder / f"{stem}-replay.html", 1
    while path.exists():
        number += 1
        path = folder / f"{stem}-replay-{number}.html"
    return path
