"""A data set as tables: period, event and parameter, with the episode in their first column, and episodes."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import ClassVar, Protocol

from palpate.errors import InvalidValueError
from palpate.exporting.exporter import Episode, Exporter, Fact
from palpate.exporting.tables import Table, event_table, fact_columns, parameter_table, period_tables


class TableFile(Protocol):
    """A table that is being written."""

    def append(self, table: Table) -> None:
        """Write rows; the first table says which columns there are."""
        ...


class TableExporter(Exporter):
    """Base of formats that are tables; one of them says how a table is opened.

    Attributes:
        SUFFIX: Of its files.
    """

    __slots__ = ()
    METHODS = ("opened",)
    SUFFIX: ClassVar[str]

    def opened(self, path: Path) -> AbstractContextManager[TableFile]:
        """Return a new table."""
        raise NotImplementedError

    def write(self, episodes: Iterator[Episode], folder: Path) -> None:
        """See `Exporter`."""
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
