"""Runs of the same experiment, evaluated from their logs for comparison."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.kit.comparable import ErrorSample, FeltMap, WithErrors, WithMap, WithSetForce
from palpate.experiments.kit.experiment import Experiment, Result
from palpate.experiments.kit.from_log import LoggedRun
from palpate.experiments.kit.recorded_run import ProgressCallback, no_progress
from palpate.runtime import Record
from palpate.runtime.log import Log, log_in, read_log
from palpate.runtime.log.record import record_of
from palpate.sensing.contact import ContactStatus

LOG_ENDING = ".mcap"
"""Of the files that runs are recorded in."""

CHANGE = "change"
"""Option of changes of live parameters: what was changed, the log has."""

LEFT_OUT = ("out",)
"""Options that do not affect the run."""


@dataclass(frozen=True, slots=True, eq=False)
class ComparedRun:
    """One run, as logged.

    Attributes:
        name: Distinguishes it from the others.
        place: As it was named.
        of: What its log is of.
        result: What came of it.
        records: Every period, per finger.
    """

    name: str
    place: Path
    of: LoggedRun
    result: Result
    records: tuple[Record, ...]

    @property
    def log(self) -> Log:
        """Of it."""
        return self.of.log

    @property
    def config(self) -> Any:
        """Its configuration."""
        return self.of.config

    @property
    def experiment(self) -> Experiment:
        """Of which it is a run."""
        return self.of.experiment

    @property
    def set_force(self) -> FloatArray:
        """Set normal force, shape (n,) [N]; NaN where there is none, or it is unknown."""
        wanted = np.full(len(self.records[0]), np.nan)
        if isinstance(self.result, WithSetForce):
            set_force = self.result.set_force  # the result does not cover the periods of stopping
            wanted[: len(set_force)] = set_force
        return wanted

    @property
    def errors(self) -> tuple[ErrorSample, ...]:
        """Whose spread is shown."""
        return self.result.error_samples() if isinstance(self.result, WithErrors) else ()

    @property
    def map(self) -> FeltMap | None:
        """Of the surface, if there is one that claims anything."""
        return self.result.claimed_map if isinstance(self.result, WithMap) else None

    @property
    def time(self) -> FloatArray:
        """Since its first period, shape (n,) [s]."""
        at = self.records[0].time
        return at - at[0] if len(at) else at

    @property
    def felt(self) -> FloatArray:
        """Normal force that was felt, the mean over the fingers, shape (n,) [N]; zero without contact."""
        each = [np.where(r.status == ContactStatus.OK, r.normal_force, 0.0) * r.touching for r in self.records]
        return np.asarray(np.mean(np.nan_to_num(each), axis=0))

    @property
    def commanded_grip(self) -> FloatArray:
        """Grip that was commanded, the mean over the fingers, shape (n,) [N]; NaN without a hand."""
        columns = self.log.codec.columns
        if "command.grip_force" not in columns:
            return np.full(len(self.records[0]), np.nan)
        each = self.log.rows[:, columns["command.grip_force"]]
        known = np.isfinite(each).any(axis=1)
        out = np.full(len(each), np.nan)
        out[known] = np.nanmean(each[known], axis=1)
        return out

    @property
    def ending(self) -> str:
        """How it ended, in words."""
        recorded = [event.text.removeprefix("ended: ") for event in self.log.events if event.source == "run"]
        return recorded[-1] if recorded else "not noted: the log breaks off"


def is_run(place: Path) -> bool:
    """Return whether a person means a run by a place: a folder, or the file of a log."""
    return place.is_dir() or place.suffix == LOG_ENDING


def read_runs(places: Sequence[Path], progress: ProgressCallback = no_progress) -> tuple[ComparedRun, ...]:
    """Return the runs that people name; `progress` is called with the name of the one being evaluated.

    Raises:
        InvalidValueError: One is no run, they are of different experiments, or one and the same.
        OSError: A log cannot be read.
    """
    for place in places:
        if not is_run(place):
            raise InvalidValueError(
                f"{place}: is no run, as {next(each for each in places if is_run(each))} is; give folders of runs "
                "or their logs (.mcap), or a map and a mesh"
            )
    paths = [log_in(place).resolve() for place in places]
    for i, path in enumerate(paths):
        if path in paths[:i]:
            raise InvalidValueError(f"{places[i]} and {places[paths.index(path)]} are the same run: {path}")
    logs = [read_log(path) for path in paths]
    found = [LoggedRun.of(log) for log in logs]
    for place, each in zip(places, found, strict=True):
        if each.experiment.name != found[0].experiment.name:
            raise InvalidValueError(
                f"{places[0]} is of `palpate {found[0].experiment.name}` and {place} of `palpate "
                f"{each.experiment.name}`: only runs of the same experiment can be compared"
            )
    runs = []
    for name, place, each in zip(_names(places, paths), places, found, strict=True):
        progress(f"working out {name}")
        runs.append(_run(name, place, each, progress))
    return tuple(runs)


def changed_fields(runs: Sequence[ComparedRun]) -> tuple[tuple[str, tuple[object, ...]], ...]:
    """Return the options that differ: name, and value in each run."""
    found = []
    for name in _compared_options(runs[0]):
        values = tuple(_option_of(run, name) for run in runs)
        if any(value != values[0] for value in values[1:]):
            found.append((name, values))
    return tuple(found)


def common_fields(runs: Sequence[ComparedRun]) -> tuple[tuple[str, object], ...]:
    """Return the options that all runs share."""
    changed = {name for name, _ in changed_fields(runs)}
    names = [name for name in _compared_options(runs[0]) if name not in changed]
    return tuple((name, _option_of(runs[0], name)) for name in names)


def _compared_options(run: ComparedRun) -> list[str]:
    return [field.name for field in fields(run.config) if field.name not in LEFT_OUT]


def _option_of(run: ComparedRun, name: str) -> object:
    """An option of a run; of its live parameters, what they were changed to by the log, None if they were not."""
    if name != CHANGE:
        return getattr(run.config, name)
    first = run.log.heading.first_time
    recorded = (f"{each.name} {each.value:g} at {each.time - first:.3g} s" for each in run.log.changes)
    return "; ".join(recorded) or None


def _names(places: Sequence[Path], paths: Sequence[Path]) -> list[str]:
    """Names of folders, of logs where these are the same."""
    names = [
        place.resolve().name if place.is_dir() else path.stem for place, path in zip(places, paths, strict=True)
    ]
    return names if len(set(names)) == len(names) else [f"{i + 1}: {name}" for i, name in enumerate(names)]


def _run(name: str, place: Path, logged: LoggedRun, progress: ProgressCallback) -> ComparedRun:
    log = logged.log
    records = tuple(record_of(log.codec, log.rows, i) for i in range(len(log.layout.channels)))
    if not len(records[0]):
        raise InvalidValueError(f"{log.path}: there are no periods in it: the run ended before it began")
    return ComparedRun(name, place, logged, logged.evaluate(progress), records)
