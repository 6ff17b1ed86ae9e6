"""`palpate log info`, `export` and `ros2`: what is in the log of a run."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.log.config import LogExportConfig, LogInfoConfig, LogRos2Config
from palpate.commands.log.episodes import default_folder, episodes, logs_in
from palpate.commands.log.summary import VERSIONS, log_summary, lost_records
from palpate.commands.log.times import LogTimes
from palpate.commands.progress import lively
from palpate.commands.say import say
from palpate.errors import InvalidValueError
from palpate.experiments.kit.output_folder import make_folder
from palpate.experiments.kit.recording import notes_in
from palpate.exporting.exporter import Exporter
from palpate.open_kinds import kind_named
from palpate.runtime.log import LogReader, log_in
from palpate.runtime.log.ros2_bag import write_bag
from palpate.runtime.progress_bar import PERCENT, progress_bar
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
    metrics: dict[str, object] = {
        "periods": log.periods,
        "period_s": heading.period,
        "missing_periods": log.missing,
        "size_bytes": size,
    }
    if log.periods > 1:
        metrics["duration_s"] = times.duration
        for name, spread in times.spreads.items():
            metrics |= _spread(name.replace(" ", "_"), spread)
    return CommandResult(
        outcome="; ".join([f"records were lost: {lost}"] * bool(lost) + [_state(log)]),
        metrics=metrics,
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


BAR_DELAY = 2.0
"""Work that takes no longer [s] needs no progress bar."""


def run_log_info(config: LogInfoConfig) -> CommandResult:
    """Print and return what is in a log.

    Raises:
        InvalidValueError: There is no log, or nothing of it can be read.
        OSError: It cannot be opened.
    """
    path = _path(config.log)
    size = path.stat().st_size
    with LogReader(path) as log, _patient_progress(f"reading {path.name}") as progress:
        times = LogTimes(log.codec)
        for piece in log.pieces(progress):
            times.take(piece)
    Console().print(log_summary(log, times, size))
    return log_result(log, times, size, VERSIONS)


def run_log_export(config: LogExportConfig) -> CommandResult:
    """Write a log, or those of a sweep, as a data set; returns its files.

    Raises:
        InvalidValueError: There is no log, nothing of one can be read, there is no such format, it cannot hold
            these logs, the folder cannot be made, or has a folder that the format would write.
        MissingLibraryError: A library that the format takes is not installed.
        OSError: A file cannot be written.
    """
    exporter, logs, console = _exporter(config.to), logs_in(config.log), Console()
    folder = default_folder(config.log) if config.out is None else config.out
    make_folder(folder)
    read: list[LogReader] = []
    with TemporaryDirectory(prefix=".part-", dir=folder) as part, _patient_progress("writing") as progress:
        exporter.write(episodes(logs, progress, read.append), Path(part))
        files = _moved(Path(part), folder)
    periods = sum(log.periods for log in read)
    say(console, f"{periods} periods of {len(read)} run{'s' if len(read) > 1 else ''}")
    for file in files:
        say(console, str(file))
    damage = tuple(f"{log.path}: damaged, its periods have gaps: {log.damage_words}" for log in read if log.damage)
    for warning in damage:
        say(console, warning)
    return CommandResult(
        metrics={"episodes": len(read), "periods": periods},
        facts={"logs": [log.path for log in read]},
        files=files,
        warnings=damage,
    )


def _exporter(name: str) -> Exporter:
    kind = kind_named(Exporter, name, "to")
    try:
        made = kind()
    except TypeError as error:
        raise InvalidValueError(f"to = {name}: cannot be made without arguments: {error}") from None
    assert isinstance(made, Exporter)  # `kind_named` has seen to it
    return made


def _moved(part: Path, folder: Path) -> tuple[Path, ...]:
    """Move what was written to where it belongs; files replace earlier ones, folders nothing."""
    written = sorted(part.iterdir())
    for each in written:
        if each.is_dir() and (folder / each.name).exists():
            raise InvalidValueError(
                f"out = {folder}: has a {each.name} already, which stays as it is; choose another folder (--out)"
            )
    files = [folder / each.relative_to(part) for each in sorted(part.rglob("*")) if each.is_file()]
    for each in written:
        each.replace(folder / each.name)
    return tuple(files)


def run_log_ros2(config: LogRos2Config) -> CommandResult:
    """Write a log as a bag of ROS 2; returns its files.

    Raises:
        InvalidValueError: There is no log, nothing of it can be read, or the folder is there already.
        OSError: A file cannot be written.
    """
    path, console = _path(config.log), Console()
    folder = path.with_name(f"{path.stem}_bag") if config.out is None else config.out
    with _patient_progress(f"reading {path.name}") as progress:
        bag = write_bag(path, folder, notes_in, progress)
    damage = () if bag.damage is None else (f"The log is damaged, the bag has gaps: {bag.damage}",)
    for topic, count in bag.counts.items():
        say(console, f"{topic}: {count} messages")
    for warning in damage:
        say(console, warning)
    say(console, f"Bag: {folder}; play it with: ros2 bag play {folder}")
    facts = {"log": path, "bag": folder, "topics": dict(bag.counts)}
    return CommandResult(facts=facts, files=bag.files, warnings=damage)


def _path(place: Path) -> Path:
    return log_in(place).resolve()  # of a link, the run's own name


@contextmanager
def _patient_progress(what: str) -> Iterator[Callable[[float], None]]:
    """Yield the function to call with the fraction done; a bar appears after `BAR_DELAY`."""
    console = Console(stderr=True)
    with progress_bar(console, what, 1.0, PERCENT, after=BAR_DELAY, drawn=lively(console)) as bar:
        yield bar.show
