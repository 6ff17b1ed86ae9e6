"""A bar that shows how far a run has got, on a terminal or in a notebook."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeRemainingColumn

from palpate.runtime import Command, Observation, Sample

REFRESH = 0.1
"""Wall time between two updates of a bar [s]."""


class RunBar:
    """What moves the bar: an observer of every period, and the steps of the evaluation after them."""

    def __init__(self, progress: Progress, expected_duration: float) -> None:
        """Take what draws, and about how long the run takes [s]."""
        self._progress, self._expected = progress, expected_duration
        self._task: TaskID = progress.add_task("starting", total=expected_duration)
        self._shown = 0.0

    def observe(self, sample: Sample, now: Observation, command: Command) -> None:
        """Take a period. An `Observer`."""
        wall = time.perf_counter()
        if wall - self._shown > REFRESH:
            self._shown = wall
            done = min(now.time, self._expected)
            self._progress.update(self._task, completed=done, description=command.phase.value)

    def step(self, name: str) -> None:
        """Show what is done after the run."""
        self._progress.update(self._task, completed=self._expected, description=name)


@contextmanager
def run_bar(console: Console, expected_duration: float) -> Iterator[RunBar]:
    """Show the progress of a run of about `expected_duration` [s]."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of about {task.total:.0f} s on the robot's clock"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        yield RunBar(progress, expected_duration)
