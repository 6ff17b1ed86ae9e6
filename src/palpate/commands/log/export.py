"""`palpate log export` and `ros2`: logs of runs as a data set, and as a bag of ROS 2."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import chain
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import msgspec
from rich.console import Console

from palpate.bounded_file import read_bytes
from palpate.commands.command_result import CommandResult
from palpate.commands.log.config import LogExportConfig, LogRos2Config
from palpate.commands.log.info import BAR_DELAY, resolved_log
from palpate.commands.run import SWEEP_FILE
from palpate.commands.sweep.store import FILE_BOUNDS, read_record
from palpate.errors import InvalidValueError
from palpate.experiments.kit.checks import make_folder
from palpate.experiments.kit.config_file import EXPERIMENT_TEXT, NAME_KEY, experiment_in, plain_values, read_config
from palpate.experiments.kit.recording import notes_in
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.run_report import command_line
from palpate.exporting.exporter import Episode, Exporter, Fact
from palpate.open_kinds import kind_named
from palpate.runtime.log import LogReader
from palpate.runtime.log.ros2_bag import write_bag
from palpate.runtime.progress import progress_bar

_NO_TASK = "palpate"
"""Task of a log whose experiment is not installed."""


def run_log_export(config: LogExportConfig) -> CommandResult:
    """Write a log, or the logs of a sweep, as a data set; returns its files.

    Raises:
        InvalidValueError: If there is no log, nothing of one can be read, there is no such format, it cannot hold
            these logs, the folder cannot be made, or it has a folder that the format would write.
        MissingLibraryError: If a library that the format takes is not installed.
        OSError: If a file cannot be written.
    """
    place = config.log
    exporter = _exporter(config.to)
    if (place / SWEEP_FILE).is_file():
        logs = [log.resolve() for log in sorted((place / "reports").glob("*/latest.mcap"))]
        folder = place / "dataset"
        if not logs:
            raise InvalidValueError(f"{place}: this sweep has no logs; do it again with --keep-reports")
    else:
        logs = [resolved_log(place)]
        folder = logs[0].with_suffix("")
    folder = config.out or folder
    make_folder(folder)
    read: list[LogReader] = []
    with (
        TemporaryDirectory(prefix=".part-", dir=folder) as part,
        progress_bar(Console(stderr=True), "writing", after=BAR_DELAY) as bar,
    ):
        exporter.write(episodes(logs, bar.show, read.append), Path(part))
        files = _moved(Path(part), folder)
    periods = sum(log.periods for log in read)
    damage = tuple(f"{log.path}: damaged, its periods have gaps: {log.damage_words}" for log in read if log.damage)
    runs = f"{len(read)} run{'s' if len(read) > 1 else ''}"
    return CommandResult(
        metrics={"episodes": len(read), "periods": periods},
        facts={"logs": [log.path for log in read]},
        files=files,
        warnings=damage,
        shown=(f"{periods} periods of {runs}", *map(str, files), *damage),
    )


def _exporter(name: str) -> Exporter:
    kind = kind_named(Exporter, name, "to")
    try:
        exporter = kind()
    except TypeError as error:
        raise InvalidValueError(f"to = {name}: cannot be made without arguments: {error}") from None
    assert isinstance(exporter, Exporter)  # `kind_named` has checked it
    return exporter


def _moved(part: Path, folder: Path) -> tuple[Path, ...]:
    """Move written files to their place and return them; files replace earlier ones, folders replace nothing."""
    written = sorted(part.iterdir())
    for each in written:
        if each.is_dir() and (folder / each.name).exists():
            raise InvalidValueError(
                f"out = {folder}: has a {each.name} already, which stays as it is; choose another folder (--out)"
            )
    files = [folder / each.relative_to(part) for each in sorted(part.rglob("*")) if each.is_file()]
    for each in written:
        each.replace(folder / each.name)
    return tuple(files)


def episodes(
    logs: list[Path], progress: Callable[[float], None], finished: Callable[[LogReader], None]
) -> Iterator[Episode]:
    """Yield each run, open until the next is requested.

    Args:
        logs: Logs of the runs.
        progress: Function that is called with the fraction of all logs that has been read.
        finished: Function that is called with each log once it has been read.

    Raises:
        InvalidValueError: If nothing of a log can be read.
        OSError: If a log cannot be opened.
    """
    for number, path in enumerate(logs):

        def part(fraction: float, number: int = number) -> None:
            progress((number + fraction) / len(logs))

        with LogReader(path) as log:
            pieces = log.pieces(part)
            first = next(pieces, None)  # before the first piece come the attachments
            task, settings = _task_and_settings(log.attachments)
            rows = pieces if first is None else chain((first,), pieces)
            yield Episode(log, task, settings, _sweep_results(path), rows)
            finished(log)


def _task_and_settings(attachments: Mapping[str, str]) -> tuple[str, dict[str, Fact]]:
    """Return the command of a run without its seed, and every setting."""
    if EXPERIMENT_TEXT not in attachments:
        return _NO_TASK, {}
    try:
        experiment = experiment_named(experiment_in(attachments[EXPERIMENT_TEXT]))
        config = read_config(attachments[EXPERIMENT_TEXT], experiment.Config)
    except InvalidValueError:  # not installed, or of another version: its periods can be read all the same
        return _NO_TASK, {}
    default: Any = experiment.Config()
    task = command_line(experiment.name, replace(config, seed=default.seed, out=default.out))
    settings: dict[str, Fact] = {NAME_KEY: experiment.name}
    for name, value in plain_values(config).items():
        if value is None or isinstance(value, bool | int | float | str):
            settings[name] = value
        else:
            settings[name] = msgspec.json.encode(value).decode()
    return task, settings


def _sweep_results(log: Path) -> dict[str, Fact]:
    """Return the results of the sweep's run that wrote a log; nothing for any other log."""
    folder = log.parent
    try:
        record = read_record(read_bytes(folder.parents[1] / "runs" / f"{folder.name}.json", FILE_BOUNDS))
    except (OSError, IndexError):
        return {}
    return {} if record is None else {"run": record.run, "status": record.status.value, **record.metrics}


def run_log_ros2(config: LogRos2Config) -> CommandResult:
    """Write a log as a bag of ROS 2; returns its files.

    Raises:
        InvalidValueError: If there is no log, nothing of it can be read, or the folder exists already.
        OSError: If a file cannot be written.
    """
    path = resolved_log(config.log)
    folder = path.with_name(f"{path.stem}_bag") if config.out is None else config.out
    with progress_bar(Console(stderr=True), f"reading {path.name}", after=BAR_DELAY) as bar:
        bag = write_bag(path, folder, notes_in, bar.show)
    damage = () if bag.damage is None else (f"The log is damaged, the bag has gaps: {bag.damage}",)
    counts = [f"{topic}: {count} messages" for topic, count in bag.counts.items()]
    shown = (*counts, *damage, f"Bag: {folder}; play it with: ros2 bag play {folder}")
    facts = {"log": path, "bag": folder, "topics": dict(bag.counts)}
    return CommandResult(facts=facts, files=bag.files, warnings=damage, shown=shown)
