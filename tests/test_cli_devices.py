"""Commands that go on until Ctrl-C, or need devices: each once, as a process of its own."""

import json
import signal
import subprocess
import sys
from contextlib import suppress

import pytest

from palpate.cli import main
from palpate.commands.command_result import ExitCode
from support.cli_samples import SMALL
from support.going_on import going_on
from support.ur_library import needs_ur

pytestmark = [pytest.mark.wire, needs_ur]  # they wait for real time, as the tests of devices do


def ended_by_ctrl_c(process):
    """Press Ctrl-C; the exit code."""
    process.send_signal(signal.SIGINT)
    return process.wait(60.0)


@pytest.mark.slow
def test_a_view_is_shown_until_ctrl_c(tmp_path):
    assert main(["explore", *SMALL.split(), "--out", str(tmp_path / "run")]) == 0
    with going_on(("view", "run", "--port", "0"), "View: http", tmp_path) as (process, said):
        assert "http://" in said
        with suppress(subprocess.TimeoutExpired):
            process.wait(2.0)  # until it plays
        assert ended_by_ctrl_c(process) == 0


@pytest.mark.slow
def test_a_doctor_examines_emulated_devices_and_answers_in_one_document(capsys):
    code = main(["doctor", "emulated-ur5e", "--duration", "0.5", "--json"])
    found = json.loads(capsys.readouterr().out)
    assert found["command"] == "doctor"
    assert code == found["exit_code"]
    assert code in (0, 1), "a busy computer is something to fix"
    assert found["fit"] is (code == 0)
    devices = {each["device"] for each in found["findings"]}
    assert len(devices) >= 3


@pytest.mark.slow
def test_ctrl_c_in_a_run_still_gives_a_document_with_what_there_was(tmp_path):
    typed = ("explore", "--speed", "0.002", "--spacing", "0.001", "--out", str(tmp_path / "run"), "--json")
    process = subprocess.Popen(
        [sys.executable, "-m", "palpate", *typed], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    for line in process.stderr:
        if line.startswith("running"):
            break
    with suppress(subprocess.TimeoutExpired):
        process.wait(3.0)
    process.send_signal(signal.SIGINT)
    told, _ = process.communicate(timeout=120)
    assert process.returncode == ExitCode.INTERRUPTED
    found = json.loads(told)
    assert (found["status"], found["exit_code"]) == ("interrupted", ExitCode.INTERRUPTED)
    assert found["metrics"]["simulated_s"] > 0.0
    assert any(file.endswith(".mcap") for file in found["files"])
