"""A UR arm over the real ur_rtde and real sockets, on loopback only, against an emulated controller.

Where ur_rtde 1.6.5 goes wrong, and what shows here that it does no harm:

| | fault | handled by | shown by |
|---|---|---|---|
| 1 | reconnects after a loss until it crashes | own process, ended at once | `lost_connection` |
| 2 | does not notice silence | age of the state, at commands too | `lost_connection`, `killed_controller` |
| 3 | receiving does not reconnect, or hangs at it | never asked to: a new process | `must_not_be_made` |
| 4 | getters that reply with old registers | not called | `must_not_be_made` |
| 5 | lengths are not checked | checked before | `exchange`: `impossible_velocities` |
| 6 | forward kinematics with an old tool | not called; `palpate.kinematics` | `must_not_be_made` |
| 7 | setExternalForceTorque | not called | `must_not_be_made` |
| 8 | upper range registers | not called | `must_not_be_made` |
| 9 | analog outputs, user role | not called | `must_not_be_made` |
| 10 | stopL and stopJ mixed up | speedStop | `must_not_be_made` |
| 11 | getters are no snapshot | time stamp before and after | `exchange`: `one_cycle` |
| 12 | an input register has one owner | the second is refused, the first goes on | `second_client` |
| 13 | constructors, destructors stop all threads | own process, left without destructors | `threads` |
| 14 | waitPeriod | not called: own deadlines | `must_not_be_made` |
| 15 | prints; not for two threads | outputs kept; one lock | `printed`; CONCURRENT in `process` |
| 16 | a refused start goes unnoticed | connection asked for afterwards | `refuses` |
| 17 | servoC | not called | `must_not_be_made` |
| 18 | a command may overwrite the one before | cycles are left between them | `overwrite` |

`exchange` and `process` are the other two files test_wire_ur_*.py.
"""

import ast
import contextlib
import math
import os
import signal
import sys
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import psutil
import pytest

import palpate.hw.ur.library
from palpate.hw.devices import DeviceError, SensorDevice
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.simple_plant import ElasticPlane
from palpate.hw.emulators.ur import ControllerVersion, SimpleUr
from palpate.hw.ur import FlangePayload, UrArm, UrSettings, UrToolSensor
from palpate.kinematics.pose import Pose, rotation_from_rotvec
from palpate.spatial import Vector
from support import waiting
from support.ur_library import needs_ur
from support.waiting import process_ended, until

pytestmark = needs_ur

ZERO = (0.0, 0.0, 0.0)
PATIENT = UrSettings(stale_after=2.0, watchdog=1.0)
"""For tests that are not about time: the machine may stall."""

HEIGHT = 0.4879
"""[m] at which the emulated arm starts."""

_hosts = count(2)


@contextlib.contextmanager
def controller(**changed: Any) -> Iterator[EmulatorProcess]:
    """Start an emulator at a loopback address that no other one has, in this process or another."""
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


def drive(arm: UrArm, velocity: Vector, turning: Vector, met: Callable[[], bool]) -> None:
    """Command velocities until a condition is met."""
    until(lambda: arm.move(velocity, turning) or met())


def follow(arm: UrArm, velocity: Vector) -> None:
    """Command a velocity until the arm has it."""
    drive(arm, velocity, ZERO, lambda: arm.read().velocity_base_tip == pytest.approx(velocity, abs=1e-3))


def first_error(arm: UrArm) -> DeviceError:
    """Command until it fails."""
    return waiting.first_error(lambda: arm.move((0.01, 0.0, 0.0), ZERO))


def truth(emulator: EmulatorProcess, name: str) -> Any:
    return emulator.control.state()[name]


def at_rest(emulator: EmulatorProcess) -> bool:
    return math.hypot(*truth(emulator, "velocity")) < 1e-6


def cycles(emulator: EmulatorProcess, number: int) -> None:
    """Wait for some steps of the plant."""
    begun = truth(emulator, "steps")
    until(lambda: truth(emulator, "steps") >= begun + number)


def stop(arm: UrArm, emulator: EmulatorProcess, number: int = 0) -> None:
    """Stop the arm and wait until the plant is at rest, and some cycles more."""
    arm.stop()
    until(lambda: at_rest(emulator))
    cycles(emulator, number)


def uploads(emulator: EmulatorProcess) -> int:
    return sum("uploaded" in line for line in emulator.control.log("ur"))


# -- motion --


@pytest.mark.slow
def test_it_moves_and_turns_as_commanded_and_reports_where_it_is(shared):
    ours = psutil.Process()
    threads = ours.num_threads()
    with UrArm(address(shared), PATIENT) as arm:
        assert arm.version[:2] == (5, 14)
        # the library's threads and connections are in the client process, not in ours
        at_controller = {
            its.pid
            for its in (ours, *ours.children(recursive=True))
            for connection in its.net_connections("tcp")
            if connection.raddr and connection.raddr.ip == address(shared)
        }
        assert at_controller == {arm.process_id}
        assert ours.num_threads() == threads
        assert not {"rtde_control", "rtde_receive", "rtde_io", "dashboard_client"} & set(sys.modules)
        before = arm.read()
        there = before.position_base_tip[1] + 0.008
        drive(arm, (0.0, 0.02, 0.01), ZERO, lambda: arm.read().position_base_tip[1] > there)
        assert arm.read().velocity_base_tip == pytest.approx((0.0, 0.02, 0.01), abs=1e-4)
        stop(arm, shared)
        # the arm reports what the plant has
        until(lambda: arm.read().position_base_tip == pytest.approx(truth(shared, "position"), abs=1e-9))
        after = arm.read()
        moved = [b - a for a, b in zip(before.position_base_tip, after.position_base_tip, strict=True)]
        assert moved[2] == pytest.approx(0.5 * moved[1], rel=1e-3)
        assert abs(moved[0]) < 1e-6
        assert before.time < after.time
        unturned = pytest.approx(after.rotation_base_tip[0], abs=0.03)
        drive(arm, ZERO, (0.0, 0.0, 0.2), lambda: arm.read().rotation_base_tip[0] != unturned)
        assert arm.read().angular_velocity_base_tip == pytest.approx((0.0, 0.0, 0.2), abs=1e-3)
        stop(arm, shared, 25)
        last = arm.read()
        assert last.position_base_tip == pytest.approx(after.position_base_tip, abs=1e-5)
        assert last.rotation_base_tip[2] == pytest.approx(after.rotation_base_tip[2], abs=1e-6)  # about z
        # a second client is refused, and the first goes on
        with pytest.raises(DeviceError, match=address(shared)):
            UrArm(address(shared), PATIENT).start()
        follow(arm, (0.0, 0.0, 0.01))


@pytest.mark.slow
def test_a_command_does_not_overwrite_the_one_before():
    """A velocity that is followed at once by a tare is executed, and the tare is, too.

    A quarter of real time: the client counts cycles of the controller, and a stall of a busy machine may hide no
    more than two of them. All waits read the arm, so that a lost device ends the test with its own message.
    """
    with controller(scale=0.25) as emulator, UrArm(address(emulator), PATIENT) as arm:

        def sent() -> bool:
            arm.read()
            return arm._client.exchange.status().followed >= arm._number

        def rested() -> bool:
            arm.read()
            return at_rest(emulator)

        for _ in range(10):
            before = truth(emulator, "position")[2]
            arm.move((0.0, 0.0, 0.05), ZERO)
            until(sent, what="sending the velocity")
            arm.tare()
            until(rested, what="rest after the tare")
            assert truth(emulator, "position")[2] > before + 1e-6


@pytest.mark.slow
def test_its_sensor_measures_the_contact_and_is_tared():
    plane = ElasticPlane(HEIGHT - 0.002)
    with controller(plane=plane) as emulator, UrArm(address(emulator), PATIENT) as arm:
        sensor: SensorDevice = UrToolSensor(arm)
        sensor.start()
        deep = plane.height - 0.002
        drive(arm, (0.0, 0.0, -0.01), ZERO, lambda: truth(emulator, "position")[2] < deep)
        stop(arm, emulator, 10)
        force = plane.stiffness * (plane.height - truth(emulator, "position")[2])
        until(lambda: sensor.read().wrench[2] == pytest.approx(-force, rel=1e-6))
        reading = sensor.read()
        # the tool's z axis points down, into the object; about the TCP, a point of contact has no moment
        assert reading.healthy
        assert reading.wrench[:2] == pytest.approx((0.0, 0.0), abs=1e-9)
        assert reading.wrench[3:] == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
        assert arm.read().tip_force_base == pytest.approx((0.0, 0.0, force), rel=1e-6)
        sensor.tare()
        until(lambda: sensor.read().wrench == pytest.approx((0.0,) * 6, abs=1e-6))


@pytest.mark.slow
def test_tool_payload_and_slider_are_set(shared):
    flange_tip = Pose((0.0, 0.0, 0.1), rotation_from_rotvec((0.0, 0.0, 0.5)))
    payload = FlangePayload(0.4, (0.0, 0.0, 0.05))
    settings = UrSettings(flange_tip, payload, stale_after=2.0, watchdog=1.0, speed_slider=0.5)
    with UrArm(address(shared), PATIENT) as arm:
        bare = arm.read()
    with UrArm(address(shared), settings) as arm:
        # the tip is 0.1 m along the flange's z
        axis = [row[2] for row in bare.rotation_base_tip]
        expected = [p + 0.1 * a for p, a in zip(bare.position_base_tip, axis, strict=True)]
        until(lambda: arm.read().position_base_tip == pytest.approx(expected, abs=1e-6))
        # nothing hangs on the sensor: its weight is taken off although it is not there
        until(lambda: arm.state().tool_wrench[2] == pytest.approx(0.4 * 9.82))
        until(lambda: (arm.state().speed_slider, arm.state().speed_scaling) == (0.5, 0.5))
    # settings outlive a program
    with UrArm(address(shared), UrSettings(payload=FlangePayload(0.0), stale_after=2.0, speed_slider=1.0)) as arm:
        until(lambda: arm.state().speed_slider == 1.0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("version", "scale"),
    [
        (ControllerVersion(3, 15, 0, 0), 1.0),
        (ControllerVersion(5, 23, 0, 0), 2.0),  # its watchdog waits half a second
        (ControllerVersion(10, 10, 0, 0), 1.0),
    ],
)
def test_other_versions_and_a_clock_that_runs_faster(version, scale):
    with controller(version=version, scale=scale) as emulator, UrArm(address(emulator), PATIENT) as arm:
        assert arm.version == version
        stalled = truth(emulator, "given_up")
        begun = arm.state()
        drive(arm, (0.0, 0.01, 0.0), ZERO, lambda: arm.state().time > begun.time + 1.5)
        ended = arm.state()
        assert ended.tool_pose[1] > begun.tool_pose[1] + 1e-3
        # without the time that a busy machine left out
        passed = ended.time - begun.time - (truth(emulator, "given_up") - stalled)
        assert ended.controller_time - begun.controller_time == pytest.approx(scale * passed, rel=0.3, abs=0.2)
        assert (arm.read().tip_force_base is None) == (version.major == 3)


# -- faults --


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["drop_fin", "drop_rst", "stall_stream"])
def test_a_lost_connection_is_detected_reported_and_recovered_from(shared, fault):
    with UrArm(address(shared), UrSettings(stale_after=0.25, watchdog=0.4)) as arm:
        follow(arm, (0.01, 0.0, 0.0))
        before, pid = uploads(shared), arm.process_id
        shared.control.fault("ur", fault)
        error = first_error(arm)
        assert error.device == arm.name
        assert "`palpate recover`" in error.remedy
        until(lambda: at_rest(shared))
        # the client ends before the library's time-out of 2.5 s: no storm of reconnections
        until(lambda: process_ended(pid))
        cycles(shared, 250)
        assert uploads(shared) - before <= 1
        shared.control.fault("ur", "stall_stream", 0.0)
        arm.recover()
        follow(arm, (-0.01, 0.0, 0.0))


@pytest.mark.slow
def test_a_killed_controller_is_noticed_and_its_successor_recovered_to():
    with controller() as emulator, UrArm(address(emulator), UrSettings(stale_after=0.25, watchdog=0.4)) as arm:
        follow(arm, (0.01, 0.0, 0.0))
        emulator.kill()
        assert "`palpate recover`" in first_error(arm).remedy
        with pytest.raises(DeviceError, match="switched on"):
            arm.recover()
        with EmulatorProcess(SimpleUr(address(emulator))):
            arm.recover()
            follow(arm, (0.01, 0.0, 0.0))


@pytest.mark.parametrize(
    ("fault", "message", "until_released"),
    [
        ("protective_stop", "protective stop", ""),
        pytest.param("e_stop", "emergency stop", "release", marks=pytest.mark.slow),
        pytest.param("kill_program", "program was stopped", "", marks=pytest.mark.slow),
    ],
)
def test_a_stop_in_motion_is_noticed_and_recovered_from(shared, fault, message, until_released):
    with UrArm(address(shared), PATIENT) as arm:
        follow(arm, (0.01, 0.0, 0.0))
        shared.control.fault("ur", fault)
        assert message in str(first_error(arm))
        until(lambda: at_rest(shared))
        with pytest.raises(DeviceError, match="`palpate recover`"):
            arm.tare()
        if until_released:
            with pytest.raises(DeviceError, match=until_released):
                arm.recover()
            shared.control.fault("ur", fault, 0.0)
        arm.recover()  # waits until a protective stop can be unlocked
        at = truth(shared, "position")
        begun = arm.state().controller_time
        until(lambda: arm.state().controller_time > begun + 0.1)
        # no earlier command goes on; the plant settles exponentially after a braked stop
        assert truth(shared, "position") == pytest.approx(at, abs=1e-7)
        follow(arm, (0.01, 0.0, 0.0))


@pytest.mark.slow
def test_the_controllers_watchdog_stops_the_arm_of_a_killed_client_and_nothing_is_printed(shared, capfd):
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
        os.kill(arm.process_id, signal.SIGSEGV)
        first_error(arm)
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("fault", "value", "message"),
    [
        ("local_control", 1.0, "Remote Control"),
        ("refuse_version", 1.0, "RTDE"),
        ("reject_start", 1.0, "refused to send"),
        ("withhold_greeting", 1.0, "does not greet"),
        ("stray_text", 1.0, "."),
        ("late_start", 1.5, ""),
    ],
)
def test_a_controller_that_refuses_is_reported_and_a_late_one_is_waited_for(shared, fault, value, message):
    shared.control.fault("ur", fault, value)
    arm = UrArm(address(shared), PATIENT)
    children = {child.pid for child in psutil.Process().children(recursive=True)}
    try:
        if message:
            with pytest.raises(DeviceError, match=message):
                arm.start()
            assert {child.pid for child in psutil.Process().children(recursive=True)} <= children
        else:
            arm.start()
    finally:
        shared.control.fault("ur", fault, 0.0)
    with arm:
        arm.read()


@pytest.mark.slow
def test_too_old_a_version_and_an_absent_device_are_reported():
    with (
        controller(version=ControllerVersion(5, 4, 0, 0)) as emulator,
        pytest.raises(DeviceError, match=r"5\.4\.0\.0 is not supported.*5\.10"),
    ):
        UrArm(address(emulator)).start()
    with pytest.raises(DeviceError, match=r"no controller replies.*switched on"):
        UrArm("127.0.0.254").start()


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
