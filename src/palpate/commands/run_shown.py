"""A run on the terminal: its progress, Ctrl-C, and what is printed at its end."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from palpate.experiments.kit.experiment import Plan
from palpate.experiments.kit.recording import tell_log
from palpate.interruption import finishing, requested
from palpate.runtime import Observer, RunResult, result_until, speaks_for_itself
from palpate.runtime.log.standard.cloud import Cloud
from palpate.runtime.progress import run_progress, say

STOPPED = "Stopping: writing log and report (Ctrl-C again: stop without them)"
"""Printed immediately after Ctrl-C."""


def run_shown(
    console: Console, expected_duration: float, run: Callable[[Observer], RunResult]
) -> tuple[RunResult, bool]:
    """Carry out a run and show its progress; Ctrl-C ends the run, but not its evaluation.

    Args:
        console: Output.
        expected_duration: Of the run [s].
        run: Moves the robot, with the observer that it is given.

    Returns:
        The result of the run, and whether it was interrupted.

    Raises:
        KeyboardInterrupt: Ctrl-C before the run had begun, or a second one.
    """
    if requested() is not None:  # and an extension module has swallowed it: nothing moves
        raise KeyboardInterrupt
    with run_progress(console, expected_duration) as observer:
        try:
            return run(observer), False
        except KeyboardInterrupt as interruption:
            until = result_until(interruption)
            if until is None:
                raise
            say(console, STOPPED)
            return until, True


@contextmanager
def kept_if_interrupted(result: RunResult) -> Iterator[None]:
    """Turn Ctrl-C during the evaluation of a run into a message that names its log.

    Any other signal waits until both are done: a terminal may be closed at any time.

    Raises:
        KeyboardInterrupt: Ctrl-C, with that message.
    """
    try:
        with finishing():
            yield
    except KeyboardInterrupt:
        recording = result.recording
        path = None if recording is None else recording.path
        kept = "there is no log" if path is None else f"its log is kept: {path} (palpate view shows it)"
        raise KeyboardInterrupt(
            f"interrupted while the run was evaluated, not finished; the run was over, {result.rest}; {kept}"
        ) from None


def tell(console: Console, plan: Plan, result: RunResult, cloud: Cloud | None = None) -> None:
    """Add topics that other tools read to the log of a run; where that fails, print why: the log is as it was."""
    try:
        tell_log(plan, result, cloud)
    except OSError as error:
        reason = error.strerror or str(error)
        say(console, f"The log has no topics for other tools: {reason}; `palpate log ros2` makes them of any log")


def print_outcome(console: Console, result: RunResult, files: tuple[Path, ...]) -> None:
    """Print what ended the run, its log, and the files that were written.

    The traceback is printed only for an exception that the outcome does not explain.
    """
    if result.error is not None and not speaks_for_itself(result.error):
        import traceback

        say(console, "".join(traceback.format_exception(result.error)))
    recording = result.recording
    if recording is not None and recording.path is not None:
        say(console, f"Log: {recording}")
    say(console, "Written: " + ", ".join(map(str, files)))
