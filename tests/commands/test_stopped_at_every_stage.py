"""Signals, and terminals that are closed, from the first import to the last page of the report: real processes."""

import os
import re
import signal
import subprocess
import sys
from contextlib import suppress

import psutil
import pytest

from palpate.runtime.log import log_in, read_log
from support.tiny_experiment import TINY
from support.waiting import until

pytestmark = pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="no SIGHUP on this system")

PROCESS_TIMEOUT = 120.0
"""[s] for a stage to come, where kernels may have to be compiled."""

STAGES = {"planning": "planning", "running": "[1-9] of about", "drawing": "drawing the report"}
"""What a terminal shows of each, as a pattern; running, that it moves already."""


class OnTerminal:
    """palpate on a terminal of its own, which is its controlling one or not."""

    def __init__(self, words, *, controlling):
        self.master, slave = os.openpty()
        self.shown = b""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "palpate", *words],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
            env=os.environ | {"TERM": "xterm", "COLUMNS": "200"},
            preexec_fn=_control if controlling else None,
        )
        os.close(slave)

    def wait_for(self, stage):
        if stage == "importing":
            until(
                lambda: any("numpy" in m.path for m in psutil.Process(self.process.pid).memory_maps()),
                PROCESS_TIMEOUT,
            )
            return
        while not re.search(STAGES[stage].encode(), self.shown):
            self.shown += os.read(self.master, 65536)

    def close(self):
        with suppress(OSError):
            os.close(self.master)

    def ended(self):
        """Its exit code, and what was on the terminal."""
        with suppress(OSError):
            while read := os.read(self.master, 65536):
                self.shown += read
        return self.process.wait(PROCESS_TIMEOUT), self.shown.decode()


def _control():
    import fcntl
    import termios

    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


@pytest.fixture
def typed(tmp_path):
    return [TINY, "--time", "20", "--out", str(tmp_path / "out")]


def check_kept(folder, stage):
    """Before the run there is nothing; after it, its log and report, and nobody's leftovers."""
    if stage in ("importing", "planning"):
        assert not list(folder.glob("*.mcap"))
        return
    assert (folder / "report.html").is_file()
    log = read_log(log_in(folder))
    assert log.damage is None
    assert not [path for path in folder.rglob("*") if path.name.endswith(".part")]


CASES = [
    pytest.param(stage, how, marks=() if (stage, how) == ("running", "closed") else pytest.mark.slow)
    for stage in ("importing", *STAGES)
    for how in ("closed", "uncontrolled", signal.SIGTERM, signal.SIGHUP, signal.SIGINT, "twice")
    if not (stage == "drawing" and how == signal.SIGINT)
]


@pytest.mark.slow
@pytest.mark.parametrize(("stage", "how"), CASES)
def test_whatever_stops_it_at_whatever_stage_it_ends_as_promised(stage, how, typed, tmp_path):
    terminal = OnTerminal(typed, controlling=how != "uncontrolled")
    terminal.wait_for(stage)
    number = {"twice": signal.SIGINT, "closed": signal.SIGHUP, "uncontrolled": signal.SIGHUP}.get(how, how)
    if how in ("closed", "uncontrolled"):
        terminal.close()
    else:
        for _ in range(2 if how == "twice" else 1):
            terminal.process.send_signal(number)
    code, shown = terminal.ended()
    assert code == 128 + number, shown
    assert "Traceback" not in shown
    if how != "twice":
        check_kept(tmp_path / "out", stage)
    if isinstance(how, signal.Signals):
        assert re.search("nothing was written|nothing is kept|Written: .*report.html", shown), shown
