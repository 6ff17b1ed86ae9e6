"""What is in a log, as figures for programs."""

from collections.abc import Mapping
from datetime import datetime

import numpy as np

from palpate.commands.command_result import CommandResult
from palpate.commands.log.times import log_duration, log_spreads
from palpate.errors import FloatArray
from palpate.runtime.log import Log
from palpate.runtime.rest import rest_in
from palpate.strict_yaml import read_yaml


def log_result(log: Log, size: int, versions: str) -> CommandResult:
    """Return the contents of a log as a command's result.

    Args:
        log: As read.
        size: Of its file [bytes].
        versions: Name of the attachment with the versions that wrote it.
    """
    heading = log.heading
    figures: dict[str, object] = {
        "periods": len(log),
        "period_s": heading.period,
        "missing_periods": sum(gap.count for gap in log.gaps),
        "size_bytes": size,
    }
    if len(log) > 1:
        figures["duration_s"] = log_duration(log)
        for name, values in log_spreads(log).items():
            figures |= _spread(name.replace(" ", "_"), values)
    return CommandResult(
        outcome="damaged" if log.damage is not None else "complete" if log.complete else "not finished",
        figures=figures,
        facts={
            "log": log.path,
            "recorded": datetime.fromtimestamp(heading.wall_start / 1e9).astimezone().isoformat(),
            "written_by": heading.written_by,
            "rest": rest_in(log.events),
            "complete": log.complete and log.damage is None,
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
        warnings=() if log.damage is None else (str(log.damage),),
    )


def _spread(name: str, values: FloatArray) -> dict[str, object]:
    median, high, most = np.percentile(values, (50, 99, 100)).tolist()
    return {f"{name}_p50_s": median, f"{name}_p99_s": high, f"{name}_largest_s": most}


def _versions(attachments: Mapping[str, str], name: str) -> object:
    return read_yaml(attachments[name]) if name in attachments else None
