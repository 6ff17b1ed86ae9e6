"""`palpate warm-up`: everything is compiled in a process of its own, so that Ctrl-C ends it at once."""

import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Self

from llvmlite import binding
from rich.console import Console

import palpate
from palpate.atomic_file import replacing
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.progress import lively
from palpate.commands.say import say
from palpate.commands.warm_up.config import WarmUpConfig
from palpate.compiling import cache_folder
from palpate.experiments.kit.config_file import versions_text
from palpate.runtime.progress_bar import progress_bar

KERNELS = ("*.nbi", "*.nbc")

STEPS = "palpate.commands.warm_up.steps"

REMEDY = "no folder to keep kernels in can be written: set NUMBA_CACHE_DIR to one that can"

INTERRUPTED = "interrupted; what was compiled is kept, and `palpate warm-up` goes on from there"

ShowStep = Callable[[str, int, int], None]
"""Shows what is being compiled: its name, its number, and of how many."""


def run_warm_up(config: WarmUpConfig) -> CommandResult:
    """Compile what is not compiled yet.

    Returns:
        What was compiled and where it is kept; unfinished if it could not be kept.

    Raises:
        KeyboardInterrupt: By then something may be compiled.
    """
    console = Console()
    record = WarmUpRecord.here()
    found = record.read()
    if found is not None:
        return _result(console, found | {"compiled": []}, 0.0)
    began = time.monotonic()
    with TemporaryDirectory() as room:
        errors = Path(room) / "errors.txt"
        with _progress(console) as show_step:
            report = _compile_all(Path(room), errors, show_step)
        if report is None:
            last = errors.read_text(encoding="utf-8", errors="replace").strip().splitlines()[-1:]
            return CommandResult(
                ExitCode.UNFINISHED, error=f"could not compile everything: {''.join(last) or 'it was killed'}"
            )
    report["warnings"] = _warnings(report)
    if not report["warnings"]:
        record.write(report)
    return _result(console, report, time.monotonic() - began)


def _compile_all(room: Path, errors: Path, show_step: ShowStep) -> dict[str, Any] | None:
    """Use everything in another process; returns what it reported at its end, None if it did not get there."""
    report: dict[str, Any] = {}
    environment = os.environ | {"TMPDIR": str(room)}  # of compilers that are killed
    with (
        errors.open("wb") as words,
        subprocess.Popen(
            [sys.executable, "-m", STEPS], stdout=subprocess.PIPE, stderr=words, env=environment, text=True
        ) as process,
    ):
        assert process.stdout is not None
        try:
            for line in process.stdout:
                report = json.loads(line)
                if "step" in report:
                    show_step(report["step"], report["number"], report["of"])
        except KeyboardInterrupt:
            raise KeyboardInterrupt(INTERRUPTED) from None
        finally:
            process.kill()
    return None if "compiled" not in report else report


def _warnings(report: dict[str, Any]) -> list[str]:
    warnings = [] if report["folders"] else [REMEDY]
    wanted = os.environ.get("NUMBA_CACHE_DIR", "")
    if wanted and not any(Path(each).is_relative_to(Path(wanted).absolute()) for each in report["folders"]):
        warnings.append(f"NUMBA_CACHE_DIR = {wanted} cannot be written: choose another")
    return warnings


def _result(console: Console, report: dict[str, Any], duration: float) -> CommandResult:
    """Print the result and return it."""
    count = len(report["compiled"])
    # one that holds everything
    folders = [Path(os.path.commonpath(report["folders"]))] if report["folders"] else []
    what = f"Compiled {count} functions in {duration:.0f} s" if count else "Nothing to compile"
    outcome = f"{what}; kept in {' and '.join(map(str, folders))}" if folders else what
    say(console, outcome)
    for warning in report.get("warnings", ()):
        say(console, f"Note: {warning}")
    return CommandResult(
        ExitCode.UNFINISHED if report.get("warnings") else ExitCode.DONE,
        outcome,
        {"compiled": count, "duration_s": duration},
        facts={"functions": report["compiled"], "folders": folders},
        warnings=tuple(report.get("warnings", ())),
    )


@contextmanager
def _progress(console: Console) -> Iterator[ShowStep]:
    if not lively(console):
        yield lambda step, number, total: say(console, f"{number} of {total}: {step}")
        return
    with progress_bar(console, "compiling for the first time", None, "{task.completed:.0f}/{task.total}") as bar:
        yield lambda step, number, total: bar.show(number, words=f"compiling for {step}", total=total)


@dataclass(frozen=True, slots=True)
class WarmUpRecord:
    """A file beside what is compiled.

    Attributes:
        path: Of the file; another for each place of palpate and of kernels.
        made_of: Hash of all that compiled code depends on.
    """

    path: Path
    made_of: str

    @classmethod
    def here(cls) -> Self:
        """Return that of this palpate on this machine."""
        package = Path(palpate.__file__).parent
        place = f"{package}\n{os.environ.get('NUMBA_CACHE_DIR', '')}"
        machine = f"{versions_text()}{binding.get_host_cpu_name()}"
        hashed = hashlib.sha256(machine.encode())
        for folder, folders, files in os.walk(package, followlinks=True):
            folders.sort()
            for name in sorted(files):
                if name.endswith(".py"):
                    hashed.update((Path(folder) / name).read_bytes())
        name = hashlib.sha256(place.encode()).hexdigest()[:16]
        return cls(cache_folder() / f"warm-up-{name}.json", hashed.hexdigest())

    def read(self) -> dict[str, Any] | None:
        """Return what was reported when everything was compiled; None if it is not, or no longer."""
        try:
            found: dict[str, Any] = json.loads(self.path.read_text(encoding="utf-8"))
            kept = found["made_of"] == self.made_of and all(map(os.path.isfile, found["files"]))
            return found if kept else None
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def write(self, report: dict[str, Any]) -> None:
        """Keep what was reported, if a file can be written."""
        files = [str(file) for folder in report["folders"] for kind in KERNELS for file in Path(folder).glob(kind)]
        with suppress(OSError):
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(self.path) as file:
                file.write(json.dumps(report | {"made_of": self.made_of, "files": files}).encode())
