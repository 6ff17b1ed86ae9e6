"""A progress bar for long work: one wrapper of rich for runs, batches, logs, replays and compiling."""

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

PERCENT = "{task.percentage:.0f} %"
"""Amount of work that is told as a fraction of 1."""

REFRESH = 0.1
"""Wall time between two updates of a bar [s]; a change of its words is shown at once."""


class ProgressBar:
    """A bar that each update draws anew, without a thread of its own."""

    def __init__(self, progress: Progress, words: str, total: float | None, after: float, drawn: bool) -> None:
        """Take what draws, the first words, and from when on [s] the bar is shown, if at all."""
        self._progress, self._words, self._after, self._drawn = progress, words, after, drawn
        self._task = progress.add_task(words, total=total)
        self._began, self._shown = time.perf_counter(), -REFRESH

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
        soon = words == self._words and elapsed < self._shown + REFRESH
        if not self._drawn or elapsed < self._after or soon:
            return
        self._words, self._shown = words, elapsed
        self._progress.update(self._task, completed=completed, total=total, description=words)
        self._progress.start()
        self._progress.refresh()


@contextmanager
def progress_bar(
    console: Console, words: str, total: float | None, amount: str, *, after: float = 0.0, drawn: bool = True
) -> Iterator[ProgressBar]:
    """Yield a bar, which is removed at the end.

    Args:
        console: Where the bar is drawn.
        words: The first work.
        total: Amount to do; unknown if None.
        amount: Text behind the bar, a format of rich's `task`.
        after: Time from which on the bar is shown [s].
        drawn: Whether it is drawn at all: not where the output is captured.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn(amount), TimeRemainingColumn())
    progress = Progress(*columns, console=console, transient=True, auto_refresh=False)
    try:
        yield ProgressBar(progress, words, total, after, drawn)
    finally:
        if progress.live.is_started:
            progress.stop()


def run_bar(console: Console, expected_duration: float) -> AbstractContextManager[ProgressBar]:
    """Show the progress of a run of about `expected_duration` [s], on a terminal or in a notebook."""
    amount = "{task.completed:.0f} of about {task.total:.0f} s on the robot's clock"
    drawn = console.is_terminal or console.is_jupyter
    return progress_bar(console, "starting", expected_duration, amount, drawn=drawn)
