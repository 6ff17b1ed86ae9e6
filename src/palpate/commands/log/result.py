"""What is in a log, as figures for programs."""

from collections.abc import Mapping
from datetime import datetime

from palpate.commands.command_result import CommandResult
from palpate.commands.log.summary import lost_records
from palpate.commands.log.times import LogTimes
from palpate.runtime.log import LogReader
from palpate.runtime.rest import rest_in
from palpate.runtime.timing import Distribution
from palpate.strict_yaml import read_yaml


def log_result(log: LogReader, times: LogTimes, size: int, versions: str) -> CommandResult:
    """Return the contents of a log as a command's result.

    Args:
        log: That was read.
        times: Of its periods.
        size: Of its file [bytes].
        versions: Name of the attachment with the versions that wrote it.
    """
    heading, lost = log.codec.heading, lost_records(log)
    figures: dict[str, object] = {
        "periods": log.periods,
        "period_s": heading.period,
        "missing_periods": log.missing,
        "size_bytes": size,
    }
    if log.periods > 1:
        figures["duration_s"] = times.duration
        for name, spread in times.spreads.items():
            figures |= _spread(name.replace(" ", "_"), spread)
    return CommandResult(
        outcome="; ".join([f"records were lost: {lost}"] * bool(lost) + [_state(log)]),
        figures=figures,
        facts={
            "log": log.path,
            "recorded": datetime.fromtimestamp(heading.wall_start / 1e9).astimezone().isoformat(),
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
            "versions": _versions(log.attachments, versions),
        },
        warnings=() if log.damage_words is None else (log.damage_words,),
    )


def _state(log: LogReader) -> str:
    return "damaged" if log.damage else "complete" if log.complete else "not finished"


def _spread(name: str, times: Distribution) -> dict[str, object]:
    return {f"{name}_p50_s": times.p50, f"{name}_p99_s": times.p99, f"{name}_largest_s": times.largest}


def _versions(attachments: Mapping[str, str], name: str) -> object:
    return read_yaml(attachments[name]) if name in attachments else None
