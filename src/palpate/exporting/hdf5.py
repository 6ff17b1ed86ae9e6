"""Logs as HDF5, by h5py: a group per run with the log's quantities as arrays, with units and meaning."""

from collections.abc import Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from palpate.exporting.exporter import Episode, Exporter, Fact
from palpate.exporting.tables import Table, dtype_of, event_table, parameter_table
from palpate.extras import require
from palpate.open_kinds import Settings
from palpate.runtime.log.fields import LogField, path_of, walk
from palpate.version import __version__

_FILE = "episodes.hdf5"

_CHUNK = 1000
"""Number of periods that are compressed together: 8 to 100 kB."""

_CACHE = 1 << 16
"""Bytes that HDF5 caches of each array: arrays are written from begin to end, and a log has a hundred."""

_SLOTS = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
"""Filters that every build of HDF5 has."""


class Hdf5Exporter(Exporter, Settings, frozen=True):
    """One file with a group for each episode; every bit of every number, codes as enumerations with names."""

    def write(self, episodes: Iterator[Episode], folder: Path) -> None:
        """Write one file."""
        require("h5py", "hdf5", "--to hdf5")
        h5py: Any = import_module("h5py")  # it has no types
        with h5py.File(folder / _FILE, "w", rdcc_nbytes=_CACHE) as file:
            file.attrs["written_by"] = f"palpate {__version__}"
            for index, episode in enumerate(episodes):
                group = file.create_group(f"episode_{index:06d}")
                group.attrs["log"], group.attrs["task"] = episode.log.path.name, episode.task
                _note(group.create_group("settings"), episode.settings)
                _note(group.create_group("results"), episode.results)
                _write_periods(h5py, group.create_group("period"), episode)
                _write_table(h5py, group.create_group("event"), event_table(episode.log.events, index))
                _write_table(h5py, group.create_group("parameter"), parameter_table(episode.log.changes, index))
                for name, text in episode.log.attachments.items():
                    group.create_dataset(f"attachment/{name}", data=text)


def _write_periods(h5py: Any, group: Any, episode: Episode) -> None:
    codec = episode.log.codec
    sequence = _array(group, "sequence", (), np.dtype(np.int64))
    arrays = {}
    for part, quantity in walk(codec.groups):
        path = path_of(part, quantity)
        shape = (quantity.count,) if quantity.is_vector else ()
        array = _array(group, path.replace(".", "/"), shape, _dtype(h5py, quantity))
        arrays[path] = array
        array.attrs["meaning"] = quantity.comment
        if any(quantity.units):
            array.attrs["unit"] = list(quantity.units) if shape else quantity.units[0]
        if shape:
            array.attrs["components"] = list(quantity.components)
    for piece in episode.rows():
        _append(sequence, piece.sequence)
        for path, array in arrays.items():
            values = piece.values[:, codec.columns[path]]
            _append(array, values if array.ndim > 1 else values[:, 0])


def _dtype(h5py: Any, quantity: LogField) -> Any:
    if not quantity.codes:
        return dtype_of(quantity)
    return h5py.enum_dtype({name: value for value, name in enumerate(quantity.codes)}, basetype=quantity.dtype)


def _array(group: Any, name: str, shape: tuple[int, ...], dtype: Any) -> Any:
    chunks = (_CHUNK, *shape)
    return group.create_dataset(name, (0, *shape), maxshape=(None, *shape), dtype=dtype, chunks=chunks, **_SLOTS)


def _append(array: Any, values: npt.NDArray[Any]) -> None:
    before = len(array)
    array.resize(before + len(values), axis=0)
    array[before:] = values.astype(array.dtype)


def _write_table(h5py: Any, group: Any, table: Table) -> None:
    for column in table[1:]:  # without the episode, which is the group
        dtype = h5py.string_dtype() if column.is_text else column.values.dtype
        group.create_dataset(column.name, data=column.values, dtype=dtype)


def _note(group: Any, facts: Mapping[str, Fact]) -> None:
    for name, value in facts.items():
        group.attrs[name] = "" if value is None else value
