"""Whether the robot is at rest: the same clause on terminal, in report, log and JSON, and the exit code by it."""

import html
import json
import re
from pathlib import Path

import pytest

from palpate.cli import main
from palpate.commands import run
from palpate.commands.command_result import ExitCode
from palpate.runtime import RestState
from palpate.runtime.log import log_in, read_log
from palpate.runtime.rest import CLAUSES, LOOK, rest_in
from palpate.sim import MujocoBackend

FIRST_LOST = 150


def plain(text):
    """A text without line breaks and tags."""
    return " ".join(html.unescape(re.sub("<[^>]*>|[│|]", " ", text)).split())


CASES = [
    RestState.NOT_KNOWN,
    pytest.param(RestState.AT_REST, marks=pytest.mark.slow),
    pytest.param(RestState.MOVING, marks=pytest.mark.slow),
]


@pytest.fixture(params=CASES, ids=str)
def ending(request, monkeypatch):
    """The back end goes on, is lost for good, or goes on moving whatever it is commanded."""
    step, done = MujocoBackend.step, []

    def failing(self, command):
        done.append(command)
        if len(done) >= FIRST_LOST and request.param is RestState.NOT_KNOWN:
            raise OSError("no reply")
        if command.phase == "stop" and request.param is RestState.MOVING:
            command = done[0].__class__((0.0, 0.0, 0.01), command.phase)
        return step(self, command)

    monkeypatch.setattr(MujocoBackend, "step", failing)
    return request.param


def test_terminal_report_log_and_json_have_the_same_clause_on_rest(ending, tmp_path, capsys):
    arguments = ["regulate", "--duration", "0.3", "--out", str(tmp_path)]
    code = main([*arguments, "--json"])
    document, terminal = capsys.readouterr()
    found = json.loads(document)
    words = found["rest"]["words"]
    assert found["rest"]["state"] == ending
    assert words.startswith(CLAUSES[ending])
    assert words in found["outcome"]
    assert words in plain(terminal)
    assert words in plain((tmp_path / "report.html").read_text())
    assert rest_in(read_log(log_in(tmp_path)).events).words == words
    assert (code == ExitCode.DONE) == (ending is RestState.AT_REST)
    main(["log", "info", str(tmp_path), "--json"])
    assert json.loads(capsys.readouterr().out)["rest"]["words"] == words
    main(["log", "info", str(tmp_path)])
    assert words in plain(capsys.readouterr().out)


def test_the_documents_have_the_same_clauses():
    page = (Path(__file__).parents[2] / "docs" / "running.md").read_text()
    assert [clause for clause in (*CLAUSES.values(), LOOK) if clause not in page] == []


@pytest.mark.parametrize("error", [MemoryError(), ImportError("failed to map segment from shared object")])
def test_without_memory_for_a_report_the_outcome_and_the_log_are_there(error, tmp_path, capsys, monkeypatch):
    def no_memory(*given):
        raise error

    monkeypatch.setattr(run, "write_result", no_memory)
    assert main(["regulate", "--duration", "0.3", "--out", str(tmp_path), "--json"]) == ExitCode.UNFINISHED
    found = json.loads(capsys.readouterr().out)
    assert found["rest"]["state"] == RestState.AT_REST
    assert (str(error) or "out of memory") in found["error"]
    assert read_log(log_in(tmp_path)).complete
