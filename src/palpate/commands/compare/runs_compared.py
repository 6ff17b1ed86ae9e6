"""Runs of the same experiment, read from their logs to be laid side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from palpate.commands.replay.kinds import LogKind, kind_of
from palpate.commands.view.plan import ViewedPlan, recorded_plan
from palpate.errors import FloatArray, InvalidValueError
from palpate.experiments.explore.explored_contacts import ScanContacts
from palpate.experiments.explore.plan import ExplorationPlan
from palpate.experiments.kit.recorded_run import live_values
from palpate.experiments.regulate.plan import RegulationPlan
from palpate.runtime import Phase, Record
from palpate.runtime.log import Log, log_in, read_log
from palpate.runtime.log.record import record_of
from palpate.sensing.contact import ContactStatus

LOG_ENDING = ".mcap"
"""Of the files that runs are recorded in."""

CHANGE = "change"
"""Field of changes of live parameters, which plans of logs do not have: the log has them."""

LEFT_OUT = ("out",)
"""Fields of a configuration that ask for nothing of the run."""


@dataclass(frozen=True, slots=True, eq=False)
class ComparedRun:
    """One run, as its log tells it.

    Attributes:
        name: To tell it from the others.
        place: As it was named.
        log: Of it.
        kind: Which experiment it is of.
        planned: What was planned.
        records: Every period, per finger.
        points: Signed distance of felt points to the true surface, shape (n,) [m]; empty where nobody knows.
        set_force: Normal force asked for, shape (n,) [N]; NaN where none was, or it was a hand.
    """

    name: str
    place: Path
    log: Log
    kind: LogKind
    planned: ViewedPlan
    records: tuple[Record, ...]
    points: FloatArray
    set_force: FloatArray

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
        told = [event.text.removeprefix("ended: ") for event in self.log.events if event.source == "run"]
        return told[-1] if told else "not noted: the log breaks off"


def is_run(place: Path) -> bool:
    """Return whether a person means a run by a place: a folder, or the file of a log."""
    return place.is_dir() or place.suffix == LOG_ENDING


def read_runs(places: Sequence[Path]) -> tuple[ComparedRun, ...]:
    """Return the runs that people name.

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
    kinds = [kind_of(log) for log in logs]
    for place, kind in zip(places, kinds, strict=True):
        if kind is not kinds[0]:
            raise InvalidValueError(
                f"{places[0]} is of `{kinds[0].command}` and {place} of `{kind.command}`: only runs of the same "
                "experiment can be compared"
            )
    return tuple(
        _run(name, place, log, kind)
        for name, place, log, kind in zip(_names(places, paths), places, logs, kinds, strict=True)
    )


def changed_fields(runs: Sequence[ComparedRun]) -> tuple[tuple[str, tuple[object, ...]], ...]:
    """Return what was asked differently: name of the option, and what was asked of each run."""
    found = []
    for name in _asked_fields(runs[0]):
        values = tuple(_asked(run, name) for run in runs)
        if any(value != values[0] for value in values[1:]):
            found.append((name, values))
    return tuple(found)


def common_fields(runs: Sequence[ComparedRun]) -> tuple[tuple[str, object], ...]:
    """Return what was asked of every run alike."""
    changed = {name for name, _ in changed_fields(runs)}
    names = [name for name in _asked_fields(runs[0]) if name not in changed]
    return tuple((name, _asked(runs[0], name)) for name in names)


def _asked_fields(run: ComparedRun) -> list[str]:
    return [field.name for field in fields(run.planned.config) if field.name not in LEFT_OUT]


def _asked(run: ComparedRun, name: str) -> object:
    """An option of a run; of its live parameters, what they were changed to by the log, None if they were not."""
    if name != CHANGE:
        return getattr(run.planned.config, name)
    first = run.log.heading.first_time
    told = (f"{each.name} {each.value:g} at {each.time - first:.3g} s" for each in run.log.changes)
    return "; ".join(told) or None


def _names(places: Sequence[Path], paths: Sequence[Path]) -> list[str]:
    """Names of folders, of logs where these are the same."""
    names = [
        place.resolve().name if place.is_dir() else path.stem for place, path in zip(places, paths, strict=True)
    ]
    return names if len(set(names)) == len(names) else [f"{i + 1}: {name}" for i, name in enumerate(names)]


def _run(name: str, place: Path, log: Log, kind: LogKind) -> ComparedRun:
    planned = recorded_plan(log)
    fingers = len(log.codec.heading.layout.channels)
    records = tuple(record_of(log.codec, log.rows, i) for i in range(fingers))
    if not len(records[0]):
        raise InvalidValueError(f"{log.path}: there are no periods in it: the run ended before it began")
    return ComparedRun(
        name,
        place,
        log,
        kind,
        planned,
        records,
        _points(planned, records[0]),
        _set_force(planned, records[0], log),
    )


def _points(planned: ViewedPlan, record: Record) -> FloatArray:
    if not isinstance(planned, ExplorationPlan) or not planned.truth_known:
        return np.zeros(0)
    felt = ScanContacts.of(
        record,
        planned.finger,
        half_compliance=planned.half_compliance,
        sensed_force=planned.config.force,
        force_noise=planned.config.noise[0],
    )
    return np.asarray(planned.target.signed_distance(felt.cloud.position)) if len(felt.cloud) else np.zeros(0)


def _set_force(planned: ViewedPlan, record: Record, log: Log) -> FloatArray:
    wanted = np.full(len(record), np.nan)
    if isinstance(planned, ExplorationPlan):
        swept = np.flatnonzero(record.phase == Phase.SCAN.value)
        if planned.profile is None:
            live = np.array(live_values("force", planned.controller().live, log.changes, record.time.tolist()))
            wanted[swept] = live[swept]
        elif len(swept):
            since = record.time[swept] - record.time[swept[0]]
            wanted[swept] = [planned.profile.at(time)[0] for time in since.tolist()]
    elif isinstance(planned, RegulationPlan):
        held = np.flatnonzero(record.phase == Phase.HOLD.value)
        if len(held):
            since = record.time[held] - record.time[held[0]]
            # a profile moves with the force that is asked for while it runs
            live = np.array(live_values("force", planned.controller().live, log.changes, record.time.tolist()))
            asked = np.array([planned.profile.at(time)[0] for time in since.tolist()])
            wanted[held] = asked + live[held] - planned.parameters.force
    return wanted
