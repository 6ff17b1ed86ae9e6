"""The client process with a simulated library in it: the arm's process survives whatever becomes of it."""

import contextlib
import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import palpate.hw.ur.arm
from palpate.errors import InvalidValueError
from palpate.hw.devices import ArmDevice, DeviceError
from palpate.hw.ur import FlangePayload, UrArm, UrSettings
from palpate.hw.ur.exchange import UrRequest, UrTask
from support import waiting
from support.waiting import WITHIN, process_ended, until

ZERO = (0.0, 0.0, 0.0)
PATIENT = UrSettings(stale_after=1.0, watchdog=0.5)
"""The machine may stall."""


@pytest.fixture(autouse=True)
def no_controller(monkeypatch):
    monkeypatch.setattr(palpate.hw.ur.arm, "controller_version", lambda name, address: (5, 14, 0, 0))


@contextlib.contextmanager
def arm_on(folder: Path, settings: UrSettings = PATIENT) -> Iterator[UrArm]:
    arm = UrArm(str(folder), settings, library="support.fake_ur_library")
    arm.start()
    try:
        yield arm
    finally:
        arm.close()


@pytest.fixture
def arm(tmp_path) -> Iterator[UrArm]:
    with arm_on(tmp_path) as started:
        yield started


def spoil(folder: Path, fault: str) -> None:
    (folder / "new").write_text(fault)
    (folder / "new").replace(folder / "fault")  # never half written


def names(folder: Path) -> list[str]:
    return [line.split()[0] for line in (folder / "calls").read_text().splitlines()]


def since_last(folder: Path, name: str) -> list[str]:
    """Return the calls after the last one of a name."""
    calls = names(folder)
    return calls[len(calls) - calls[::-1].index(name) :]


def move(folder: Path, arm: UrArm, velocity=(0.01, 0.0, 0.0)) -> None:
    """Command a velocity, and wait until the library has it."""
    before = names(folder).count("speedL")
    arm.move(velocity, ZERO)
    until(lambda: names(folder).count("speedL") > before)


def fed(folder: Path, times: int) -> None:
    """Wait until the watchdog has been fed some more, without a motion."""
    before = names(folder).count("kickWatchdog")
    until(lambda: names(folder).count("kickWatchdog") >= before + times)


@pytest.mark.slow
def test_an_arm_is_brought_up_moves_tares_stops_and_leaves_nothing(tmp_path):
    files = len(os.listdir("/proc/self/fd"))
    settings = replace(PATIENT, payload=FlangePayload(0.4, (0.0, 0.0, 0.05)), speed_slider=0.5)
    with arm_on(tmp_path, settings) as arm:
        device: ArmDevice = arm
        assert str(tmp_path) in device.name
        pid, before = arm.process_id, device.read()
        assert before.position_base_tip == (0.1, 0.2, 0.3)
        # the watchdog first: nothing may move without it
        setup = [n for n in names(tmp_path) if n not in ("isInRemoteControl", "connect", "disconnect")]
        assert setup[:5] == ["upload", "setWatchdog", "setTcp", "setPayload", "setSpeedSlider"]
        there = before.position_base_tip[0] + 0.001
        until(lambda: device.move((0.02, 0.0, 0.0), ZERO) or device.read().position_base_tip[0] > there)
        after = device.read()
        assert after.time > before.time
        assert after.velocity_base_tip == (0.02, 0.0, 0.0)
        with pytest.raises(InvalidValueError, match=r"UrSettings\.speed"):
            arm.move((1.0, 0.0, 0.0), ZERO)
        # neither a command that is followed nor one that is not yet moves the arm after a tare
        for tares in range(1, 6):
            arm.move((0.01, 0.0, 0.0), ZERO)
            arm.tare()
            fed(tmp_path, 1)
            assert names(tmp_path).count("zeroFtSensor") == tares
            assert "speedL" not in since_last(tmp_path, "zeroFtSensor")
        arm.stop()
        fed(tmp_path, 3)  # at rest, too
        move(tmp_path, arm)
    assert names(tmp_path)[-2:] == ["speedStop", "stopScript"]
    assert "CONCURRENT" not in names(tmp_path)
    assert process_ended(pid)
    assert len(os.listdir("/proc/self/fd")) == files
    arm.close()
    with pytest.raises(DeviceError, match="start"):
        arm.read()


@pytest.mark.slow
def test_without_commands_an_arm_comes_to_rest_and_goes_on_with_the_next(tmp_path):
    with arm_on(tmp_path, UrSettings(stale_after=1.0, watchdog=0.1)) as arm:
        arm.move((0.01, 0.0, 0.0), ZERO)
        until(lambda: "speedStop" in names(tmp_path))
        until(lambda: arm.read().velocity_base_tip == ZERO)
        fed(tmp_path, 5)
        assert "speedL" not in since_last(tmp_path, "speedStop")  # the old command does not come back
        assert arm._client.exchange.status().lapses == 1
        until(lambda: arm.move((0.01, 0.0, 0.0), ZERO) or arm.read().velocity_base_tip[0] == 0.01)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("silent", "no state"),
        pytest.param("receive lost", "sends its state was lost", marks=pytest.mark.slow),
        pytest.param("control lost", "commands it was lost", marks=pytest.mark.slow),
        ("storm", "commands it was lost"),
        pytest.param("stopped", "program was stopped", marks=pytest.mark.slow),
        ("protective", "protective stop"),
        pytest.param("emergency", "emergency stop", marks=pytest.mark.slow),
        pytest.param("refuse", "refused", marks=pytest.mark.slow),
        pytest.param("back", "clock went back", marks=pytest.mark.slow),
        ("crash", "signal 11"),
        pytest.param("killed", "signal 9", marks=pytest.mark.slow),
    ],
)
def test_every_fault_is_reported_with_a_remedy_and_recovered_from(tmp_path, capfd, fault, message):
    with arm_on(tmp_path) as arm:
        arm.move((0.01, 0.0, 0.0), ZERO)
        if fault == "killed":
            os.kill(arm.process_id, signal.SIGKILL)
        else:
            spoil(tmp_path, fault)
        error = waiting.first_error(arm.read)
        assert message in str(error)
        assert error.device == arm.name
        assert "`palpate recover`" in error.remedy
        with pytest.raises(DeviceError):
            arm.move(ZERO, ZERO)
        if fault == "emergency":
            with pytest.raises(DeviceError, match="release"):
                arm.recover()
            assert "release" in waiting.first_error(arm.read).remedy
        if fault != "protective":  # that one is unlocked by recover()
            (tmp_path / "fault").unlink(missing_ok=True)
        arm.recover()
        arm.move((0.02, 0.0, 0.0), ZERO)
        until(lambda: arm.read().velocity_base_tip[0] == 0.02)
    assert "CONCURRENT" not in names(tmp_path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("fault", "library", "message"),
    [
        pytest.param("silent", "support.fake_ur_library", "no state any more.*network", marks=pytest.mark.slow),
        ("local", "support.fake_ur_library", "Remote Control"),
        ("", "there_is_no_such_library", "last output.*No module named"),
    ],
)
def test_a_failed_start_is_reported_and_loads_nothing(tmp_path, capfd, fault, library, message):
    spoil(tmp_path, fault)
    with pytest.raises(DeviceError, match=message):
        UrArm(str(tmp_path), PATIENT, library=library).start()
    calls = tmp_path / "calls"
    assert not calls.exists() or "upload" not in names(tmp_path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_an_old_state_is_blamed_on_controller_or_client_and_a_late_one_is_accepted(arm, monkeypatch):
    """The client publishes its beat more often than states: where both are old, it is not the controller."""
    whole, oldest = arm._client.exchange.status(), arm.settings.stale_after
    # a state that arrives just as its age is found: it was refused, as "11 ms old; the limit is 800 ms"
    late = replace(whole, sampled=whole.sampled - 2.0 * oldest, beat=math.inf)
    monkeypatch.setattr(arm._client, "status", lambda: late)
    assert arm.read().time > late.sampled
    monkeypatch.setattr(palpate.hw.ur.arm, "monotonic", lambda: whole.sampled + 1.1 * oldest)
    monkeypatch.setattr(arm._client.exchange, "state", lambda: None)
    for beat, message in ((0.0, "no state any more"), (0.7, "hangs, or is starved")):
        late = replace(whole, beat=whole.sampled + (1.1 - beat) * oldest)
        with pytest.raises(DeviceError, match=message):
            arm.read()


@pytest.mark.slow
def test_a_client_that_hangs_is_noticed_and_replaced(tmp_path, monkeypatch):
    with arm_on(tmp_path, UrSettings(stale_after=0.1)) as arm:
        pid = arm.process_id
        os.kill(pid, signal.SIGSTOP)
        assert "hangs" in str(waiting.first_error(arm.read))
        until(lambda: not arm._client.responsive)
        arm.recover()  # by force
        assert process_ended(pid)
        arm.read()
    # a call that never returns
    monkeypatch.setattr(palpate.hw.ur.arm, "_REPLY_WITHIN", 0.5)
    with arm_on(tmp_path) as arm:
        spoil(tmp_path, "deaf")
        pid = arm.process_id
        with pytest.raises(DeviceError, match="no reply to tare"):
            arm.tare()
        assert process_ended(pid)
        (tmp_path / "fault").unlink()
        arm.recover()
        arm.tare()


@pytest.mark.slow
def test_an_abandoned_reply_is_not_taken_for_the_next_one(tmp_path, arm):
    """As after Ctrl-C in the middle of a request."""
    arm._client._pipe.send(UrRequest(UrTask.REST))
    spoil(tmp_path, "refuse")
    with pytest.raises(DeviceError, match="zeroFtSensor"):
        arm.tare()


@pytest.mark.slow
def test_files_with_the_names_of_python_s_modules_do_not_get_into_the_client(tmp_path, monkeypatch):
    """A working folder may have a queue.py and a socket.py of its own."""
    work = tmp_path / "work"
    work.mkdir()
    for name in ("queue", "socket", "signal", "palpate"):
        (work / f"{name}.py").write_text("raise SystemExit('not this one')")
    monkeypatch.chdir(work)
    with arm_on(tmp_path) as arm:
        arm.read()


PARENT = """
import sys, time
import palpate.hw.ur.arm
palpate.hw.ur.arm.controller_version = lambda name, address: (5, 14, 0, 0)
from palpate.hw.ur import UrArm
arm = UrArm(sys.argv[1], library="support.fake_ur_library")  # on purpose without a __main__ guard
arm.start()
print(arm.process_id, flush=True)
while True:
    arm.move((0.01, 0.0, 0.0), (0.0, 0.0, 0.0))
    time.sleep(2e-3)
"""


@pytest.mark.parametrize("how", [signal.SIGKILL, pytest.param(signal.SIGINT, marks=pytest.mark.slow)])
def test_when_its_parent_dies_the_client_stops_the_arm_and_dies(tmp_path, how):
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT, str(tmp_path)],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env=environment,
        text=True,
    )
    try:
        pid = int(parent.stdout.readline())
        until(lambda: "speedL" in names(tmp_path))
        parent.send_signal(how)
        parent.wait(WITHIN)
        until(lambda: process_ended(pid))
    finally:
        parent.kill()
        parent.wait(WITHIN)
        parent.stdout.close()
    assert names(tmp_path)[-1] == "stopScript"
    assert "speedStop" in since_last(tmp_path, "speedL")
