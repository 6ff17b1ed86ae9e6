"""A UR arm over the real ur_rtde and real sockets, on loopback only, against an emulated controller.

Where ur_rtde 1.6.5 goes wrong, and what shows here that it does no harm:

| | fault | handled by | shown by |
|---|---|---|---|
| 1 | reconnects after a loss until it crashes | own process, ended at once | `lost_connection` |
| 2 | does not notice silence | age of the state, at commands too | `lost_connection`, `killed_controller` |
| 3 | receiving does not reconnect, or hangs at it | never asked to: a new process | `must_not_be_made` |
| 4 | getters that reply with old registers | not called | `must_not_be_made` |
| 5 | lengths are not checked | checked before | `exchange`: `wrong_lengths` |
| 6 | forward kinematics with an old tool | not called; `palpate.kinematics` | `must_not_be_made` |
| 7 | setExternalForceTorque | not called | `must_not_be_made` |
| 8 | upper range registers | not called | `must_not_be_made` |
| 9 | analog outputs, user role | not called | `must_not_be_made` |
| 10 | stopL and stopJ mixed up | speedStop, servoStop, forceModeStop | `must_not_be_made` |
| 11 | getters are no snapshot | time stamp before and after | `exchange`: `one_cycle` |
| 12 | an input register has one owner | the second is refused, the first goes on | `second_client` |
| 13 | constructors, destructors stop all threads | own process, left without destructors | `threads` |
| 14 | waitPeriod | not called: own deadlines | `must_not_be_made` |
| 15 | prints; not for two threads | outputs kept; one lock | `printed`; CONCURRENT in `process` |
| 16 | a refused start goes unnoticed | connection asked for afterwards | `refuses` |
| 17 | servoC | not called: servoJ, servoL | `must_not_be_made` |
| 18 | a command may overwrite the one before | cycles are left between them | `overwrite` |

`exchange` and `process` are the other two files test_wire_ur_*.py.
"""

import ast
import contextlib
import math
import os
import signal
import threading
import time
from collections.abc import Iterator
from itertools import count
from pathlib import Path

import psutil
import pytest

import palpate.hw.ur.library
from palpate.hw.devices import DeviceError, SensorDevice
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.simple_plant import ElasticPlane
from palpate.hw.emulators.ur import ControllerVersion, SimpleUr
from palpate.hw.ur import FlangePayload, ForceTask, UrArm, UrRawToolSensor, UrSettings, UrToolSensor
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.spatial import add
from support import waiting
from support.ur_library import needs_ur
from support.waiting import until

pytestmark = needs_ur

ZERO = (0.0, 0.0, 0.0)
PATIENT = UrSettings(stale_after=2.0, watchdog=1.0)
"""For tests that are not about time: the machine may stall."""

HEIGHT = 0.4879
"""[m] at which the emulated arm starts."""

_hosts = count(2)


@contextlib.contextmanager
def controller(**changed) -> Iterator[EmulatorProcess]:
    """An emulator at a loopback address that no other one has, in this process or another."""
    address = f"127.{1 + os.getpid() % 100}.{os.getpid() // 100 % 250}.{next(_hosts)}"
    with EmulatorProcess(SimpleUr(address, **{"unlock_delay": 0.2, **changed})) as emulator:
        yield emulator


@pytest.fixture(scope="module")
def shared() -> Iterator[EmulatorProcess]:
    """For tests that leave it as it was."""
    with controller() as emulator:
        yield emulator


def address(emulator: EmulatorProcess) -> str:
    return emulator.addresses["ur"]


def follow(arm: UrArm, velocity) -> None:
    """Command a velocity until the arm has it."""
    until(lambda: arm.move(velocity, ZERO) or arm.read().velocity_base_tip == pytest.approx(velocity, abs=1e-3))


def first_error(arm: UrArm) -> DeviceError:
    """Command until it fails."""
    return waiting.first_error(lambda: arm.move((0.01, 0.0, 0.0), ZERO))


def truth(emulator: EmulatorProcess, name: str) -> list[float]:
    """A vector of the plant's."""
    found = emulator.control.state()[name]
    assert isinstance(found, list)
    return found


def at_rest(emulator: EmulatorProcess) -> bool:
    return math.hypot(*truth(emulator, "velocity")) < 1e-6


# -- what it does --


@pytest.mark.slow
def test_it_moves_as_commanded_and_reports_where_it_is(shared):
    with UrArm(address(shared), PATIENT) as arm:
        assert arm.version[:2] == (5, 14)
        before = arm.read()

        def arrived() -> bool:
            arm.move((0.0, 0.02, 0.01), ZERO)
            return arm.read().position_base_tip[1] > before.position_base_tip[1] + 0.008

        until(arrived)
        assert arm.read().velocity_base_tip == pytest.approx((0.0, 0.02, 0.01), abs=1e-4)
        arm.stop()
        until(lambda: at_rest(shared))
        # what the arm says is what the plant knows
        until(lambda: arm.read().position_base_tip == pytest.approx(truth(shared, "position"), abs=1e-9))
        after = arm.read()
        moved = [b - a for a, b in zip(before.position_base_tip, after.position_base_tip, strict=True)]
        assert moved[2] == pytest.approx(0.5 * moved[1], rel=1e-3)
        assert abs(moved[0]) < 1e-6
        assert before.time < after.time


@pytest.mark.slow
def test_it_turns_as_commanded(shared):
    with UrArm(address(shared), PATIENT) as arm:
        before = arm.read()

        def turned() -> bool:
            arm.move(ZERO, (0.0, 0.0, 0.2))
            return arm.read().rotation_base_tip[0] != pytest.approx(before.rotation_base_tip[0], abs=0.03)

        until(turned)
        assert arm.read().angular_velocity_base_tip == pytest.approx((0.0, 0.0, 0.2), abs=1e-3)
        arm.stop()
        until(lambda: at_rest(shared))
        time.sleep(0.05)
        after = arm.read()
        assert after.position_base_tip == pytest.approx(before.position_base_tip, abs=1e-5)
        assert after.rotation_base_tip[2] == pytest.approx(before.rotation_base_tip[2], abs=1e-6)  # about z
        assert after.rotation_base_tip[0] != pytest.approx(before.rotation_base_tip[0], abs=1e-2)


@pytest.mark.slow
def test_joint_and_pose_servo_reach_a_goal_they_are_led_to(shared):
    with UrArm(address(shared), PATIENT) as arm:
        start = arm.state().joint_position
        goal = [q + 0.05 for q in start]
        for i in range(1, 101):
            arm.servo_joints([a + (b - a) * i / 100 for a, b in zip(start, goal, strict=True)])
            time.sleep(4e-3)
        until(lambda: arm.servo_joints(goal) or arm.state().joint_position == pytest.approx(goal, abs=1e-3))
        pose = arm.read()
        there = add(pose.position_base_tip, (0.005, 0.0, 0.01))
        for i in range(1, 51):
            way = (0.005 * i / 50, 0.0, 0.01 * i / 50)
            arm.servo_pose(Pose(add(pose.position_base_tip, way), pose.rotation_base_tip))
            time.sleep(4e-3)
        last = Pose(there, pose.rotation_base_tip)
        until(lambda: arm.servo_pose(last) or arm.read().position_base_tip == pytest.approx(there, abs=1e-4))


@pytest.mark.slow
def test_force_mode_presses_and_both_sensors_feel_it():
    """The object pushes back: normal force -f.n is what was asked for, n out of the tool, into the object."""
    with controller(plane=ElasticPlane(HEIGHT - 0.002)) as emulator, UrArm(address(emulator), PATIENT) as arm:
        felt, raw = UrToolSensor(arm), UrRawToolSensor(arm)
        for sensor in (felt, raw):
            device: SensorDevice = sensor
            device.start()
            device.tare()
        task = ForceTask((False, False, True, False, False, False), (0.0, 0.0, -8.0, 0.0, 0.0, 0.0))

        def pressed() -> bool:
            arm.push(task)
            rotation = arm.read().rotation_base_tip
            down_in_tip = tuple(-rotation[2][i] for i in range(3))
            force = felt.read().wrench[:3]
            return -sum(f * n for f, n in zip(force, down_in_tip, strict=True)) == pytest.approx(8.0, rel=0.05)

        until(pressed)
        assert felt.read().healthy
        assert math.hypot(*raw.read().wrench[:3]) == pytest.approx(8.0, rel=0.2)
        # about the TCP: a point of contact has no moment about itself
        assert math.hypot(*felt.read().wrench[3:]) < 0.05
        felt.tare()
        assert math.hypot(*felt.read().wrench[:3]) < 1.0


@pytest.mark.slow
def test_freedrive_lets_go_and_holds_again(shared):
    with UrArm(address(shared), PATIENT) as arm:
        with arm.freedrive():
            begun = shared.control.state()["time"]
            # longer than the watchdog: nobody commands, and yet it is fed
            until(lambda: shared.control.state()["time"] > begun + 1.1 * PATIENT.watchdog)
            arm.read()
        follow(arm, (0.0, 0.0, 0.01))


@pytest.mark.slow
def test_tool_payload_and_slider_are_set(shared):
    flange_tip = Pose((0.0, 0.0, 0.1), rotation_from_rotvec((0.0, 0.0, 0.5)))
    settings = UrSettings(
        pose_flange_tip=flange_tip, payload=FlangePayload(0.4, (0.0, 0.0, 0.05)), stale_after=2.0, watchdog=1.0
    )
    with UrArm(address(shared), PATIENT) as arm:
        bare = arm.read()
    with UrArm(address(shared), settings) as arm:
        # the tip is 0.1 m along the flange's z
        axis = [row[2] for row in bare.rotation_base_tip]
        wanted = [p + 0.1 * a for p, a in zip(bare.position_base_tip, axis, strict=True)]
        until(lambda: arm.read().position_base_tip == pytest.approx(wanted, abs=1e-6))
        arm.set_tool(Pose())
        until(lambda: arm.read().position_base_tip == pytest.approx(bare.position_base_tip, abs=1e-6))
        arm.set_payload(FlangePayload(0.0))
        arm.set_speed_slider(0.5)
        until(lambda: arm.state().speed_slider == pytest.approx(0.5))
        arm.set_speed_slider(1.0)
        until(lambda: arm.state().speed_slider == pytest.approx(1.0))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("version", "scale"),
    [
        (ControllerVersion(3, 15, 0, 0), 1.0),
        (ControllerVersion(5, 23, 0, 0), 1.0),
        (ControllerVersion(10, 10, 0, 0), 1.0),
        (ControllerVersion(), 3.0),
    ],
)
def test_other_versions_and_a_clock_that_runs_faster(version, scale):
    with controller(version=version, scale=scale) as emulator:
        settings = UrSettings(stale_after=2.0, watchdog=1.0)
        with UrArm(address(emulator), settings) as arm:
            assert arm.version[0] == version.major
            stalled = emulator.control.state()["given_up"]
            begun = arm.state()
            until(lambda: arm.move((0.0, 0.01, 0.0), ZERO) or arm.state().time > begun.time + 1.5)
            ended = arm.state()
            stalled = emulator.control.state()["given_up"] - stalled  # by the machine: time that it left out
            assert ended.tool_pose[1] > begun.tool_pose[1] + 1e-3
            passed = ended.time - begun.time - stalled
            assert ended.controller_time - begun.controller_time == pytest.approx(scale * passed, rel=0.3, abs=0.2)
            if version.major == 3:
                with pytest.raises(DeviceError, match="raw wrench"):
                    UrRawToolSensor(arm).start()


# -- what goes wrong --


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["drop_fin", "drop_rst", "stall_stream"])
def test_a_lost_connection_is_detected_reported_and_recovered_from(shared, fault):
    emulator = shared
    with UrArm(address(emulator), UrSettings(stale_after=0.25, watchdog=0.4)) as arm:
        follow(arm, (0.01, 0.0, 0.0))
        uploads = len([line for line in emulator.control.log("ur") if "uploaded" in line])
        pid = arm.process_id
        emulator.control.fault("ur", fault)
        error = first_error(arm)
        assert error.device == arm.name
        assert "`palpate recover`" in error.remedy
        until(lambda: at_rest(emulator))
        # the client ends before the library's time-out of 2.5 s: no storm
        until(lambda: not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE)
        time.sleep(0.5)
        after = len([line for line in emulator.control.log("ur") if "uploaded" in line])
        assert after - uploads <= 1
        if fault == "stall_stream":
            emulator.control.fault("ur", fault, 0.0)
        arm.recover()
        follow(arm, (-0.01, 0.0, 0.0))


@pytest.mark.slow
def test_a_killed_controller_is_noticed_and_its_successor_recovered_to():
    with controller() as emulator:
        arm = UrArm(address(emulator), UrSettings(stale_after=0.25, watchdog=0.4))
        with arm:
            follow(arm, (0.01, 0.0, 0.0))
            emulator.kill()
            assert "`palpate recover`" in first_error(arm).remedy
            with pytest.raises(DeviceError, match="switched on"):
                arm.recover()
            with EmulatorProcess(SimpleUr(address(emulator))):
                arm.recover()
                follow(arm, (0.01, 0.0, 0.0))


def test_a_protective_stop_in_motion_is_noticed_unlocked_and_gone_on_from(shared):
    emulator = shared
    with UrArm(address(emulator), PATIENT) as arm:
        follow(arm, (0.01, 0.0, 0.0))
        emulator.control.fault("ur", "protective_stop")
        assert "protective stop" in str(first_error(arm))
        until(lambda: at_rest(emulator))
        with pytest.raises(DeviceError, match="clear whatever"):
            arm.tare()
        arm.recover()  # waits until it lets itself be unlocked
        at = truth(emulator, "position")
        begun = arm.state().controller_time
        until(lambda: arm.state().controller_time > begun + 0.1)
        assert truth(emulator, "position") == at  # nothing of before goes on
        follow(arm, (0.01, 0.0, 0.0))


@pytest.mark.slow
def test_an_emergency_stop_needs_a_hand_then_power_and_brakes(shared):
    emulator = shared
    with UrArm(address(emulator), PATIENT) as arm:
        follow(arm, (0.01, 0.0, 0.0))
        emulator.control.fault("ur", "e_stop")
        assert "emergency stop" in str(first_error(arm))
        until(lambda: at_rest(emulator))
        with pytest.raises(DeviceError, match="release"):
            arm.recover()
        emulator.control.fault("ur", "e_stop", 0.0)
        arm.recover()
        follow(arm, (0.01, 0.0, 0.0))


@pytest.mark.slow
def test_a_program_stopped_at_the_pendant_is_reported(shared):
    with UrArm(address(shared), PATIENT) as arm:
        follow(arm, (0.0, 0.0, 0.01))
        shared.control.fault("ur", "kill_program")
        assert "program was stopped" in str(first_error(arm))
        arm.recover()
        follow(arm, (0.0, 0.0, 0.01))


def test_the_controller_s_watchdog_stops_the_arm_when_the_client_is_killed_in_motion(shared):
    settings = UrSettings(stale_after=2.0, watchdog=0.5)
    with UrArm(address(shared), settings) as arm:
        follow(arm, (0.0, 0.0, 0.02))
        os.kill(arm.process_id, signal.SIGKILL)
        at = arm._client.exchange.state().tool_pose[2]
        assert "watchdog" in str(first_error(arm))
        until(lambda: at_rest(shared))
        # by its own clock, which a stalled machine stops as well: 4 mm and the last few cycles
        assert truth(shared, "position")[2] - at < 0.02 * settings.watchdog + 0.004
        assert any("watchdog" in line for line in shared.control.log("ur"))
        arm.recover()
        arm.read()


def test_a_second_client_is_refused_and_the_first_goes_on(shared):
    with UrArm(address(shared), PATIENT) as first:
        second = UrArm(address(shared), PATIENT)
        with pytest.raises(DeviceError, match=address(shared)):
            second.start()
        follow(first, (0.0, 0.0, 0.01))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("local_control", "Remote Control"),
        ("refuse_version", "RTDE"),
        ("reject_start", "refused to send"),
        ("withhold_greeting", "does not greet"),
    ],
)
def test_a_controller_that_refuses_is_reported_and_nothing_is_left(shared, fault, message):
    emulator = shared
    emulator.control.fault("ur", fault)
    arm = UrArm(address(emulator), PATIENT)
    children = {child.pid for child in psutil.Process().children(recursive=True)}
    try:
        with pytest.raises(DeviceError, match=message):
            arm.start()
        assert {child.pid for child in psutil.Process().children(recursive=True)} <= children
    finally:
        emulator.control.fault("ur", fault, 0.0)
    with arm:
        arm.read()


@pytest.mark.slow
def test_a_script_that_starts_late_is_waited_for(shared):
    shared.control.fault("ur", "late_start", 1.5)
    try:
        with UrArm(address(shared), PATIENT) as arm:
            arm.read()
    finally:
        shared.control.fault("ur", "late_start", 0.0)


@pytest.mark.slow
def test_too_old_a_version_is_named():
    with (
        controller(version=ControllerVersion(5, 4, 0, 0)) as emulator,
        pytest.raises(DeviceError, match=r"5\.4\.0\.0 is not supported.*5\.10"),
    ):
        UrArm(address(emulator)).start()


def test_an_absent_device_is_reported():
    with pytest.raises(DeviceError, match=r"no controller replies.*switched on"):
        UrArm("127.0.0.254").start()


# -- ur_rtde's own faults --


@pytest.mark.slow
def test_a_command_does_not_overwrite_the_one_before(shared):
    """A velocity that is followed at once by something else has been executed, and the other is, too."""
    with UrArm(address(shared), PATIENT) as arm:
        before = shared.control.log("ur")
        heights = [arm.read().position_base_tip[2]]
        for _ in range(10):
            arm.move((0.0, 0.0, 0.05), ZERO)
            sent = arm._number
            until(lambda number=sent: arm._client.exchange.status().followed >= number)
            arm.tare()
            until(lambda: at_rest(shared) and arm.read().position_base_tip[2] > heights[-1] + 1e-6)
            heights.append(arm.read().position_base_tip[2])
        assert len(shared.control.log("ur")) > len(before)


def test_the_library_s_threads_and_connections_are_in_another_process_than_ours(shared):
    ours = psutil.Process()
    threads = ours.num_threads()
    with UrArm(address(shared), PATIENT) as arm:
        at_controller = {
            its.pid
            for its in (ours, *ours.children(recursive=True))
            for connection in its.net_connections("tcp")
            if connection.raddr and connection.raddr.ip == address(shared)
        }
        assert at_controller == {arm.process_id}
        assert ours.num_threads() == threads


@pytest.mark.slow
def test_our_own_threads_run_on_while_it_connects_and_lets_go(shared):
    """The library would stop them for half a second at its end, and longer at a takeover."""
    going, longest = True, 0.0

    def tick() -> None:
        nonlocal longest
        last = time.monotonic()
        while going:
            time.sleep(1e-3)
            now = time.monotonic()
            longest, last = max(longest, now - last), now

    thread = threading.Thread(target=tick)
    thread.start()
    with UrArm(address(shared), PATIENT) as arm:
        arm.read()
    going = False
    thread.join()
    assert longest < 0.4


def test_nothing_is_printed(shared, capfd):
    with UrArm(address(shared), PATIENT) as arm:
        os.kill(arm.process_id, signal.SIGSEGV)
        first_error(arm)
    assert capfd.readouterr() == ("", "")


FORBIDDEN = {
    "reconnect",
    "getStepTime",
    "toolContact",
    "getActualJointPositionsHistory",
    "getJointTorques",
    "getActualToolFlangePose",
    "getForwardKinematics",
    "getInverseKinematics",
    "setExternalForceTorque",
    "FLAG_UPPER_RANGE_REGISTERS",
    "setAnalogOutputVoltage",
    "setAnalogOutputCurrent",
    "setUserRole",
    "stopL",
    "stopJ",
    "servoC",
    "waitPeriod",
    "initPeriod",
}


def test_the_calls_that_must_not_be_made_are_not():
    folder = Path(palpate.hw.ur.library.__file__).parent
    used = {
        node.attr
        for file in folder.glob("*.py")
        for node in ast.walk(ast.parse(file.read_text()))
        if isinstance(node, ast.Attribute)
    }
    assert "speedL" in used
    assert not used & FORBIDDEN
