"""`palpate log info`, `export` and `ros2`: what is in the log of a run."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from palpate.commands.command_result import CommandResult
from palpate.commands.log.config import LogExportConfig, LogInfoConfig, LogRos2Config
from palpate.commands.log.export import (
    CsvWriter,
    ParquetWriter,
    TableWriter,
    column_names,
    empty_period_table,
    entry_tables,
    period_tables,
)
from palpate.commands.log.result import log_result
from palpate.commands.log.summary import VERSIONS, log_summary
from palpate.commands.log.times import LogTimes
from palpate.commands.progress import lively
from palpate.commands.say import say
from palpate.experiments.kit.output_folder import make_folder
from palpate.experiments.kit.recording import notes_in
from palpate.runtime.log import LogReader, log_in
from palpate.runtime.log.ros2_bag import write_bag

BAR_DELAY = 2.0
"""Work that takes no longer [s] needs no progress bar."""


def run_log_info(config: LogInfoConfig) -> CommandResult:
    """Print and return what is in a log.

    Raises:
        InvalidValueError: There is no log, or nothing of it can be read.
        OSError: It cannot be opened.
    """
    path = _path(config.log)
    size = path.stat().st_size
    with LogReader(path) as log, _patient_progress(f"reading {path.name}") as progress:
        times = LogTimes(log.codec)
        for piece in log.pieces(progress):
            times.take(piece)
    Console().print(log_summary(log, times, size))
    return log_result(log, times, size, VERSIONS)


def run_log_export(config: LogExportConfig) -> CommandResult:
    """Write the tables of a log; returns which.

    Raises:
        InvalidValueError: There is no log, nothing of it can be read, or the folder cannot be made.
        OSError: A table cannot be written.
    """
    writer: TableWriter = CsvWriter() if config.to == "csv" else ParquetWriter()
    path, console = _path(config.log), Console()
    with LogReader(path) as log:
        folder = path.with_suffix("") if config.out is None else config.out
        make_folder(folder)
        period = folder / f"period{writer.suffix}"
        with _patient_progress(f"writing {period.name}") as progress:
            rows = {period: writer.write(period_tables(log, progress), period)}
    names = {period: column_names(empty_period_table(log.codec))}
    for name, table in entry_tables(log).items():
        other = folder / f"{name}{writer.suffix}"
        rows[other], names[other] = writer.write([table], other), column_names(table)
    for file, count in rows.items():
        say(console, f"{file}: {count} rows")
    damage = () if not log.damage else (f"The log is damaged, its tables have gaps: {log.damage_words}",)
    for warning in damage:
        say(console, warning)
    tables = [{"file": file, "rows": count, "columns": names[file]} for file, count in rows.items()]
    return CommandResult(facts={"log": path, "tables": tables}, files=tuple(rows), warnings=damage)


def run_log_ros2(config: LogRos2Config) -> CommandResult:
    """Write a log as a bag of ROS 2; returns its files.

    Raises:
        InvalidValueError: There is no log, nothing of it can be read, or the folder is there already.
        OSError: A file cannot be written.
    """
    path, console = _path(config.log), Console()
    folder = path.with_name(f"{path.stem}_bag") if config.out is None else config.out
    with _patient_progress(f"reading {path.name}") as progress:
        bag = write_bag(path, folder, notes_in, progress)
    damage = () if bag.damage is None else (f"The log is damaged, the bag has gaps: {bag.damage}",)
    for topic, count in bag.counts.items():
        say(console, f"{topic}: {count} messages")
    for warning in damage:
        say(console, warning)
    say(console, f"Bag: {folder}; play it with: ros2 bag play {folder}")
    facts = {"log": path, "bag": folder, "topics": dict(bag.counts)}
    return CommandResult(facts=facts, files=bag.files, warnings=damage)


def _path(place: Path) -> Path:
    return log_in(place).resolve()  # of a link, the run's own name


@contextmanager
def _patient_progress(what: str) -> Iterator[Callable[[float], None]]:
    """Yield the function to call with the fraction done; a bar appears after `BAR_DELAY`."""
    started = time.monotonic()
    console = Console(stderr=True)
    with Progress(console=console, transient=True, auto_refresh=False, disable=not lively(console)) as bar:
        task = bar.add_task(what, total=1.0, visible=False)

        def show(fraction: float) -> None:
            if time.monotonic() - started > BAR_DELAY:
                bar.update(task, completed=fraction, visible=True, refresh=True)

        yield show
