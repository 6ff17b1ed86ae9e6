"""The folder meta/ of a LeRobot dataset: episodes, tasks, statistics, features."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate.errors import FloatArray
from palpate.exporting.exporter import Fact
from palpate.exporting.lerobot.features import Feature
from palpate.exporting.tables import fact_columns

if TYPE_CHECKING:
    from palpate.exporting.lerobot.dataset import Dataset

VERSION = "v3.0"

FILES_PER_FOLDER, MEGABYTES = 1000, 100
"""Data files in a folder, and size of each: LeRobot's own."""

PLACE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"

WHOLE = 1e-9
"""Relative difference from a whole number below which a rate is one: periods are decimal fractions."""


@dataclass(frozen=True, slots=True, eq=False)
class WrittenEpisode:
    """What is kept of an episode.

    Attributes:
        log: Name of its log.
        task: See `Episode`,
        settings: as here,
        results: and here.
        start: Index of its first frame in the dataset,
        end: and of the one behind its last.
        file: Number of its data file.
        statistics: See `RunningStatistics.found`.
    """

    log: str
    task: str
    settings: Mapping[str, Fact]
    results: Mapping[str, Fact]
    start: int
    end: int
    file: int
    statistics: Mapping[str, FloatArray]


def data_place(number: int) -> dict[str, int]:
    """Return what fills `PLACE` in for a data file."""
    chunk, file = divmod(number, FILES_PER_FOLDER)
    return {"chunk_index": chunk, "file_index": file}


def write_meta(folder: Path, dataset: "Dataset") -> None:
    """Write the folder."""
    arrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")  # they have no types
    meta = folder / "meta"
    episodes = meta / "episodes" / PLACE.format(chunk_index=0, file_index=0)
    episodes.parent.mkdir(parents=True)
    parquet.write_table(_episodes(arrow, dataset), episodes)
    parquet.write_table(_tasks(arrow, dataset.tasks), meta / "tasks.parquet")
    found = by_feature(dataset.statistics.found, dataset.features)
    counted = {name: each | {"count": [dataset.statistics.count]} for name, each in found.items()}
    _write_json(meta / "stats.json", counted)
    _write_json(meta / "info.json", _info(dataset))


def by_feature(
    statistics: Mapping[str, FloatArray], features: Sequence[Feature]
) -> dict[str, dict[str, list[float]]]:
    """Return the statistics of columns as LeRobot keeps them: of each feature, of each kind, of each component."""
    ends = np.cumsum([len(each.names) for each in features])
    return {
        feature.name: {kind: row[end - len(feature.names) : end].tolist() for kind, row in statistics.items()}
        for feature, end in zip(features, ends, strict=True)
    }


def _episodes(arrow: Any, dataset: "Dataset") -> Any:
    written = dataset.episodes
    columns: dict[str, Any] = {
        "episode_index": list(range(len(written))),
        "tasks": [[each.task] for each in written],
        "length": [each.end - each.start for each in written],
        "dataset_from_index": [each.start for each in written],
        "dataset_to_index": [each.end for each in written],
        "meta/episodes/chunk_index": [0] * len(written),
        "meta/episodes/file_index": [0] * len(written),
        "log": [each.log for each in written],
    }
    for name in ("chunk_index", "file_index"):
        columns[f"data/{name}"] = [data_place(each.file)[name] for each in written]
    for kind in ("settings", "results"):
        for column in fact_columns([getattr(each, kind) for each in written]):
            columns[f"{kind}/{column.name}"] = column.values.tolist()
    statistics = [by_feature(each.statistics, dataset.features) for each in written]
    for feature in dataset.features:
        for kind in dataset.episodes[0].statistics:
            columns[f"stats/{feature.name}/{kind}"] = [each[feature.name][kind] for each in statistics]
        columns[f"stats/{feature.name}/count"] = [[each.end - each.start] for each in written]
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


def _info(dataset: "Dataset") -> dict[str, object]:
    rate = 1.0 / dataset.period
    whole = abs(rate - round(rate)) <= WHOLE * rate
    return {
        "codebase_version": VERSION,
        "robot_type": dataset.robot,
        "total_episodes": len(dataset.episodes),
        "total_frames": dataset.episodes[-1].end,
        "total_tasks": len(dataset.tasks),
        "chunks_size": FILES_PER_FOLDER,
        "data_files_size_in_mb": MEGABYTES,
        "video_files_size_in_mb": 200,
        "fps": round(rate) if whole else rate,
        "splits": {"train": f"0:{len(dataset.episodes)}"},
        "data_path": f"data/{PLACE}",
        "video_path": None,
        "features": {each.name: each.info for each in dataset.features},
    }


def _write_json(path: Path, value: object) -> None:
    path.write_text(json.dumps(value, indent=4, ensure_ascii=False), encoding="utf-8")
