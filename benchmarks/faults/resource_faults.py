"""What a command runs out of, or loses, while it runs: disk, folder, log, memory, descriptors."""

import os
import resource
import shutil
from collections.abc import Callable

from faults.command import Act, Command, Expected, OnACommand
from faults.kind import Domain, Kind

LOST = Expected((1,))
"""The run goes on and ends; that its record is not whole is in its exit code."""


def limited(kind: int, most: int) -> Callable[[], object]:
    """Return what limits the process that is about to become palpate."""
    return lambda: resource.setrlimit(kind, (most, most))


def nothing(command: Command) -> None:
    """It meets its limit by itself."""


def delete_folder(command: Command) -> None:
    """Delete the output folder."""
    shutil.rmtree(command.out, ignore_errors=True)


def truncate_log(command: Command) -> None:
    """Cut the log short."""
    for path in command.out.glob("*.mcap*"):
        os.truncate(path, 1000)


def delete_log(command: Command) -> None:
    """Delete the log alone."""
    for path in command.out.glob("*.mcap*"):
        path.unlink()


def fill_log(command: Command) -> None:
    """Let somebody else write into the log."""
    for path in command.out.glob("*.mcap*"):
        with path.open("r+b") as file:
            file.seek(5000)
            file.write(b"\0" * 4096)


def no_file_may_grow(most: int) -> Act:
    """Limit the size of files from now on: a disk that is full."""
    return lambda command: resource.prlimit(command.process.pid, resource.RLIMIT_FSIZE, (most, most))


def no_more_descriptors(command: Command) -> None:
    """Allow no further descriptor."""
    resource.prlimit(command.process.pid, resource.RLIMIT_NOFILE, (16, 16))


def no_more_memory(command: Command) -> None:
    """Allow no further memory."""
    resource.prlimit(command.process.pid, resource.RLIMIT_AS, (1 << 28, 1 << 28))


def slow_disk(command: Command) -> None:
    """Let the process run at the lowest priority, as behind a backup."""
    os.setpriority(os.PRIO_PROCESS, command.process.pid, 19)


def read_only(command: Command) -> None:
    """Take the right to write away from the folder."""
    command.out.chmod(0o500)


def _kind(name: str, act: Act, expected: Expected) -> Kind:
    return Kind(name, Domain.RESOURCE, OnACommand("running", act, expected))


ENDS = Expected((0, 1))
"""It may go well, or be reported."""

KINDS = (
    _kind("the disk is full while running", no_file_may_grow(20_000), LOST),
    _kind("the disk is full for the report", no_file_may_grow(200_000), ENDS),
    _kind("the folder is deleted while running", delete_folder, LOST),
    _kind("the log is cut short while running", truncate_log, LOST),
    _kind("the log is deleted while running", delete_log, LOST),
    _kind("the log is written over while running", fill_log, ENDS),
    _kind("the folder becomes read-only", read_only, ENDS),
    _kind("no further descriptor while running", no_more_descriptors, ENDS),
    _kind("no further memory while running", no_more_memory, Expected((1,))),
    _kind("lowest priority while running", slow_disk, ENDS),
    Kind(
        "files of 0 bytes from the beginning",
        Domain.RESOURCE,
        OnACommand("importing", nothing, Expected((1, 2)), limited(resource.RLIMIT_FSIZE, 0)),
    ),
    Kind(
        "20 descriptors from the beginning",
        Domain.RESOURCE,
        OnACommand("importing", nothing, Expected((0, 1, 2)), limited(resource.RLIMIT_NOFILE, 20)),
    ),
    Kind(
        "600 MB of address space from the beginning",
        Domain.RESOURCE,
        OnACommand("importing", nothing, Expected((0, 1, 2)), limited(resource.RLIMIT_AS, 600 << 20)),
    ),
)
