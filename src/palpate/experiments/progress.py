"""A progress bar for a run."""

import time
from collections.abc import Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

from palpate.experiments.explore import expected_duration, raster_over, scene_object
from palpate.experiments.explore_config import ExploreConfig
from palpate.runtime import Command, Observation, Observer, Sample

REFRESH = 0.1
"""Wall time between two updates [s]."""


@contextmanager
def run_progress(console: Console, config: ExploreConfig) -> Iterator[Observer]:
    """Show how far an exploration is, while the context lasts; yields the observer that feeds the bar."""
    target = scene_object(config)
    total = expected_duration(config, raster_over(target, config), 0.01)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.0f} of about {task.total:.0f} s simulated"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task("exploring", total=total)
        shown = 0.0

        def observe(sample: Sample, now: Observation, command: Command) -> None:
            nonlocal shown
            wall = time.perf_counter()
            if wall - shown > REFRESH:
                shown = wall
                progress.update(task, completed=min(now.time, total), description=command.phase.value)

        yield observe
