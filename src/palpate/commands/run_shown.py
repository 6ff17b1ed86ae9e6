"""What is said on the terminal of a run, until it is over or interrupted."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console

from palpate.commands.progress import run_progress
from palpate.commands.say import say
from palpate.interruption import finishing, requested
from palpate.runtime import Observer, RunResult, result_until, speaks_for_itself

STOPPED = "Stopping: writing log and report (Ctrl-C again: stop without them)"
"""Said at once after a Ctrl-C."""


def run_shown(
    console: Console, expected_duration: float, run: Callable[[Observer], RunResult]
) -> tuple[RunResult, bool]:
    """Carry out a run and show how far it is; a Ctrl-C ends it, but not what is made of it afterwards.

    Args:
        console: Where.
        expected_duration: Of the run [s].
        run: Moves the robot, observed by what it is given.

    Returns:
        How it went, and whether it was interrupted.

    Raises:
        KeyboardInterrupt: Before there was anything to tell of, or for the second time.
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
    """While a run is evaluated, and its report made: say after a Ctrl-C what there is of it without them.

    Any other signal waits until both are done: a terminal may be closed at any time.

    Raises:
        KeyboardInterrupt: At a Ctrl-C, with what is to be said.
    """
    try:
        with finishing():
            yield
    except KeyboardInterrupt:
        rest = "the robot is at rest" if result.stopped else "THE ROBOT DID NOT COME TO REST"
        recording = result.recording
        path = None if recording is None else recording.path
        kept = "there is no log" if path is None else f"its log is kept: {path} (palpate view shows it)"
        raise KeyboardInterrupt(
            f"interrupted while it was evaluated, which is not finished; the run was over, {rest}; {kept}"
        ) from None


def tell_of(console: Console, result: RunResult, files: tuple[Path, ...]) -> None:
    """Say what ended the run, what became of the log, and what was written.

    The outcome has told already of an exception that speaks for itself; of any other it matters where it came
    from.
    """
    if result.error is not None and not speaks_for_itself(result.error):
        import traceback

        say(console, "".join(traceback.format_exception(result.error)))
    recording = result.recording
    if recording is not None and recording.path is not None:
        say(console, f"Log: {recording}")
    say(console, "Written: " + ", ".join(map(str, files)))
