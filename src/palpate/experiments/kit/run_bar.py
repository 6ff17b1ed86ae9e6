"""A bar that shows the progress of a run, on a terminal or in a notebook."""

from contextlib import AbstractContextManager

from rich.console import Console

from palpate.runtime.progress_bar import ProgressBar, progress_bar


def run_bar(console: Console, expected_duration: float) -> AbstractContextManager[ProgressBar]:
    """Show the progress of a run of about `expected_duration` [s]."""
    amount = "{task.completed:.0f} of about {task.total:.0f} s on the robot's clock"
    drawn = console.is_terminal or console.is_jupyter
    return progress_bar(console, "starting", expected_duration, amount, drawn=drawn)
