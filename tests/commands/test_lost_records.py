"""Records that are lost are in the outcome and in the exit code, whatever lost them."""

import json
import os
import shutil
import subprocess
import sys

import pytest

from palpate.runtime.log import LogWriter, Recorder, read_log
from runtime.log.log_examples import PERIOD, a_run
from support.tiny_experiment import TINY
from support.waiting import until


def written_while(path, happens):
    """Return the summary of a log of 1000 periods to which something happens half-way."""
    periods, recorder = a_run(1000), Recorder(writer := LogWriter(path))
    recorder.start(periods[0][0], periods[0][1], PERIOD)
    for period in periods[:600]:
        recorder.record(*period)
    until(lambda: writer._written == 600)
    happens()
    for period in periods[600:]:
        recorder.record(*period)
    return recorder.close()


@pytest.mark.parametrize(
    ("happens", "words"),
    [
        (lambda path: shutil.rmtree(path.parent), "was deleted or moved"),
        (lambda path: path.unlink(), "was deleted or moved"),
        (lambda path: path.parent.rename(path.parent.with_name("elsewhere")), "was deleted or moved"),
        (lambda path: (path.unlink(), path.write_text("x")), "another file has taken its place"),
    ],
)
def test_a_log_that_is_gone_is_counted_as_lost(happens, words, tmp_path):
    path = tmp_path / "out" / "a.mcap"
    path.parent.mkdir()
    summary = written_while(path, lambda: happens(path))
    assert words in summary.problem
    assert (summary.rows_written, summary.rows_lost) == (0, 1000)


@pytest.mark.parametrize("size", [0, 5000, 60_000, 10**6])
def test_of_a_log_whose_size_others_change_the_whole_chunks_are_left(size, tmp_path):
    path = tmp_path / "a.mcap"
    summary = written_while(path, lambda: os.truncate(path, size))
    assert "changed its size" in summary.problem
    assert summary.rows_written + summary.rows_lost == 1000
    assert size != 10**6 or summary.rows_written == 600
    if size >= 60_000:
        assert len(read_log(path)) == summary.rows_written


PUT_IN = """
import os, resource, shutil, sys, threading
from pathlib import Path
from palpate import cli

waited = threading.Event()

def when_it_has_grown(folder, happens):
    while not any(path.stat().st_size > 30_000 for path in folder.glob("2*.mcap")):
        waited.wait(0.01)
    happens(next(folder.glob("2*.mcap")))

how, folder = sys.argv.pop(1), Path(sys.argv[-1])
happens = {
    "deleted": lambda path: shutil.rmtree(path.parent),
    "truncated": lambda path: os.truncate(path, 20_000),
}
if how == "limited":
    resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
else:
    threading.Thread(target=when_it_has_grown, args=(folder, happens[how]), daemon=True).start()
sys.exit(cli.main())
"""


@pytest.mark.slow
@pytest.mark.parametrize("how", ["limited", "deleted", "truncated"])
def test_the_outcome_and_the_exit_code_of_a_run_report_it(how, tmp_path):
    words = [TINY, "--time", "20", "--json", "--out", str(tmp_path / "out")]
    ended = subprocess.run([sys.executable, "-c", PUT_IN, how, *words], capture_output=True, check=False)
    result = json.loads(ended.stdout)
    assert ended.returncode == result["exit_code"] == 1, ended.stderr.decode()
    assert "THE LOG IS NOT WHOLE" in result["outcome"]
    assert "THE LOG IS NOT WHOLE" in (tmp_path / "out" / "report.html").read_text()
