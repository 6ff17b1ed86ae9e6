"""`palpate log info` and `palpate log export`: what is in the log of a run."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.progress import Progress

from palpate.commands.command_result import CommandResult
from palpate.commands.log.config import LogExportConfig, LogInfoConfig
from palpate.commands.log.export import CsvWriter, ParquetWriter, TableWriter, tables_of
from palpate.commands.log.result import log_result
from palpate.commands.log.summary import VERSIONS, log_summary
from palpate.commands.progress import lively
from palpate.commands.say import say
from palpate.experiments.kit.output_folder import make_folder
from palpate.runtime.log import Log, log_in, read_log

BAR_DELAY = 2.0
"""Work that takes no longer [s] needs no progress bar."""


def run_log_info(config: LogInfoConfig) -> CommandResult:
    """Print and return what is in a log.

    Raises:
        InvalidValueError: There is no log, or nothing of it can be read.
        OSError: It cannot be opened.
    """
    log = _read(config.log)
    size = log.path.stat().st_size
    Console().print(log_summary(log, size))
    return log_result(log, size, VERSIONS)


def run_log_export(config: LogExportConfig) -> CommandResult:
    """Write the tables of a log; returns which.

    Raises:
        InvalidValueError: There is no log, nothing of it can be read, or the folder cannot be made.
        OSError: A table cannot be written.
    """
    writer: TableWriter = CsvWriter() if config.to == "csv" else ParquetWriter()
    log = _read(config.log)
    folder = log.path.with_suffix("") if config.out is None else config.out
    make_folder(folder)
    console = Console()
    tables, files = [], []
    for name, table in tables_of(log).items():
        path = folder / f"{name}{writer.suffix}"
        with _patient_progress(f"writing {path.name}") as progress:
            writer.write(table, path, progress)
        rows = len(table[0].values)
        files.append(path)
        tables.append({"file": path, "rows": rows, "columns": [column.name for column in table]})
        say(console, f"{path}: {rows} rows, {len(table)} columns")
    damage = () if log.damage is None else (f"The log is damaged, its tables have gaps: {log.damage}",)
    for warning in damage:
        say(console, warning)
    return CommandResult(facts={"log": log.path, "tables": tables}, files=tuple(files), warnings=damage)


def _read(place: Path) -> Log:
    path = log_in(place).resolve()  # of a link, the run's own name
    with _patient_progress(f"reading {path.name}") as progress:
        return read_log(path, progress)


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
