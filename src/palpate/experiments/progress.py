"""A progress bar for a run."""

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from palpate.runtime import Command, Observation, Observer, Sample

REFRESH = 0.1
"""Wall time between two updates [s]."""


@contextmanager
def run_progress(console: Console, expected_duration: float) -> Iterator[Observer]:
    """Show how far a run of about `expected_duration` [s] is; yields the observer that feeds the bar."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of about {task.total:.0f} s simulated"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("starting", total=expected_duration)
        shown = 0.0

        def observe(sample: Sample, now: Observation, command: Command) -> None:
            nonlocal shown
            wall = time.perf_counter()
            if wall - shown > REFRESH:
                shown = wall
                done = min(now.time, expected_duration)
                progress.update(task, completed=done, description=command.phase.value)

        yield observe


@contextmanager
def step_progress(console: Console, steps: Sequence[str]) -> Iterator[Callable[[str], None]]:
    """Show which of some steps is being worked on; yields what is told the name of each when it begins."""
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("step {task.completed:.0f} of {task.total:.0f}"),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("", total=len(steps))

        def tell(step: str) -> None:
            progress.update(task, completed=steps.index(step) + 1, description=step)

        yield tell
