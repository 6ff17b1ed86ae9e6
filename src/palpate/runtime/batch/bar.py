"""A progress bar for a batch that takes long."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from palpate.runtime.batch.outcome import BatchProgress, ShowProgress

SHOWN_AFTER = 2.0
"""What is over sooner needs no bar [s]."""


def quiet(progress: BatchProgress) -> None:
    """Show nothing."""


@contextmanager
def progress_bar(console: Console | None = None) -> Iterator[ShowProgress]:
    """Show how far a batch is, from two seconds on; yields what `run_batch` is to tell it to.

    Args:
        console: Where to; standard error if not given. Only a terminal gets a bar.
    """
    console = Console(stderr=True) if console is None else console
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    # refreshed by each update: no thread of its own
    with_time = (*columns, TimeElapsedColumn(), TimeRemainingColumn())
    bar = Progress(*with_time, console=console, transient=True, auto_refresh=False)
    task = bar.add_task("cases", total=None)

    def show(progress: BatchProgress) -> None:
        failed = f", {progress.failed} failed" if progress.failed else ""
        bar.update(task, completed=progress.done, total=progress.cases, description=f"cases{failed}")
        if bar.live.is_started:
            bar.refresh()
        elif progress.elapsed > SHOWN_AFTER and console.is_terminal:
            bar.start()

    try:
        yield show
    finally:
        if bar.live.is_started:
            bar.stop()
