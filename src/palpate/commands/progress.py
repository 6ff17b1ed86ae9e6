"""Progress of long work: bars on a terminal, lines where the output is captured."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager

from rich.console import Console

from palpate.commands.say import say
from palpate.runtime import Command, Observation, Observer, Sample
from palpate.runtime.progress_bar import progress_bar, run_bar

LINE_INTERVAL = 10.0
"""Wall time between two lines of a run [s], where the output is captured: CI takes longer silence for a hang."""

STEPS = "step {task.completed:.0f} of {task.total:.0f}"


def lively(console: Console) -> bool:
    """Return whether bars can be drawn: on a terminal, not in a file that FORCE_COLOR merely colours."""
    return console.is_terminal and console.file.isatty()


@contextmanager
def doing(console: Console, what: str) -> Iterator[None]:
    """Show what is being done: a transient status on a terminal, a line elsewhere."""
    if lively(console):
        with console.status(what):
            yield
    else:
        say(console, what)
        yield


def run_progress(console: Console, expected_duration: float) -> AbstractContextManager[Observer]:
    """Show the progress of a run of about `expected_duration` [s]; yields the observer that updates it."""
    return (_run_bar if lively(console) else _run_lines)(console, expected_duration)


@contextmanager
def _run_lines(console: Console, expected_duration: float) -> Iterator[Observer]:
    shown = time.perf_counter()
    say(console, f"running, about {expected_duration:.0f} s on the robot's clock")

    def observe(sample: Sample, now: Observation, command: Command) -> None:
        nonlocal shown
        wall = time.perf_counter()
        if wall - shown > LINE_INTERVAL:
            shown = wall
            as_expected = now.time <= expected_duration
            goal = f" of about {expected_duration:.0f} s" if as_expected else " s, longer than expected,"
            say(console, f"{now.time:.0f}{goal} on the robot's clock, {command.phase.value}")

    yield observe


@contextmanager
def _run_bar(console: Console, expected_duration: float) -> Iterator[Observer]:
    with run_bar(console, expected_duration) as bar:

        def observe(sample: Sample, now: Observation, command: Command) -> None:
            bar.show(min(now.time, expected_duration), words=command.phase.value)

        yield observe


@contextmanager
def step_progress(console: Console, steps: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """Show which of some steps is in progress; yields the function to call with each step's name at its start."""
    if not lively(console):
        yield lambda step: say(console, step)
        return
    with progress_bar(console, "", len(steps), STEPS) as bar:
        yield lambda step: bar.show(steps.index(step) + 1, words=step)
