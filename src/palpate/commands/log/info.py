"""`palpate log info`: contents of the log of a run, as tables for the terminal and as values."""

from dataclasses import replace
from datetime import datetime
from pathlib import Path

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from palpate.commands.command_result import CommandResult
from palpate.commands.log.config import LogInfoConfig
from palpate.plain_text import inert
from palpate.runtime.log import Level, LogReader, log_in
from palpate.runtime.log.chunk import LogRows
from palpate.runtime.log.fields import LogField
from palpate.runtime.log.period_codec import PeriodCodec
from palpate.runtime.progress import progress_bar
from palpate.runtime.rest import rest_in
from palpate.runtime.times import Times
from palpate.runtime.timing import Distribution
from palpate.strict_yaml import read_yaml

BAR_DELAY = 2.0
"""Longest work that is done without a progress bar [s]."""

_VERSIONS = "versions.yaml"
"""Attachment that is shown whole."""

_MAX_EVENTS = 50
"""Largest number of events that are shown; all are in the export."""

_MAX_TIME = 1e9
"""Largest time that counts in the statistics [s], thirty years; a broken clock gives larger ones."""


def run_log_info(config: LogInfoConfig) -> CommandResult:
    """Print and return the contents of a log.

    Raises:
        InvalidValueError: If there is no log, or nothing of it can be read.
        OSError: If it cannot be opened.
    """
    path = resolved_log(config.log)
    size = path.stat().st_size
    with (
        LogReader(path) as log,
        progress_bar(Console(stderr=True), f"reading {path.name}", after=BAR_DELAY) as bar,
    ):
        times = LogTimes(log.codec)
        for piece in log.pieces(bar.show):
            times.take(piece)
    return replace(_result(log, times, size), shown=(log_summary(log, times, size),))


def resolved_log(place: Path) -> Path:
    """Return the log of a file or folder; of a link, the run's own name."""
    return log_in(place).resolve()


class LogTimes:
    """Times of the periods of a log, read piece by piece.

    Attributes:
        duration: Time from the first to the last period [s]; meaningless if the clock was broken.
        numbers: Number of periods between the first and the last, missing ones included.
    """

    def __init__(self, codec: PeriodCodec) -> None:
        """Take the codec of the log."""
        self.duration, self.numbers = 0.0, 0
        self._first, self._last = (0, 0.0), (-2, 0.0)  # number and time
        self._columns = [codec.columns[name].start for name in ("time", "compute_time", "lateness")]
        sampled = [name for name in codec.columns if name.endswith(".time")]
        self._sampled = [codec.columns[name].start for name in sampled]
        ages = (f"age of {name.removesuffix('.time')}" for name in sampled)
        self._times = {name: Times() for name in ("sample to sample", "compute time", "lateness", *ages)}

    def take(self, piece: LogRows) -> None:
        """Take the next periods."""
        time, compute, late = piece.values[:, self._columns].T
        if self._last[0] < 0:
            self._first = (int(piece.sequence[0]), float(time[0]))
        with np.errstate(over="ignore", invalid="ignore"):
            steps = np.diff(time, prepend=self._last[1])[np.diff(piece.sequence, prepend=self._last[0]) == 1]
            self.duration = float(time[-1] - self._first[1])
            ages = time - piece.values[:, self._sampled].T
        self._last = (int(piece.sequence[-1]), float(time[-1]))
        self.numbers = self._last[0] - self._first[0]
        for times, new in zip(self._times.values(), (steps, compute, late, *ages), strict=True):
            times.extend(new[np.abs(new) < _MAX_TIME])

    @property
    def spreads(self) -> dict[str, Distribution]:
        """Distribution of each kind of time that the log has, times of a broken clock left out."""
        return {name: Distribution.of(times) for name, times in self._times.items() if len(times)}


def _lost_records(log: LogReader) -> str:
    """Return the records that a log has lost, as far as it knows itself; empty if none."""
    missing = ""
    if log.missing:
        missing = f"{log.missing} MISSING in {log.gaps} places, the first after period {log.first_gap}"
    reported = [event.text for event in log.events if event.source == "recorder" and event.level >= Level.WARN]
    return "; ".join([missing] * bool(missing) + reported)


def _state(log: LogReader) -> str:
    if log.damage:
        return f"DAMAGED: {log.damage_words}"
    if not log.complete:
        return "not finished: its process was killed, or is still writing; all that is there was read"
    return "complete, every check sum is right"


def _start(log: LogReader) -> datetime:
    return datetime.fromtimestamp(log.codec.heading.wall_start / 1e9).astimezone()


def _result(log: LogReader, times: LogTimes, size: int) -> CommandResult:
    heading, lost, versions = log.codec.heading, _lost_records(log), log.attachments.get(_VERSIONS)
    metrics: dict[str, object] = {
        "periods": log.periods,
        "period_s": heading.period,
        "missing_periods": log.missing,
        "size_bytes": size,
    }
    if log.periods > 1:
        metrics["duration_s"] = times.duration
        for words, spread in times.spreads.items():
            name = words.replace(" ", "_")
            metrics[f"{name}_p50_s"] = spread.p50
            metrics[f"{name}_p99_s"] = spread.p99
            metrics[f"{name}_largest_s"] = spread.largest
    return CommandResult(
        outcome="; ".join([f"records were lost: {lost}"] * bool(lost) + [_state(log)]),
        metrics=metrics,
        facts={
            "log": log.path,
            "recorded": _start(log).isoformat(),
            "written_by": heading.written_by,
            "rest": rest_in(log.events),
            "complete": log.complete and not lost,
            "fields": [
                {"topic": group.name or "period", "name": each.name, "count": each.count, "units": each.units}
                for group in log.codec.groups
                for each in group.fields
            ],
            "events": [
                {
                    "time_s": event.time - heading.first_time,
                    "level": event.level.name,
                    "source": event.source,
                    "text": event.text,
                }
                for event in log.events
            ],
            "attachments": tuple(log.attachments),
            "versions": None if versions is None else read_yaml(versions),
        },
        warnings=() if log.damage_words is None else (log.damage_words,),
    )


def log_summary(log: LogReader, times: LogTimes, size: int) -> RenderableType:
    """Return tables about a log that was read, whose file has `size` bytes."""
    parts: list[RenderableType] = [_facts(log, times, size), _topics(log)]
    if log.events:
        parts.append(_events(log))
    if _VERSIONS in log.attachments:
        lines = log.attachments[_VERSIONS].strip().split("\n")
        parts += [Text(f"  {_VERSIONS}"), *(Text("    " + inert(line)) for line in lines)]
    return Group(*parts)


def _facts(log: LogReader, times: LogTimes, size: int) -> Table:
    heading, lost = log.codec.heading, _lost_records(log)
    records = "none was lost" if log.complete else "none is missing up to where the log ends"
    facts = {
        "records": f"LOST: {lost}" if lost else records,
        "recorded": f"{_start(log):%Y-%m-%d %H:%M:%S %z} by {heading.written_by}",
        "state": _state(log),
        "periods": f"{log.periods}, nominally every {1e3 * heading.period:g} ms",
        "at the end": str(rest_in(log.events)),
        "size": f"{size / 1e6:.2f} MB",
    }
    if log.periods > 1:
        facts["duration"] = f"{times.duration:.3f} s"
        if 0.0 < times.duration < np.inf:
            facts["duration"] += f", {times.numbers / times.duration:.4g} periods per second"
        for name, spread in times.spreads.items():
            median, high, most = 1e6 * np.array([spread.p50, spread.p99, spread.largest])
            facts[name] = f"median {median:.0f}, 99 % {high:.0f}, longest {most:.0f} µs"
    facts["attachments"] = ", ".join(log.attachments) or "none"
    table = _table(Text(str(log.path)), ("", ""))
    table.show_header = False
    for name, text in facts.items():
        table.add_row(name, Text(inert(text)))
    return table


def _topics(log: LogReader) -> Table:
    table = _table(None, ("topic", "messages", "fields"))
    table.add_row("/period", str(log.periods), "")
    for group in log.codec.groups:
        fields = Text(", ".join(map(_field_text, group.fields)))
        table.add_row(Text(f"  {inert(group.name)}") if group.name else "", "", fields)
    table.add_row("/event", str(len(log.events)), Text("time [s], level, source, text"))
    table.add_row("/parameter", str(len(log.changes)), Text("time [s], name, value"))
    return table


def _field_text(field: LogField) -> str:
    shape = f"({field.count})" if field.is_vector else ""
    units = ", ".join(dict.fromkeys(unit for unit in field.units if unit))
    return inert(f"{field.name}{shape}" + (f" [{units}]" if units else ""))


def _events(log: LogReader) -> Table:
    table = _table(None, ("after [s]", "level", "source", "event"))
    start = log.codec.heading.first_time
    styles = {Level.WARN: "yellow", Level.ERROR: "red", Level.FATAL: "red"}
    for event in log.events[-_MAX_EVENTS:]:
        level = Text(event.level.name, style=styles.get(event.level, ""))
        table.add_row(f"{event.time - start:.3f}", level, Text(inert(event.source)), Text(inert(event.text)))
    if len(log.events) > _MAX_EVENTS:
        table.caption = f"the last {_MAX_EVENTS} of {len(log.events)}"
    return table


def _table(title: Text | None, headings: tuple[str, ...]) -> Table:
    table = Table(title=title, box=SIMPLE_HEAD, title_justify="left", title_style="bold", caption_justify="left")
    for heading in headings:
        table.add_column(Text(heading), overflow="fold")
    return table
