"""The client process, with a made-up library in it: whatever becomes of it, the arm's process lives on."""

import contextlib
import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import psutil
import pytest

import palpate.hw.ur.arm
from palpate.errors import InvalidValueError
from palpate.hw.devices import ArmDevice, DeviceError
from palpate.hw.ur import FlangePayload, UrArm, UrSettings
from palpate.hw.ur.requests import UrRequest, UrTask
from palpate.kinematics.pose import Pose
from support import waiting
from support.waiting import WITHIN, until

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


def spoil(folder: Path, fault: str) -> None:
    (folder / "new").write_text(fault)
    (folder / "new").replace(folder / "fault")  # never half written


def names(folder: Path) -> list[str]:
    return [line.split()[0] for line in (folder / "calls").read_text().splitlines()]


def first_error(arm: UrArm) -> DeviceError:
    """Read until it fails."""
    return waiting.first_error(arm.read)


def fed(folder: Path, times: int) -> None:
    """Wait until the watchdog has been fed some more, without a motion: as long as a few of its times take."""
    before = names(folder).count("kickWatchdog")
    until(lambda: names(folder).count("kickWatchdog") >= before + times)


def gone(pid: int) -> bool:
    return not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE


def test_it_is_an_arm_device(tmp_path):
    with arm_on(tmp_path) as arm:
        device: ArmDevice = arm
        assert str(tmp_path) in device.name
        before = device.read()
        assert before.position_base_tip == (0.1, 0.2, 0.3)

        def moved() -> bool:
            device.move((0.02, 0.0, 0.0), ZERO)
            return device.read().position_base_tip[0] > before.position_base_tip[0] + 0.001

        until(moved)
        after = device.read()
        assert after.time > before.time
        assert after.velocity_base_tip == (0.02, 0.0, 0.0)
    assert "CONCURRENT" not in names(tmp_path)


@pytest.mark.slow
def test_the_watchdog_is_set_before_anything_moves_and_fed_while_nothing_does(tmp_path):
    with arm_on(tmp_path) as arm:
        arm.move((0.01, 0.0, 0.0), ZERO)
        until(lambda: "speedL" in names(tmp_path))
        arm.stop()
        fed(tmp_path, 5)
    order = [n for n in names(tmp_path) if n in ("upload", "setWatchdog", "setTcp", "speedL", "kickWatchdog")]
    assert order[:2] == ["upload", "setWatchdog"]
    assert "kickWatchdog" in order[order.index("speedL") :]


def test_closing_stops_the_arm_then_the_script_and_leaves_nothing(tmp_path):
    files = len(os.listdir("/proc/self/fd"))
    with arm_on(tmp_path) as arm:
        pid = arm.process_id
        arm.move((0.01, 0.0, 0.0), ZERO)
        until(lambda: "speedL" in names(tmp_path))
    assert names(tmp_path)[-2:] == ["speedStop", "stopScript"]
    assert gone(pid)
    assert len(os.listdir("/proc/self/fd")) == files
    arm.close()
    with pytest.raises(DeviceError, match="start"):
        arm.read()


def test_other_motions_wait_until_the_one_before_has_ended(tmp_path):
    with arm_on(tmp_path) as arm:
        arm.move((0.01, 0.0, 0.0), ZERO)
        until(lambda: "speedL" in names(tmp_path))
        arm.servo_joints(arm.state().joint_position)
        until(lambda: "servoJ" in names(tmp_path))
        s = arm.read()
        arm.servo_pose(Pose(s.position_base_tip, s.rotation_base_tip))
        until(lambda: "servoL" in names(tmp_path))
    order = [n for n in names(tmp_path) if n not in ("kickWatchdog",)]
    begun = {n: order.index(n) for n in ("speedL", "speedStop", "servoJ", "servoStop", "servoL")}
    assert list(begun) == sorted(begun, key=begun.__getitem__)


def test_an_arm_that_hears_nothing_comes_to_rest_and_goes_on_when_it_does(tmp_path):
    with arm_on(tmp_path, UrSettings(stale_after=1.0, watchdog=0.1)) as arm:
        arm.move((0.01, 0.0, 0.0), ZERO)
        until(lambda: "speedStop" in names(tmp_path))
        until(lambda: arm.read().velocity_base_tip == ZERO)
        fed(tmp_path, 5)  # the old command does not come back
        assert names(tmp_path).index("speedStop") > len(names(tmp_path)) - 1 - names(tmp_path)[::-1].index(
            "speedL"
        )

        def moves() -> bool:
            arm.move((0.01, 0.0, 0.0), ZERO)
            return arm.read().velocity_base_tip[0] == 0.01

        until(moves)


def test_a_command_given_before_a_tare_does_not_move_the_arm_after_it(tmp_path):
    """Neither one that is being followed nor one that has not been yet."""
    with arm_on(tmp_path) as arm:
        arm.move((0.01, 0.0, 0.0), ZERO)
        until(lambda: "speedL" in names(tmp_path))
        for tares in range(1, 6):
            arm.move((0.01, 0.0, 0.0), ZERO)
            arm.tare()
            fed(tmp_path, 1)
            done = names(tmp_path)
            assert done.count("zeroFtSensor") == tares
            assert "speedL" not in done[len(done) - done[::-1].index("zeroFtSensor") :]


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
    ],
)
def test_every_fault_is_reported_with_a_remedy_and_recovered_from(tmp_path, fault, message):
    with arm_on(tmp_path) as arm:
        arm.move((0.01, 0.0, 0.0), ZERO)
        spoil(tmp_path, fault)
        error = first_error(arm)
        assert message in str(error)
        assert error.device == arm.name
        assert "`palpate recover`" in error.remedy
        with pytest.raises(DeviceError):
            arm.move(ZERO, ZERO)
        if fault == "emergency":
            with pytest.raises(DeviceError, match="release"):
                arm.recover()
            assert "release" in first_error(arm).remedy
        if fault != "protective":  # that one is unlocked by recover()
            (tmp_path / "fault").unlink()
        arm.recover()
        arm.move((0.02, 0.0, 0.0), ZERO)
        until(lambda: arm.read().velocity_base_tip[0] == 0.02)
    assert "CONCURRENT" not in names(tmp_path)


@pytest.mark.slow
def test_a_controller_that_says_nothing_while_the_arm_is_brought_up_is_blamed(tmp_path):
    spoil(tmp_path, "silent")
    with pytest.raises(DeviceError, match="no state any more") as refused, arm_on(tmp_path):
        pass
    assert "controller and network" in refused.value.remedy


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSEGV, signal.SIGABRT])
def test_the_death_of_the_client_is_reported_by_the_next_call(tmp_path, how):
    with arm_on(tmp_path) as arm:
        os.kill(arm.process_id, how)
        os.waitid(os.P_PID, arm.process_id, os.WEXITED | os.WNOWAIT)  # it stays there for others to wait for
        with pytest.raises(DeviceError, match=f"signal {int(how)}"):
            arm.read()
        arm.recover()
        arm.read()


@pytest.mark.parametrize(("beat", "message"), [(0.0, "no state any more"), (0.7, "hangs, or is starved")])
def test_who_stands_still_is_blamed(tmp_path, monkeypatch, beat, message):
    """The client tells of itself more often than of states: where both are old, it is not the controller."""
    with arm_on(tmp_path) as arm:
        whole, oldest = arm._client.exchange.status(), arm.settings.stale_after
        monkeypatch.setattr(palpate.hw.ur.arm, "monotonic", lambda: whole.sampled + 1.1 * oldest)
        late = replace(whole, beat=whole.sampled + (1.1 - beat) * oldest)
        monkeypatch.setattr(arm._client, "status", lambda: late)
        with pytest.raises(DeviceError, match=message):
            arm.read()


def test_a_state_that_comes_just_as_it_is_found_to_be_late_is_believed(tmp_path, monkeypatch):
    """It was refused, as "11 ms old; the limit is 800 ms"."""
    with arm_on(tmp_path) as arm:
        whole = arm._client.exchange.status()
        late = replace(whole, sampled=whole.sampled - 2.0 * arm.settings.stale_after, beat=math.inf)
        monkeypatch.setattr(arm._client, "status", lambda: late)
        assert arm.read().time > late.sampled


@pytest.mark.slow
def test_a_client_that_hangs_is_noticed_by_its_silence_and_replaced(tmp_path):
    with arm_on(tmp_path, UrSettings(stale_after=0.1)) as arm:
        pid = arm.process_id
        os.kill(pid, signal.SIGSTOP)
        assert "hangs" in str(first_error(arm))
        until(lambda: not arm._client.responsive)
        arm.recover()  # by force
        assert gone(pid)
        arm.read()


@pytest.mark.slow
def test_a_call_that_never_comes_back_is_given_up(tmp_path, monkeypatch):
    monkeypatch.setattr(palpate.hw.ur.arm, "_REPLY_WITHIN", 0.5)
    with arm_on(tmp_path) as arm:
        spoil(tmp_path, "deaf")
        pid = arm.process_id
        with pytest.raises(DeviceError, match="no reply to tare"):
            arm.tare()
        assert gone(pid)
        (tmp_path / "fault").unlink()
        arm.recover()
        arm.tare()


def test_an_abandoned_reply_is_not_taken_for_the_next_one(tmp_path):
    """As after Ctrl-C in the middle of a request."""
    with arm_on(tmp_path) as arm:
        arm._client._pipe.send(UrRequest(UrTask.TARE))
        spoil(tmp_path, "refuse")
        with pytest.raises(DeviceError, match="setPayload"):
            arm.set_payload(FlangePayload(0.1))


def test_local_control_is_refused_with_the_way_out(tmp_path):
    spoil(tmp_path, "local")
    with pytest.raises(DeviceError, match="Remote Control"):
        UrArm(str(tmp_path), PATIENT, library="support.fake_ur_library").start()
    assert "upload" not in names(tmp_path)


def test_the_library_s_output_is_kept_from_the_terminal_and_reported_at_its_death(tmp_path, capfd):
    with arm_on(tmp_path) as arm:
        spoil(tmp_path, "crash")
        first_error(arm)
    with pytest.raises(DeviceError, match="No module named"):
        UrArm(str(tmp_path), PATIENT, library="there_is_no_such_library").start()
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_freedrive_excludes_motion_and_ends(tmp_path):
    with arm_on(tmp_path) as arm:
        with arm.freedrive():
            with pytest.raises(DeviceError, match="by hand"):
                arm.move(ZERO, ZERO)
            fed(tmp_path, 5)
            arm.read()
        arm.move((0.01, 0.0, 0.0), ZERO)
        until(lambda: "speedL" in names(tmp_path))
    order = [n for n in names(tmp_path) if n in ("freedriveMode", "endFreedriveMode", "speedL")]
    assert order[:3] == ["freedriveMode", "endFreedriveMode", "speedL"]


@pytest.mark.slow
def test_an_arm_that_moves_can_be_led_at_once(tmp_path):
    """It comes to rest first; the cause does not end the leading, nor keep the watchdog from being fed."""
    with arm_on(tmp_path) as arm:
        for led in range(1, 5):
            moved = names(tmp_path).count("speedL")
            arm.move((0.01, 0.0, 0.0), ZERO)
            until(lambda moved=moved: names(tmp_path).count("speedL") > moved)
            with arm.freedrive():
                fed(tmp_path, 5)
                arm.read()
                done = names(tmp_path)
                assert done.count("freedriveMode") == led
                assert done.count("endFreedriveMode") == led - 1


def test_files_that_are_called_as_python_s_own_do_not_get_into_the_client(tmp_path, monkeypatch):
    """Somebody works in a folder with a queue.py and a socket.py of his own."""
    work = tmp_path / "work"
    work.mkdir()
    for name in ("queue", "socket", "signal", "palpate"):
        (work / f"{name}.py").write_text("raise SystemExit('not this one')")
    monkeypatch.chdir(work)
    with arm_on(tmp_path) as arm:
        arm.read()


def test_too_fast_is_refused_and_not_sent(tmp_path):
    with arm_on(tmp_path) as arm:
        with pytest.raises(InvalidValueError, match=r"UrSettings\.speed"):
            arm.move((1.0, 0.0, 0.0), ZERO)
        fed(tmp_path, 1)
    assert "speedL" not in names(tmp_path)


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
        until(lambda: gone(pid))
    finally:
        parent.kill()
        parent.wait(WITHIN)
        parent.stdout.close()
    done = names(tmp_path)
    assert done[-1] == "stopScript"
    assert "speedStop" in done[len(done) - done[::-1].index("speedL") :]
