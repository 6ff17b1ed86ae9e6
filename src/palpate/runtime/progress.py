"""Lines and progress bars for long work: bars on a terminal or in a notebook, lines where output is captured."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from palpate.plain_text import inert
from palpate.runtime.data import Command, Observation, Sample
from palpate.runtime.loop import Observer

LINE_INTERVAL = 10.0
"""Wall time between two lines of a run [s], where output is captured: CI takes longer silence for a hang."""

COUNT = "{task.completed:.0f}/{task.total}"
"""Amount of work that is counted, as `progress_bar` takes it."""

_REFRESH_INTERVAL = 0.1
"""Wall time between two updates of a bar [s]; a change of its words is shown at once."""


def say(console: Console, text: str) -> None:
    """Print a text in one line, without interpreting markup.

    A closed pipe, upon which rich exits, must end neither run nor report, and is ignored.
    """
    with suppress(OSError, SystemExit):
        console.print(inert(text), highlight=False, markup=False, soft_wrap=True)


def lively(console: Console) -> bool:
    """Return whether bars can be drawn: not in a file that FORCE_COLOR merely colours."""
    return console.is_jupyter or (console.is_terminal and console.file.isatty())


@contextmanager
def doing(console: Console, what: str) -> Iterator[None]:
    """Show the current work: a transient status where bars can be drawn, a line elsewhere."""
    if lively(console):
        with console.status(what):
            yield
    else:
        say(console, what)
        yield


class ProgressBar:
    """A bar that each update draws anew, without a thread of its own."""

    def __init__(self, progress: Progress, words: str, total: float | None, after: float, drawn: bool) -> None:
        """Take the drawing, the first words, the amount of work, and the time from which the bar is drawn [s]."""
        self._progress, self._words, self._after, self._drawn = progress, words, after, drawn
        self._task = progress.add_task(words, total=total)
        self._began, self._shown = time.perf_counter(), -_REFRESH_INTERVAL

    def show(
        self,
        completed: float,
        *,
        words: str | None = None,
        total: float | None = None,
        elapsed: float | None = None,
    ) -> None:
        """Show the completed amount.

        Args:
            completed: Amount done.
            words: Current work; as before if None.
            total: Amount to do; as before if None.
            elapsed: Time since the work began [s]; measured if None.
        """
        words = self._words if words is None else words
        elapsed = time.perf_counter() - self._began if elapsed is None else elapsed
        soon = words == self._words and elapsed < self._shown + _REFRESH_INTERVAL
        if not self._drawn or elapsed < self._after or soon:
            return
        self._words, self._shown = words, elapsed
        self._progress.update(self._task, completed=completed, total=total, description=words)
        self._progress.start()
        self._progress.refresh()


@contextmanager
def progress_bar(
    console: Console,
    words: str,
    total: float | None = 1.0,
    amount: str = "{task.percentage:.0f} %",
    *,
    after: float = 0.0,
) -> Iterator[ProgressBar]:
    """Yield a bar, which is removed at the end; nothing is drawn where bars cannot be.

    Args:
        console: Console on which the bar is drawn.
        words: First work.
        total: Amount to do; unknown if None.
        amount: Text behind the bar, a format of rich's `task`.
        after: Time from which the bar is drawn [s].
    """
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn(amount), TimeRemainingColumn())
    progress = Progress(*columns, console=console, transient=True, auto_refresh=False)
    try:
        yield ProgressBar(progress, words, total, after, lively(console))
    finally:
        if progress.live.is_started:
            progress.stop()


@contextmanager
def run_progress(console: Console, expected_duration: float) -> Iterator[Observer]:
    """Show the progress of a run of about `expected_duration` [s]; yields the observer that updates it."""
    if not lively(console):
        yield _run_lines(console, expected_duration)
        return
    amount = "{task.completed:.0f} of about {task.total:.0f} s on the robot's clock"
    with progress_bar(console, "starting", expected_duration, amount) as bar:

        def observe(sample: Sample, now: Observation, command: Command) -> None:
            bar.show(min(now.time, expected_duration), words=command.phase.value)

        yield observe


def _run_lines(console: Console, expected_duration: float) -> Observer:
    """Return an observer that prints a line about a run every `LINE_INTERVAL`."""
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

    return observe


@contextmanager
def step_progress(console: Console, steps: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """Show which of some steps is in progress; yields the function to call with each step's name at its start."""
    if not lively(console):
        yield lambda step: say(console, step)
        return
    with progress_bar(console, "", len(steps), "step {task.completed:.0f} of {task.total:.0f}") as bar:
        yield lambda step: bar.show(steps.index(step) + 1, words=step)
