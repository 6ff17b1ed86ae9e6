"""`palpate log info`, `export` and `ros2`: what is in the log of a run."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from rich.console import Console

from palpate.commands.command_result import CommandResult
from palpate.commands.log.config import LogExportConfig, LogInfoConfig, LogRos2Config
from palpate.commands.log.episodes import default_folder, episodes, logs_in
from palpate.commands.log.result import log_result
from palpate.commands.log.summary import VERSIONS, log_summary
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
        figures={"episodes": len(read), "periods": periods},
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
