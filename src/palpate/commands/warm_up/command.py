"""`palpate warm-up`: everything is compiled in a process of its own, so that Ctrl-C ends it at once."""

import hashlib
import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from llvmlite import binding
from rich.console import Console

import palpate
from palpate.atomic_file import replacing
from palpate.commands.command_result import CommandResult, ExitCode
from palpate.commands.warm_up.config import WarmUpConfig
from palpate.compiling import cache_folder
from palpate.experiments.kit.config_file import versions_text
from palpate.runtime.progress import COUNT, lively, progress_bar, say

STEPS = "palpate.commands.warm_up.steps"
"""Module that uses everything, run as a process."""

INTERRUPTED = "interrupted; what was compiled is kept, and `palpate warm-up` goes on from there"


def run_warm_up(config: WarmUpConfig) -> CommandResult:
    """Compile everything that is not compiled yet.

    Returns:
        Names of the compiled functions and their folder; unfinished if they could not be kept.

    Raises:
        KeyboardInterrupt: After Ctrl-C; functions compiled by then are kept.
    """
    began = time.monotonic()
    record, sources = _record_path(), _hash_of_sources()
    report, warnings = _kept_report(record, sources), list[str]()
    if report is None:
        with TemporaryDirectory() as folder, _progress(Console()) as show:
            report = _compile_all(folder, show)
        if "error" in report:
            return CommandResult(ExitCode.UNFINISHED, error=f"could not compile everything: {report['error']}")
        if not report["folders"]:
            warnings.append("no folder to keep kernels in can be written: set NUMBA_CACHE_DIR to one that can")
        wanted = os.environ.get("NUMBA_CACHE_DIR", "")
        if wanted and not any(Path(each).is_relative_to(Path(wanted).absolute()) for each in report["folders"]):
            warnings.append(f"NUMBA_CACHE_DIR = {wanted} cannot be written: choose another")
        if not warnings:
            _keep_report(record, report, sources)
    count, duration = len(report["compiled"]), time.monotonic() - began
    # one folder that holds all
    folders = [Path(os.path.commonpath(report["folders"]))] if report["folders"] else []
    outcome = f"Compiled {count} functions in {duration:.0f} s" if count else "Nothing to compile"
    outcome += f"; kept in {folders[0]}" if folders else ""
    return CommandResult(
        ExitCode.UNFINISHED if warnings else ExitCode.DONE,
        outcome,
        {"compiled": count, "duration_s": duration},
        facts={"functions": report["compiled"], "folders": folders},
        warnings=tuple(warnings),
        shown=(outcome, *(f"Note: {warning}" for warning in warnings)),
    )


def _compile_all(folder: str, show: Callable[[dict[str, Any]], None]) -> dict[str, Any]:
    """Run `STEPS` in another process, whose temporary files go to a folder; returns its report, or its error."""
    report: dict[str, Any] = {}
    errors = Path(folder) / "errors.txt"
    with (
        errors.open("wb") as error_file,
        subprocess.Popen(
            [sys.executable, "-m", STEPS],
            stdout=subprocess.PIPE,
            stderr=error_file,
            env=os.environ | {"TMPDIR": folder},
            text=True,
        ) as process,
    ):
        assert process.stdout is not None
        try:
            for line in process.stdout:
                report = json.loads(line)
                if "step" in report:
                    show(report)
        except KeyboardInterrupt:
            raise KeyboardInterrupt(INTERRUPTED) from None
        finally:
            process.kill()
    if "compiled" in report:
        return report
    lines = errors.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    return {"error": lines[-1] if lines else "it was killed"}


@contextmanager
def _progress(console: Console) -> Iterator[Callable[[dict[str, Any]], None]]:
    """Show progress; yields the function to call with the report of each step at its start."""
    if not lively(console):
        yield lambda step: say(console, f"{step['number']} of {step['of']}: {step['step']}")
        return
    with progress_bar(console, "compiling for the first time", None, COUNT) as bar:
        yield lambda step: bar.show(step["number"], words=f"compiling for {step['step']}", total=step["of"])


def _record_path() -> Path:
    """Return the file with the report of the last warm-up; each place of palpate and of kernels has its own."""
    place = f"{Path(palpate.__file__).parent}\n{os.environ.get('NUMBA_CACHE_DIR', '')}"
    return cache_folder() / f"warm-up-{hashlib.sha256(place.encode()).hexdigest()[:16]}.json"


def _hash_of_sources() -> str:
    """Return a hash of everything on which compiled code depends."""
    hashed = hashlib.sha256(f"{versions_text()}{binding.get_host_cpu_name()}".encode())
    for folder, folders, files in os.walk(Path(palpate.__file__).parent, followlinks=True):
        folders.sort()
        for name in sorted(files):
            if name.endswith(".py"):
                hashed.update((Path(folder) / name).read_bytes())
    return hashed.hexdigest()


def _kept_report(record: Path, sources: str) -> dict[str, Any] | None:
    """Return the report of a warm-up whose files all exist, with nothing compiled since; None without one."""
    try:
        report: dict[str, Any] = json.loads(record.read_text(encoding="utf-8"))
        kept = report["made_of"] == sources and all(map(os.path.isfile, report["files"]))
        return report | {"compiled": []} if kept else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _keep_report(record: Path, report: dict[str, Any], sources: str) -> None:
    """Write a report and the files that it depends on, if a file can be written."""
    kernels = ("*.nbi", "*.nbc")
    files = [str(file) for folder in report["folders"] for kind in kernels for file in Path(folder).glob(kind)]
    with suppress(OSError):
        record.parent.mkdir(parents=True, exist_ok=True)
        with replacing(record) as file:
            file.write(json.dumps(report | {"made_of": sources, "files": files}).encode())
