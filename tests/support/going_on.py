"""Commands that go on until Ctrl-C, run as a user does."""

import os
import subprocess
import sys
from contextlib import contextmanager, suppress


@contextmanager
def going_on(typed, last, folder=None):
    """Start a command in a process of its own, and kill it at the end if it still runs.

    Yields:
        The process, and what it said up to the line with `last`.
    """
    started = subprocess.Popen(
        [sys.executable, "-m", "palpate", *typed],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    said = ""
    try:
        for line in started.stdout:
            said += line
            if last in line:
                break
        yield started, said
    finally:
        if started.poll() is None:
            started.kill()
        with suppress(subprocess.TimeoutExpired):
            started.wait(60.0)
        started.stdout.close()
