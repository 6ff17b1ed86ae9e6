"""Commands and scripts in processes that need not import anything first: forks of the test process.

A fork has a folder, environment, exit code and output of its own, as a process that a user starts. Signals, closed
pipes, what imports load and pictures are for real processes, not for forks: OpenGL hangs in a fork of a process
that has used it.
"""

import contextlib
import functools
import gc
import importlib
import io
import os
import runpy
import signal
import subprocess
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

from palpate.experiments.kit.registry import experiment_named, experiment_names

TIMEOUT = 300
"""Of a fork [s]."""


Ended = subprocess.CompletedProcess[str]


def palpate(*words: object, folder: Path | None = None, environment: Mapping[str, str] | None = None) -> Ended:
    """Carry out a command as typed; one that draws a picture, in a process of its own."""
    if "--picture" in words:
        return subprocess.run(
            [sys.executable, "-m", "palpate", *map(str, words)],
            cwd=folder,
            env=os.environ | dict(environment or {}),
            capture_output=True,
            text=True,
            timeout=TIMEOUT,
        )

    def run() -> int:
        from palpate.__main__ import main

        sys.argv = ["palpate", *map(str, words)]
        return main()

    return forked(run, folder, environment)


def script(path: Path, *words: str, folder: Path, environment: Mapping[str, str] | None = None) -> Ended:
    """Run a script; its warnings are errors."""

    def run() -> int:
        warnings.simplefilter("error")
        sys.argv = [str(path), *words]
        sys.path.insert(0, str(path.parent))
        runpy.run_path(str(path), run_name="__main__")
        return 0

    return forked(run, folder, environment)


def forked(run: Callable[[], int], folder: Path | None, environment: Mapping[str, str] | None) -> Ended:
    """Call a function in a fork of this process, and wait for its end."""
    _warm()
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        child = os.fork()
        if child == 0:
            _end_with(run, folder, environment or {}, (out.fileno(), err.fileno()))
        _, status = os.waitpid(child, 0)
        said, told = (_whole(file) for file in (out, err))
    code = os.waitstatus_to_exitcode(status)
    if code < 0:
        told += f"ended by {signal.Signals(-code).name}; after {TIMEOUT} s that is an alarm\n"
    return Ended((), code, said, told)


@functools.cache
def _warm() -> None:
    """Import once what most commands import: experiments with their simulators, and the runner of commands."""
    for name in experiment_names():
        experiment_named(name)
    for module in ("run", "replay.command", "sweep.command", "compare.maps"):
        importlib.import_module(f"palpate.commands.{module}")


def _whole(file: io.BufferedRandom) -> str:
    file.seek(0)
    return file.read().decode()


def _end_with(run, folder, environment, outputs) -> None:
    """Be the fork: never returns."""
    code = 1
    try:
        signal.alarm(TIMEOUT)
        for number, output in enumerate(outputs, 1):
            os.dup2(output, number)
        sys.stdin = open(os.devnull)  # noqa: SIM115
        sys.stdout, sys.stderr = (open(number, "w", closefd=False) for number in (1, 2))  # noqa: SIM115
        os.chdir(folder or ".")
        for name in ("NO_COLOR", "FORCE_COLOR", "COLUMNS"):
            os.environ.pop(name, None)
        os.environ.update(environment)
        sys.path[:0] = [each for each in environment.get("PYTHONPATH", "").split(os.pathsep) if each]
        _forget()
        code = run()
    except SystemExit as left:
        code = left.code if isinstance(left.code, int) else 0 if left.code is None else 1
        if isinstance(left.code, str):
            sys.stderr.write(f"{left.code}\n")
    except BaseException:
        traceback.print_exc()
    finally:
        with contextlib.suppress(OSError):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(int(code))


def _forget() -> None:
    """Empty what palpate remembers of its surroundings: experiments, commands, plug-ins."""
    for cached in gc.get_objects():
        # the type itself: `isinstance` would ask a weak proxy, whose object may be gone
        if type(cached) is functools._lru_cache_wrapper and str(cached.__module__).startswith("palpate"):
            cached.cache_clear()
