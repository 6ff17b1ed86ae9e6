"""What is said on the terminal when a run is over, and where its log is written."""

from datetime import datetime
from pathlib import Path
from typing import Protocol

from rich.console import Console

from palpate.experiments.versions import VERSIONS_TEXT, versions_text
from palpate.runtime import RunResult
from palpate.runtime.log import LogWriter, new_log_path

INTERRUPTED = 130
"""128 + SIGINT, the shell's convention: the run was cut short."""

STOPPED = "Stopping: log and report are being written (Ctrl-C again leaves them)"
"""Said at once after a Ctrl-C."""


class WithFolder(Protocol):
    """A configuration that says where files go."""

    @property
    def out(self) -> Path:
        """The folder."""
        ...


class Recordable(Protocol):
    """What of a plan a log needs."""

    @property
    def config(self) -> WithFolder:
        """What was asked for."""
        ...

    def texts(self) -> dict[str, str]:
        """Everything from which the very same is planned again, by file name."""
        ...


def log_writer(planned: Recordable) -> LogWriter:
    """Return the writer of a log from which the run can be replayed."""
    path = new_log_path(planned.config.out, datetime.now())  # local time: people look for it by their clock
    return LogWriter(path, {**planned.texts(), VERSIONS_TEXT: versions_text()})


def tell_of(console: Console, result: RunResult, files: tuple[Path, ...]) -> None:
    """Say where an exception that ended the run came from, what became of the log, and what was written."""
    if result.error is not None:
        import traceback

        trace = "".join(traceback.format_exception(result.error))
        console.print(trace, markup=False, highlight=False, soft_wrap=True)
    recording = result.recording
    if recording is not None and recording.path is not None:
        console.print(f"Log: {recording}", highlight=False, markup=False, soft_wrap=True)
    console.print("Written: " + ", ".join(str(file) for file in files), highlight=False, soft_wrap=True)
