"""Logged runs as tables: periods, events, changes of parameters, and the runs; the base of formats of tables."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Protocol

import numpy as np
import numpy.typing as npt

from palpate.errors import InvalidValueError
from palpate.exporting.exporter import Episode, Exporter, Fact
from palpate.runtime.log import Change, Event, Level
from palpate.runtime.log.chunk import LogRows
from palpate.runtime.log.fields import LogField, path_of, walk
from palpate.runtime.log.period_codec import PeriodCodec


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """A column of a table.

    Attributes:
        name: Name with the unit, as in arm_position_x_m.
        values: Numbers, or texts as objects, shape (n,).
    """

    name: str
    values: npt.NDArray[Any]

    @property
    def is_text(self) -> bool:
        """Whether it holds texts."""
        return self.values.dtype == object


Table = tuple[Column, ...]


def period_tables(episode: Episode, index: int) -> Iterator[Table]:
    """Yield the table of an episode's periods in pieces, the first without rows."""
    codec = episode.log.codec
    yield _period_table(codec, LogRows(np.empty(0, np.int64), np.empty((0, codec.width))), index)
    for piece in episode.rows():
        yield _period_table(codec, piece, index)


def event_table(events: Sequence[Event], index: int) -> Table:
    """Return the events of an episode."""
    return (
        _indices(index, len(events)),
        Column("time_s", np.array([event.time for event in events], np.float64)),
        _texts("level", [Level(event.level).name for event in events]),
        _texts("source", [event.source for event in events]),
        _texts("text", [event.text for event in events]),
    )


def parameter_table(changes: Sequence[Change], index: int) -> Table:
    """Return the changes of live parameters of an episode."""
    return (
        _indices(index, len(changes)),
        Column("time_s", np.array([change.time for change in changes], np.float64)),
        _texts("name", [change.name for change in changes]),
        Column("value", np.array([change.value for change in changes], np.float64)),
    )


def fact_columns(facts: Sequence[Mapping[str, Fact]]) -> Table:
    """Return facts of episodes as columns, one row each: numbers, nan for a missing one, or else texts."""
    names = dict.fromkeys(name for each in facts for name in each)
    return tuple(_fact_column(name, [each.get(name) for each in facts]) for name in names)


def _fact_column(name: str, values: list[Fact]) -> Column:
    kinds = {type(value) for value in values}
    if kinds in ({bool}, {int}):
        return Column(name, np.array(values))
    if kinds <= {int, float, type(None)} and kinds != {type(None)}:
        return Column(name, np.array([np.nan if value is None else value for value in values], np.float64))
    return _texts(name, ["" if value is None else str(value) for value in values])


def _period_table(codec: PeriodCodec, piece: LogRows, index: int) -> Table:
    columns = [_indices(index, len(piece.sequence)), Column("sequence", piece.sequence)]
    for group, quantity in walk(codec.groups):
        path = path_of(group, quantity)
        columns += _columns(path.replace(".", "_"), quantity, piece.values[:, codec.columns[path]])
    return tuple(columns)


def _columns(name: str, quantity: LogField, values: npt.NDArray[np.float64]) -> Iterator[Column]:
    if quantity.codes:
        yield Column(name, np.array(quantity.codes, object)[values[:, 0].astype(int)])
        return
    for i, component in enumerate(named_components(name, quantity)):
        yield Column(component, values[:, i].astype(dtype_of(quantity)))


def named_components(name: str, quantity: LogField) -> list[str]:
    """Return a name for each component of a quantity, the unit at its end."""
    parts = zip(quantity.components, quantity.units, strict=True)
    return ["_".join(part for part in (name, each, unit.replace(" ", "")) if part) for each, unit in parts]


def dtype_of(quantity: LogField) -> np.dtype[Any]:
    """Return the type of a quantity's components as numbers."""
    return np.dtype("?" if quantity.ros_type == "bool" else quantity.dtype)


def _indices(index: int, count: int) -> Column:
    return Column("episode", np.full(count, index, np.int64))


def _texts(name: str, values: list[str]) -> Column:
    column = np.empty(len(values), object)
    column[:] = values
    return Column(name, column)


class TableFile(Protocol):
    """A table that is being written."""

    def append(self, table: Table) -> None:
        """Write rows; the first rows determine the columns."""
        ...


class TableExporter(Exporter):
    """Base of formats that are tables: period, event and parameter, which begin with the episode, and episodes.

    Attributes:
        SUFFIX: Suffix of the format's files.
    """

    __slots__ = ()
    METHODS = ("opened",)
    SUFFIX: ClassVar[str]

    def opened(self, path: Path) -> AbstractContextManager[TableFile]:
        """Return a new table."""
        raise NotImplementedError

    def write(self, episodes: Iterator[Episode], folder: Path) -> None:
        """Write one file per table."""
        facts: list[dict[str, Fact]] = []
        with ExitStack() as files:

            def table(name: str) -> TableFile:
                return files.enter_context(self.opened(folder / f"{name}{self.SUFFIX}"))

            period, event, parameter = table("period"), table("event"), table("parameter")
            columns: list[str] | None = None
            for index, episode in enumerate(episodes):
                for piece in period_tables(episode, index):
                    columns = _same_columns(columns, piece, episode)
                    period.append(piece)
                event.append(event_table(episode.log.events, index))
                parameter.append(parameter_table(episode.log.changes, index))
                named = {"log": episode.log.path.name, "task": episode.task}
                facts.append({"episode": index, **named, **episode.settings, **episode.results})
            table("episodes").append(fact_columns(facts))


def _same_columns(known: list[str] | None, table: Table, episode: Episode) -> list[str]:
    names = [column.name for column in table]
    if known is not None and names != known:
        other = sorted(set(names).symmetric_difference(known))
        raise InvalidValueError(
            f"{episode.log.path}: has other columns than the first log ({', '.join(other[:5])}): one table cannot "
            "hold both; export them apart, or --to hdf5"
        )
    return names
