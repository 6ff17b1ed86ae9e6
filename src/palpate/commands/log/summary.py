"""What is in a log, as tables for the terminal."""

from datetime import datetime

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from palpate.commands.log.times import LogTimes
from palpate.plain_text import inert
from palpate.runtime.log import Level, LogReader
from palpate.runtime.log.fields import LogField
from palpate.runtime.rest import rest_in

VERSIONS = "versions.yaml"
"""The attachment that is shown whole."""

_SHOWN = 50
"""Events; more are in the export."""


def lost_records(log: LogReader) -> str:
    """Return which records a log has lost, as far as it knows itself; empty if none."""
    missing = ""
    if log.missing:
        missing = f"{log.missing} MISSING in {log.gaps} places, the first after period {log.first_gap}"
    reported = [event.text for event in log.events if event.source == "recorder" and event.level >= Level.WARN]
    return "; ".join([missing] * bool(missing) + reported)


def log_summary(log: LogReader, times: LogTimes, size: int) -> RenderableType:
    """Return tables about a log that was read, whose file has `size` bytes."""
    parts: list[RenderableType] = [_facts(log, times, size), _topics(log)]
    if log.events:
        parts.append(_events(log))
    if VERSIONS in log.attachments:
        parts += [
            Text(f"  {VERSIONS}"),
            *(Text("    " + inert(line)) for line in log.attachments[VERSIONS].strip().split("\n")),
        ]
    return Group(*parts)


def _facts(log: LogReader, times: LogTimes, size: int) -> Table:
    heading = log.codec.heading
    start = datetime.fromtimestamp(heading.wall_start / 1e9).astimezone()
    table = _table(Text(str(log.path)), ("", ""))
    table.show_header = False
    facts = {
        "records": _records(log),
        "recorded": f"{start:%Y-%m-%d %H:%M:%S %z} by {heading.written_by}",
        "state": _state(log),
        "periods": f"{log.periods}, nominally every {1e3 * heading.period:g} ms",
        "at the end": str(rest_in(log.events)),
        "size": f"{size / 1e6:.2f} MB",
    }
    if log.periods > 1:
        facts |= _timing(times)
    facts["attachments"] = ", ".join(log.attachments) or "none"
    for name, text in facts.items():
        table.add_row(name, Text(inert(text)))
    return table


def _records(log: LogReader) -> str:
    if lost := lost_records(log):
        return f"LOST: {lost}"
    return "none was lost" if log.complete else "none is missing up to where the log ends"


def _state(log: LogReader) -> str:
    if log.damage:
        return f"DAMAGED: {log.damage_words}"
    if not log.complete:
        return "not finished: its process was killed, or is still writing; all that is there was read"
    return "complete, every check sum is right"


def _timing(times: LogTimes) -> dict[str, str]:
    facts = {"duration": f"{times.duration:.3f} s"}
    if 0.0 < times.duration < np.inf:
        facts["duration"] += f", {times.numbers / times.duration:.4g} periods per second"
    for name, spread in times.spreads.items():
        median, high, most = 1e6 * np.array([spread.p50, spread.p99, spread.largest])
        facts[name] = f"median {median:.0f}, 99 % {high:.0f}, longest {most:.0f} µs"
    return facts


def _topics(log: LogReader) -> Table:
    table = _table(None, ("topic", "messages", "fields"))
    table.add_row("/period", str(log.periods), "")
    for group in log.codec.groups:
        fields = Text(", ".join(_named(quantity) for quantity in group.fields))
        table.add_row(Text(f"  {inert(group.name)}") if group.name else "", "", fields)
    table.add_row("/event", str(len(log.events)), Text("time [s], level, source, text"))
    table.add_row("/parameter", str(len(log.changes)), Text("time [s], name, value"))
    return table


def _named(quantity: LogField) -> str:
    shape = f"({quantity.count})" if quantity.is_vector else ""
    units = ", ".join(dict.fromkeys(unit for unit in quantity.units if unit))
    return inert(f"{quantity.name}{shape}" + (f" [{units}]" if units else ""))


def _events(log: LogReader) -> Table:
    table = _table(None, ("after [s]", "level", "source", "event"))
    start = log.codec.heading.first_time
    styles = {Level.WARN: "yellow", Level.ERROR: "red", Level.FATAL: "red"}
    for event in log.events[-_SHOWN:]:
        level = Text(event.level.name, style=styles.get(event.level, ""))
        table.add_row(f"{event.time - start:.3f}", level, Text(inert(event.source)), Text(inert(event.text)))
    if len(log.events) > _SHOWN:
        table.caption = f"the last {_SHOWN} of {len(log.events)}"
    return table


def _table(title: Text | None, headings: tuple[str, ...]) -> Table:
    table = Table(title=title, box=SIMPLE_HEAD, title_justify="left", title_style="bold", caption_justify="left")
    for heading in headings:
        table.add_column(Text(heading), overflow="fold")
    return table
