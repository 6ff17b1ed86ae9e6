"""A LeRobot dataset, v3.0: an episode a run, a frame a period.

Format: `LeRobotDataset` of the package lerobot 0.4.4, CODEBASE_VERSION v3.0. In data/ each Parquet file holds the
frames of many episodes; meta/ holds a table of the episodes, one of the tasks, stats.json and info.json.
"""

from collections.abc import Iterator
from contextlib import ExitStack
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from palpate.errors import FloatArray, InvalidValueError
from palpate.exporting.exporter import Episode, Exporter
from palpate.exporting.lerobot.features import Feature, FiniteRows, features_of
from palpate.exporting.lerobot.meta import MEGABYTES, PLACE, WrittenEpisode, data_place, write_meta
from palpate.exporting.parquet_tables import ParquetFile
from palpate.extras import require
from palpate.open_kinds import Settings

QUANTILES = (0.01, 0.10, 0.50, 0.90, 0.99)
"""Those that LeRobot has."""

_SAMPLE = 20_000
"""Most rows that quantiles are of: evenly spaced ones, of a longer log; their error in rank is below 0.01 %."""


class RunningStatistics:
    """Statistics of columns that come in pieces, in bounded memory, as LeRobot normalises by them."""

    def __init__(self, width: int) -> None:
        """Take the number of columns."""
        self.count = 0
        self._mean, self._squares = np.zeros(width), np.zeros(width)
        self._low, self._high = np.full(width, np.inf), np.full(width, -np.inf)
        self._sample = np.empty((0, width))
        self._step = 1

    def take(self, rows: FloatArray) -> None:
        """Take the next finite rows, shape (n, width), n at least 1."""
        with np.errstate(over="ignore", invalid="ignore"):  # of squares of what is beyond 1e154
            self._take(rows)

    def _take(self, rows: FloatArray) -> None:
        count, mean = len(rows), rows.mean(axis=0)
        total, shift = self.count + count, mean - self._mean
        self._squares += ((rows - mean) ** 2).sum(axis=0) + shift**2 * (self.count * count / total)
        self._mean += shift * (count / total)
        self._low, self._high = np.minimum(self._low, rows.min(axis=0)), np.maximum(self._high, rows.max(axis=0))
        self._sample = np.concatenate([self._sample, rows[-self.count % self._step :: self._step]])
        self.count = total
        while len(self._sample) > _SAMPLE:
            self._sample, self._step = self._sample[::2], 2 * self._step

    @property
    def found(self) -> dict[str, FloatArray]:
        """Each statistic of each column, by LeRobot's names; one that overflowed is the largest double."""
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


ADDED = {"timestamp": "float32"} | dict.fromkeys(("frame_index", "episode_index", "index", "task_index"), "int64")
"""Features that every dataset has, with their types."""


class LeRobotExporter(Exporter, Settings, frozen=True):
    """The files keep every bit of every finite number; LeRobot's loader makes float32 of them."""

    def write(self, episodes: Iterator[Episode], folder: Path) -> None:
        """See `Exporter`."""
        require("pyarrow", "parquet", "--to lerobot")
        dataset: Dataset | None = None
        with ExitStack() as files:
            for episode in episodes:
                if dataset is None:
                    dataset = Dataset(folder, episode, files)
                dataset.add(episode)
        if dataset is None or not dataset.episodes:
            raise InvalidValueError("no log has a period, and a LeRobot dataset has at least one frame")
        write_meta(folder, dataset)


class Dataset:
    """The frames of a dataset that grows.

    Attributes:
        features: In the order of their columns.
        period: Between two frames [s].
        robot: Named by the first episode; None if it names none.
        episodes: What has been written.
        tasks: Number of each task.
        statistics: Of all frames.
    """

    def __init__(self, folder: Path, first: Episode, files: ExitStack) -> None:
        """Prepare.

        Args:
            folder: To write in.
            first: The episode that all others must be like.
            files: Closes them.
        """
        codec = first.log.codec
        added = enumerate(ADDED.items(), codec.width)
        self.features = (
            *features_of(codec),
            *(Feature(name, dtype, (name,), np.array([column])) for column, (name, dtype) in added),
        )
        self.period, self.robot = codec.heading.period, first.settings.get("robot")
        self.episodes: list[WrittenEpisode] = []
        self.tasks: dict[str, int] = {}
        self._columns = np.concatenate([each.columns for each in self.features])
        self.statistics = RunningStatistics(len(self._columns))
        self._folder, self._files = folder, files
        self._arrow: Any = import_module("pyarrow")  # it has no types
        self._file, self._data = 0, self._opened(0)

    def add(self, episode: Episode) -> None:
        """Write the frames of an episode; one without periods is left out.

        Raises:
            InvalidValueError: It has other features or another period than the first.
        """
        self._check(episode)
        if self.episodes and self._data.path.stat().st_size >= MEGABYTES << 20:
            self._file += 1
            self._data = self._opened(self._file)
        start = self.episodes[-1].end if self.episodes else 0
        finite, statistics = FiniteRows(episode.log.codec), RunningStatistics(len(self._columns))
        first = 0
        for piece in episode.rows():
            if statistics.count == 0:
                first = int(piece.sequence[0])
            task = self.tasks.setdefault(episode.task, len(self.tasks))
            frame = np.zeros((len(piece.sequence), len(ADDED)))
            frame[:, 0] = self.period * (piece.sequence - first)
            frame[:, 1] = np.arange(statistics.count, statistics.count + len(frame))
            frame[:, 2], frame[:, 3], frame[:, 4] = len(self.episodes), start + frame[:, 1], task
            values = np.hstack([finite.of(piece.values), frame])[:, self._columns]
            statistics.take(values)
            self.statistics.take(values)
            self._data.append_arrow(self._table(values))
        if statistics.count:
            self.episodes.append(
                WrittenEpisode(
                    episode.log.path.name,
                    episode.task,
                    episode.settings,
                    episode.results,
                    start,
                    start + statistics.count,
                    self._file,
                    statistics.found,
                )
            )

    def _check(self, episode: Episode) -> None:
        codec = episode.log.codec
        own = {each.name: each.info for each in features_of(codec)}
        known = {each.name: each.info for each in self.features}
        odd = [name for name in {**known, **own} if own.get(name) != known.get(name) and name not in ADDED]
        if codec.heading.period != self.period:
            odd.append(f"a period of {codec.heading.period:g} s instead of {self.period:g} s")
        if odd:
            raise InvalidValueError(
                f"{episode.log.path}: differs from the first log in {', '.join(odd[:5])}: a LeRobot dataset has "
                "one set of features at one rate; export them apart, or --to hdf5"
            )

    def _opened(self, number: int) -> ParquetFile:
        path = self._folder / "data" / PLACE.format(**data_place(number))
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
