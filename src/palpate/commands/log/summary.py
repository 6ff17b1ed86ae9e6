"""What is in a log, as tables for the terminal."""

from datetime import datetime

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from palpate.commands.log.times import log_duration, log_spreads
from palpate.plain_text import inert
from palpate.runtime.log import Level, Log
from palpate.runtime.log.fields import LogField
from palpate.runtime.rest import rest_in

VERSIONS = "versions.yaml"
"""The attachment that is shown whole."""

_SHOWN = 50
"""Events; more are in the export."""


def log_summary(log: Log, size: int) -> RenderableType:
    """Return tables about a log whose file has `size` bytes."""
    parts: list[RenderableType] = [_facts(log, size), _topics(log)]
    if log.events:
        parts.append(_events(log))
    if VERSIONS in log.attachments:
        parts += [
            Text(f"  {VERSIONS}"),
            *(Text("    " + inert(line)) for line in log.attachments[VERSIONS].strip().split("\n")),
        ]
    return Group(*parts)


def _facts(log: Log, size: int) -> Table:
    heading = log.heading
    start = datetime.fromtimestamp(heading.wall_start / 1e9).astimezone()
    table = _table(Text(str(log.path)), ("", ""))
    table.show_header = False
    facts = {
        "recorded": f"{start:%Y-%m-%d %H:%M:%S %z} by {heading.written_by}",
        "state": _state(log),
        "at the end": str(rest_in(log.events)),
        "periods": _periods(log),
        "size": f"{size / 1e6:.2f} MB",
    }
    if len(log) > 1:
        facts |= _timing(log)
    facts["attachments"] = ", ".join(log.attachments) or "none"
    for name, text in facts.items():
        table.add_row(name, Text(inert(text)))
    return table


def _state(log: Log) -> str:
    if log.damage is not None:
        return f"DAMAGED: {log.damage}"
    if not log.complete:
        return "not finished: its process was killed, or is still writing; all that is there was read"
    return "complete, every check sum is right"


def _periods(log: Log) -> str:
    text = f"{len(log)}, nominally every {1e3 * log.heading.period:g} ms"
    missing = sum(gap.count for gap in log.gaps)
    if missing:
        first = log.gaps[0]
        text += f"; {missing} MISSING in {len(log.gaps)} places, the first after period {first.after}"
    return text


def _timing(log: Log) -> dict[str, str]:
    duration = log_duration(log)
    facts = {"duration": f"{duration:.3f} s"}
    if 0.0 < duration < np.inf:
        facts["duration"] += f", {(log.sequence[-1] - log.sequence[0]) / duration:.4g} periods per second"
    for name, values in log_spreads(log).items():
        median, high, most = 1e6 * np.percentile(values, (50, 99, 100))
        facts[name] = f"median {median:.0f}, 99 % {high:.0f}, longest {most:.0f} µs"
    return facts


def _topics(log: Log) -> Table:
    table = _table(None, ("topic", "messages", "fields"))
    table.add_row("/period", str(len(log)), "")
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


def _events(log: Log) -> Table:
    table = _table(None, ("after [s]", "level", "source", "event"))
    start = log.heading.first_time
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
