"""A progress bar for a batch that takes long."""

from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console

from palpate.runtime.batch.outcome import BatchProgress, ShowProgress
from palpate.runtime.progress_bar import progress_bar

SHOWN_AFTER = 2.0
"""What is over sooner needs no bar [s]."""


def quiet(progress: BatchProgress) -> None:
    """Show nothing."""


@contextmanager
def batch_bar(console: Console | None = None) -> Iterator[ShowProgress]:
    """Show how far a batch is, from two seconds on; yields the function that `run_batch` calls.

    Args:
        console: Where to; standard error if not given. Only a terminal gets a bar.
    """
    console = Console(stderr=True) if console is None else console
    amount = "{task.completed:.0f}/{task.total}"
    with progress_bar(console, "cases", None, amount, after=SHOWN_AFTER, drawn=console.is_terminal) as bar:

        def show(progress: BatchProgress) -> None:
            failed = f", {progress.failed} failed" if progress.failed else ""
            bar.show(progress.done, words=f"cases{failed}", total=progress.cases, elapsed=progress.elapsed)

        yield show
