"""The runs that a person means by a log, a folder or a sweep, as episodes of a data set."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import msgspec

from palpate.bounded_file import read_bytes
from palpate.commands.run import SWEEP
from palpate.commands.sweep.store import FILE_BOUNDS, read_record
from palpate.errors import InvalidValueError
from palpate.experiments.kit.config_file import EXPERIMENT_TEXT, NAME_KEY, experiment_in, plain_values, read_config
from palpate.experiments.kit.registry import experiment_named
from palpate.experiments.kit.run_report import command_line
from palpate.exporting.exporter import Episode, Fact
from palpate.runtime.log import LogReader, log_in

NO_TASK = "palpate"
"""Of a log that no experiment of this computer's wrote."""


def logs_in(place: Path) -> list[Path]:
    """Return the logs of a file, of a folder with its latest, or of a sweep in the order of its runs.

    Raises:
        InvalidValueError: There is none.
    """
    if not (place / SWEEP).is_file():
        return [log_in(place).resolve()]  # of a link, the run's own name
    logs = sorted((place / "reports").glob("*/latest.mcap"))
    if not logs:
        raise InvalidValueError(f"{place}: this sweep has no logs; do it again with --keep-reports")
    return [log.resolve() for log in logs]


def default_folder(place: Path) -> Path:
    """Return where a data set goes if nothing else is said."""
    return place / "dataset" if (place / SWEEP).is_file() else log_in(place).resolve().with_suffix("")


def episodes(
    logs: list[Path], progress: Callable[[float], None], finished: Callable[[LogReader], None]
) -> Iterator[Episode]:
    """Yield each run, open until the next is asked for.

    Args:
        logs: Of the runs.
        progress: Told which fraction of all has been read.
        finished: Told each log once it has been read.

    Raises:
        InvalidValueError: Nothing of a log can be read.
        OSError: One cannot be opened.
    """
    for number, path in enumerate(logs):
        with LogReader(path) as log:
            pieces = log.pieces(_part(progress, number, len(logs)))
            first = next(pieces, None)  # before the first piece come the attachments
            task, settings = _asked(log.attachments)
            yield Episode(log, task, settings, _results(path), chain(() if first is None else (first,), pieces))
            finished(log)


def _part(progress: Callable[[float], None], number: int, count: int) -> Callable[[float], None]:
    return lambda fraction: progress((number + fraction) / count)


def _asked(texts: Mapping[str, str]) -> tuple[str, dict[str, Fact]]:
    """Return what was asked in words, without the seed, and every setting."""
    if EXPERIMENT_TEXT not in texts:
        return NO_TASK, {}
    try:
        experiment = experiment_named(experiment_in(texts[EXPERIMENT_TEXT]))
        config = read_config(texts[EXPERIMENT_TEXT], experiment.Config)
    except InvalidValueError:  # not installed, or of another version: its periods can be read all the same
        return NO_TASK, {}
    usual: Any = experiment.Config()
    task = command_line(experiment.name, replace(config, seed=usual.seed, out=usual.out))
    return task, {NAME_KEY: experiment.name} | {
        name: _plain(value) for name, value in plain_values(config).items()
    }


def _results(log: Path) -> dict[str, Fact]:
    """Return what a sweep has found in the run that a log is of; nothing of another log."""
    folder = log.parent
    try:
        record = read_record(read_bytes(folder.parents[1] / "runs" / f"{folder.name}.json", FILE_BOUNDS))
    except (OSError, IndexError):
        return {}
    return {} if record is None else {"run": record.run, "status": record.status.value, **record.metrics}


def _plain(value: object) -> Fact:
    if value is None or isinstance(value, bool | int | float | str):
        return value
    return msgspec.json.encode(value).decode()
