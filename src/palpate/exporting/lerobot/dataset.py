"""Logs as a LeRobot dataset, v3.0: an episode is a run, a frame is a period.

Format: `LeRobotDataset` of the package lerobot 0.4.4, CODEBASE_VERSION v3.0. In data/ each Parquet file holds the
frames of many episodes; meta/ holds a table of the episodes, one of the tasks, stats.json and info.json.

Policies of LeRobot read `observation.state`, all measurements of arm and hand, and `action`, all commands. Each
other quantity of the log is a feature of its own, under its path in the log. A number of a finger's sensor or its
sense of touch begins with `observation.`; times, codes and truth do not, for policies should not read them.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.errors import FloatArray, InvalidValueError
from palpate.exporting.exporter import Episode, Exporter, Fact
from palpate.exporting.parquet_tables import ParquetFile
from palpate.exporting.tables import dtype_of, fact_columns, named_components
from palpate.extras import require
from palpate.open_kinds import Settings
from palpate.runtime.log.fields import TRUTH, LogField, LogGroup, path_of, walk
from palpate.runtime.log.period_codec import PeriodCodec

QUANTILES = (0.01, 0.10, 0.50, 0.90, 0.99)
"""Quantiles in the statistics of LeRobot."""

PLACE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"

_FILES_PER_FOLDER, _FILE_MEGABYTES = 1000, 100
"""Number of data files in a folder, and size of each: LeRobot's own."""

_MAX_SAMPLE = 20_000
"""Most rows that quantiles are taken of, evenly spaced in a longer log; their error in rank is below 0.01 %."""

_RATE_TOLERANCE = 1e-9
"""Relative difference from a whole number below which a rate is one: periods are decimal fractions."""

_COMMAND = "command"
_GRIPS, _GRIP_COUNT = "command.grip_force", "command.grip_count"

_ADDED = {"timestamp": "float32"} | dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64")
"""Features that every dataset has, with their types."""


class LeRobotExporter(Exporter, Settings, frozen=True):
    """The files keep every bit of every finite number; LeRobot's loader makes float32 of them."""

    def write(self, episodes: Iterator[Episode], folder: Path) -> None:
        """Write the folders data/ and meta/."""
        require("pyarrow", "parquet", "--to lerobot")
        dataset: _Dataset | None = None
        with ExitStack() as files:
            for episode in episodes:
                if dataset is None:
                    dataset = _Dataset(folder, episode, files)
                dataset.add(episode)
        if dataset is None or not dataset.episodes:
            raise InvalidValueError("no log has a period, and a LeRobot dataset has at least one frame")
        _write_meta(folder, dataset)


class _Dataset:
    """The frames of a dataset that grows.

    Attributes:
        features: Features in the order of their columns.
        period: Time between two frames [s].
        robot: Robot of the first episode; None if the episode names none.
        episodes: Row of the table of episodes for each written episode, without settings and results.
        facts: Settings and results of each written episode.
        frames: Number of frames.
        tasks: Number of each task.
        statistics: Statistics of all frames.
    """

    def __init__(self, folder: Path, first: Episode, files: ExitStack) -> None:
        """Open the first data file.

        Args:
            folder: Folder of the dataset.
            first: First episode; all others must have the same features.
            files: Stack that closes the data files.
        """
        codec = first.log.codec
        added = enumerate(_ADDED.items(), codec.width)
        self.features = (
            *_features_of(codec),
            *(_Feature(name, dtype, (name,), np.array([column])) for column, (name, dtype) in added),
        )
        self.period, self.robot = codec.heading.period, first.settings.get("robot")
        self.episodes: list[dict[str, Any]] = []
        self.facts: dict[str, list[Mapping[str, Fact]]] = {"settings": [], "results": []}
        self.frames = 0
        self.tasks: dict[str, int] = {}
        self._columns = np.concatenate([each.columns for each in self.features])
        self.statistics = RunningStatistics(len(self._columns))
        self._folder, self._files = folder, files
        self._arrow: Any = import_module("pyarrow")  # it has no types
        self._file, self._data = 0, self._opened(0)

    def add(self, episode: Episode) -> None:
        """Write the frames of an episode; one without periods is left out.

        Raises:
            InvalidValueError: If the episode has other features or another period than the first.
        """
        self._check(episode)
        if self.episodes and self._data.path.stat().st_size >= _FILE_MEGABYTES << 20:
            self._file += 1
            self._data = self._opened(self._file)
        finite, statistics = _FiniteRows(episode.log.codec), RunningStatistics(len(self._columns))
        first = 0
        for piece in episode.rows():
            if statistics.count == 0:
                first = int(piece.sequence[0])
            task = self.tasks.setdefault(episode.task, len(self.tasks))
            frame = np.zeros((len(piece.sequence), len(_ADDED)))
            frame[:, 0] = self.period * (piece.sequence - first)
            frame[:, 1] = np.arange(statistics.count, statistics.count + len(frame))
            frame[:, 2], frame[:, 3], frame[:, 4] = len(self.episodes), self.frames + frame[:, 1], task
            values = np.hstack([finite.of(piece.values), frame])[:, self._columns]
            statistics.take(values)
            self.statistics.take(values)
            self._data.append_arrow(self._table(values))
        if not statistics.count:
            return
        row = {
            "episode_index": len(self.episodes),
            "tasks": [episode.task],
            "length": statistics.count,
            "dataset_from_index": self.frames,
            "dataset_to_index": self.frames + statistics.count,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
            "log": episode.log.path.name,
            **{f"data/{name}": number for name, number in _data_place(self._file).items()},
        }
        for name, kinds in statistics.by_feature(self.features).items():
            row |= {f"stats/{name}/{kind}": values for kind, values in kinds.items()}
        self.episodes.append(row)
        self.facts["settings"].append(episode.settings)
        self.facts["results"].append(episode.results)
        self.frames += statistics.count

    def _check(self, episode: Episode) -> None:
        codec = episode.log.codec
        own = {each.name: each.info for each in _features_of(codec)}
        known = {each.name: each.info for each in self.features}
        odd = [name for name in {**known, **own} if own.get(name) != known.get(name) and name not in _ADDED]
        if codec.heading.period != self.period:
            odd.append(f"a period of {codec.heading.period:g} s instead of {self.period:g} s")
        if odd:
            raise InvalidValueError(
                f"{episode.log.path}: differs from the first log in {', '.join(odd[:5])}: a LeRobot dataset has "
                "one set of features at one rate; export them apart, or --to hdf5"
            )

    def _opened(self, number: int) -> ParquetFile:
        path = self._folder / "data" / PLACE.format(**_data_place(number))
        path.parent.mkdir(parents=True, exist_ok=True)
        return self._files.enter_context(ParquetFile(path))

    def _table(self, values: FloatArray) -> Any:
        arrays, place = {}, 0
        for each in self.features:
            count = len(each.names)
            flat = self._arrow.array(values[:, place : place + count].astype(each.dtype).ravel())
            arrays[each.name] = self._arrow.FixedSizeListArray.from_arrays(flat, count) if count > 1 else flat
            place += count
        return self._arrow.table(arrays)


class RunningStatistics:
    """Statistics of columns that come in pieces, in bounded memory; LeRobot normalises by them."""

    def __init__(self, width: int) -> None:
        """Take the number of columns."""
        self.count = 0
        self._mean, self._squares = np.zeros(width), np.zeros(width)
        self._low, self._high = np.full(width, np.inf), np.full(width, -np.inf)
        self._sample = np.empty((0, width))
        self._step = 1

    def take(self, rows: FloatArray) -> None:
        """Take the next finite rows, shape (n, width), n at least 1."""
        with np.errstate(over="ignore", invalid="ignore"):  # of squares squares of numbers beyond 1e154
            self._take(rows)

    def _take(self, rows: FloatArray) -> None:
        count, mean = len(rows), rows.mean(axis=0)
        total, shift = self.count + count, mean - self._mean
        self._squares += ((rows - mean) ** 2).sum(axis=0) + shift**2 * (self.count * count / total)
        self._mean += shift * (count / total)
        self._low, self._high = np.minimum(self._low, rows.min(axis=0)), np.maximum(self._high, rows.max(axis=0))
        self._sample = np.concatenate([self._sample, rows[-self.count % self._step :: self._step]])
        self.count = total
        while len(self._sample) > _MAX_SAMPLE:
            self._sample, self._step = self._sample[::2], 2 * self._step

    @property
    def found(self) -> dict[str, FloatArray]:
        """Statistics of each column by LeRobot's names; one that overflowed is the largest double."""
        moments = {
            "min": self._low,
            "max": self._high,
            "mean": self._mean,
            "std": np.sqrt(self._squares / self.count),
        }
        with np.errstate(over="ignore", invalid="ignore"):
            quantiles = np.quantile(self._sample, QUANTILES, axis=0)
        named = moments | {f"q{100 * q:02.0f}": row for q, row in zip(QUANTILES, quantiles, strict=True)}
        return {name: np.nan_to_num(row) for name, row in named.items()}

    def by_feature(self, features: "Sequence[_Feature]") -> dict[str, dict[str, list[Any]]]:
        """Return the statistics of each feature as LeRobot keeps them, by name, and the number of frames."""
        ends, found = np.cumsum([len(each.names) for each in features]), self.found
        return {
            each.name: {kind: row[end - len(each.names) : end].tolist() for kind, row in found.items()}
            | {"count": [self.count]}
            for each, end in zip(features, ends, strict=True)
        }


@dataclass(frozen=True, slots=True, eq=False)
class _Feature:
    """A feature.

    Attributes:
        name: Name of the feature.
        dtype: Type of the components, as numpy and LeRobot call it.
        names: Names of the components, the unit at their end.
        columns: Columns of the components in the rows of a log.
        codes: Names of the values 0, 1, ... of an enumeration; empty for numbers.
    """

    name: str
    dtype: str
    names: tuple[str, ...]
    columns: npt.NDArray[np.int64]
    codes: tuple[str, ...] = ()

    @property
    def info(self) -> dict[str, object]:
        """Entry in info.json."""
        codes = {"codes": list(self.codes)} if self.codes else {}
        return {"dtype": self.dtype, "shape": [len(self.names)], "names": list(self.names), **codes}


def _features_of(codec: PeriodCodec) -> tuple[_Feature, ...]:
    """Return the features of a log."""
    state, action, others = [], [], []
    with_hand = codec.heading.layout.hand_joints is not None
    for group, quantity in walk(codec.groups):
        path = path_of(group, quantity)
        if group.name in ("arm", "hand") and quantity.name != "time":
            state.append((path, quantity))
        elif group.name == _COMMAND and quantity.dtype == "<f8":
            action += [(path, quantity)] if with_hand or path != _GRIPS else []
        elif path != _GRIP_COUNT or with_hand:
            others.append(_feature(_name(group, quantity), [(path, quantity)], codec))
    return (_feature("observation.state", state, codec), _feature("action", action, codec), *others)


class _FiniteRows:
    """Rows of a log without NaN, from which policies cannot learn.

    Grip forces that a command does not change are those of the command before. Other numbers that are not finite,
    such as a centroid without contact, become 0.
    """

    def __init__(self, codec: PeriodCodec) -> None:
        """Take the codec of a log."""
        self._grips, self._count = codec.columns[_GRIPS], codec.columns[_GRIP_COUNT].start
        self._before = np.zeros(self._grips.stop - self._grips.start)

    def of(self, rows: FloatArray) -> FloatArray:
        """Return the next rows, shape (n, width)."""
        finite = np.where(np.isfinite(rows), rows, 0.0)
        given = np.where(rows[:, self._count] >= 0.0, np.arange(1, len(rows) + 1), 0)
        finite[:, self._grips] = np.vstack([self._before, finite[:, self._grips]])[np.maximum.accumulate(given)]
        self._before = finite[-1, self._grips]
        return finite


def _name(group: LogGroup, quantity: LogField) -> str:
    path = path_of(group, quantity)
    hidden = group.name in ("", TRUTH, _COMMAND) or quantity.name == "time" or quantity.dtype != "<f8"
    return path if hidden else f"observation.{path}"


def _feature(name: str, parts: list[tuple[str, LogField]], codec: PeriodCodec) -> _Feature:
    names = [each for path, quantity in parts for each in named_components(path.replace(".", "_"), quantity)]
    places = [np.arange(codec.columns[path].start, codec.columns[path].stop) for path, _ in parts]
    quantity = parts[0][1]
    return _Feature(name, dtype_of(quantity).name, tuple(names), np.concatenate(places), quantity.codes)


def _data_place(number: int) -> dict[str, int]:
    """Return the numbers in the path of a data file, for `PLACE`."""
    chunk, file = divmod(number, _FILES_PER_FOLDER)
    return {"chunk_index": chunk, "file_index": file}


def _write_meta(folder: Path, dataset: _Dataset) -> None:
    arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")  # they have no types
    meta = folder / "meta"
    episodes = meta / "episodes" / PLACE.format(chunk_index=0, file_index=0)
    episodes.parent.mkdir(parents=True)
    parquet.write_table(_episodes(arrow, dataset), episodes)
    parquet.write_table(_tasks(arrow, dataset.tasks), meta / "tasks.parquet")
    _write_json(meta / "stats.json", dataset.statistics.by_feature(dataset.features))
    _write_json(meta / "info.json", _info(dataset))


def _episodes(arrow: Any, dataset: _Dataset) -> Any:
    columns = {name: [row[name] for row in dataset.episodes] for name in dataset.episodes[0]}
    for kind, facts in dataset.facts.items():
        columns |= {f"{kind}/{column.name}": column.values.tolist() for column in fact_columns(facts)}
    return arrow.table(columns)


def _tasks(arrow: Any, tasks: Mapping[str, int]) -> Any:
    """Return the table of tasks, which LeRobot reads by pandas with the task as its index."""
    table = arrow.table({"task_index": list(tasks.values()), "task": list(tasks)})
    kinds = {"task_index": ("int64", "int64"), "task": ("unicode", "object")}
    pandas = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": numpy, "metadata": None}
            for name, (kind, numpy) in kinds.items()
        ],
    }
    return table.replace_schema_metadata({"pandas": json.dumps(pandas)})


def _info(dataset: _Dataset) -> dict[str, object]:
    rate = 1.0 / dataset.period
    whole = abs(rate - round(rate)) <= _RATE_TOLERANCE * rate
    return {
        "codebase_version": "v3.0",
        "robot_type": dataset.robot,
        "total_episodes": len(dataset.episodes),
        "total_frames": dataset.frames,
        "total_tasks": len(dataset.tasks),
        "chunks_size": _FILES_PER_FOLDER,
        "data_files_size_in_mb": _FILE_MEGABYTES,
        "video_files_size_in_mb": 200,
        "fps": round(rate) if whole else rate,
        "splits": {"train": f"0:{len(dataset.episodes)}"},
        "data_path": f"data/{PLACE}",
        "video_path": None,
        "features": {each.name: each.info for each in dataset.features},
    }


def _write_json(path: Path, value: object) -> None:
    path.write_text(json.dumps(value, indent=4, ensure_ascii=False), encoding="utf-8")
