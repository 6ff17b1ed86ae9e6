"""The real ur_rtde against the emulated controller, over real sockets, in processes of their own."""

import os
import time
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import psutil
import pytest

from palpate.hw.devices import DeviceError
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.emulators.simple_plant import ElasticPlane
from palpate.hw.emulators.ur import ControllerFault, ControllerVersion, SimpleUr
from palpate.hw.emulators.ur.arm import pose_of
from support.ur_library import needs_ur
from support.ur_wire_sessions import (
    ClientProcess,
    connect,
    hold,
    moves,
    own_address,
    press,
    protective_stop,
    questions,
    session_result,
    stream_speed,
)
from support.waiting import until

pytestmark = needs_ur

ADDRESS = own_address(1)
OTHER = own_address(2)
FLOOR = ElasticPlane(height=0.48)
"""Just below where the tip starts: 0.4879 m."""


@pytest.fixture(scope="module")
def shared() -> Iterator[EmulatorProcess]:
    with EmulatorProcess(SimpleUr(ADDRESS, unlock_delay=0.0)) as process:
        yield process


@pytest.fixture
def robot(shared: EmulatorProcess) -> Iterator[EmulatorProcess]:
    yield shared
    for fault in ControllerFault:
        shared.control.fault("ur", fault, 0.0)


def same_pose(got: Sequence[float], wanted: Sequence[float], within: float) -> bool:
    """Whether poses as UR gives them are one: near half a turn, as a tool hangs, the vector's sign is free."""
    a, b = pose_of(tuple(got)), pose_of(tuple(wanted))
    return np.allclose(a.position, b.position, atol=within) and np.allclose(a.rotation, b.rotation, atol=within)


def device(process: EmulatorProcess) -> dict[str, Any]:
    result = process.control.state()["devices"]
    assert isinstance(result, dict)
    return result["ur"]


def height(process: EmulatorProcess) -> float:
    position = process.control.state()["position"]
    assert isinstance(position, list)
    return position[2]


def rests(process: EmulatorProcess) -> bool:
    velocity = process.control.state()["velocity"]
    assert isinstance(velocity, list)
    return max(map(abs, velocity)) < 1e-6


@pytest.mark.slow
def test_every_move_arrives(robot: EmulatorProcess) -> None:
    result = session_result(moves, ADDRESS)
    assert all(result["ok"])
    assert result["moveJ"] == pytest.approx(result["turned"], abs=2e-4)
    for move, wanted in (("moveL", "there"), ("moveL_FK", "pose"), ("moveJ_IK", "there"), ("path", "there")):
        assert same_pose(result[move], result[wanted], 2e-4), move
    assert result["running"]
    assert not result["after stop"]
    # 20 mm/s for 0.1 s, then stopped on its way of 36 mm
    assert 1e-4 < np.linalg.norm(np.subtract(result["stopped"], result["there"])[:3]) < 0.02
    assert result["servoL"][2] == pytest.approx(result["pose"][2] + 0.0099, abs=1e-5)
    assert result["speedJ"] == pytest.approx([0.1, 0, 0, 0, 0, 0], abs=2e-3)
    assert device(robot)["runtime"] == "STOPPED"
    assert device(robot)["dropped"] == 0


@pytest.mark.slow
def test_queries_get_their_replies(robot: EmulatorProcess) -> None:
    result = session_result(questions, ADDRESS)
    assert result["inverse"] == pytest.approx(result["joints"], abs=1e-6)
    assert result["inverse near"] == pytest.approx(result["joints"], abs=1e-6)
    assert result["has"]
    assert not result["has not"]
    assert all(result["safe"])
    assert not result["unsafe"]
    # the tool's z axis points down
    lower = [*result["pose"][:2], result["pose"][2] - 0.1, *result["pose"][3:]]
    for name in ("forward", "trans", "moved tcp"):
        assert same_pose(result[name], lower, 1e-6), name
    assert result["step"] == 0.002
    assert same_pose(result["flange"], result["pose"], 1e-9)
    assert result["history"] == pytest.approx(result["joints"], abs=1e-9)
    assert result["steady"]
    assert result["again"]
    assert result["custom"]
    assert result["tcp set"]
    assert result["tcp"] == pytest.approx([0, 0, 0.1, 0, 0, 0])
    # nothing hangs on the sensor: what the client says is too much, until zeroed
    assert result["payload set"]
    assert result["payload"] == pytest.approx(1.2)
    assert result["weight"][:3] == pytest.approx([0.0, 0.0, 1.2 * 9.82], abs=1e-9)
    assert result["zeroed"]
    assert result["force"] == pytest.approx([0.0] * 6, abs=1e-9)
    assert result["freedrive"] == (True, 1)
    assert result["driven"] == (True, 0)
    assert result["teach"] == (True, True)
    assert result["digital"] == 1 << 3 | 1 << 10 | 1 << 17
    assert result["analog"] == pytest.approx(5.0)
    assert result["fraction"] == pytest.approx(0.5)
    assert result["dashboard"] == [
        "5.14.0.1",
        "Robotmode: RUNNING",
        "Safetymode: NORMAL",
        True,
        True,
        True,
        "20235500001",
    ]
    assert device(robot)["dropped"] == 0


@pytest.mark.slow
def test_force_mode_settles_at_the_force() -> None:
    with EmulatorProcess(SimpleUr(OTHER, plane=FLOOR)):
        result = session_result(press, OTHER, 10.0)
    # equilibrium: the plane pushes back what is asked for, at the depth of its stiffness
    assert result["force"][2] == pytest.approx(10.0, abs=0.05)
    assert result["pose"][2] == pytest.approx(FLOOR.height - 10.0 / FLOOR.stiffness, abs=5e-5)
    assert result["left"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("version", "rate"),
    [
        (ControllerVersion(3, 15, 8, 0), 125.0),
        (ControllerVersion(5, 23, 0, 0), 500.0),
        (ControllerVersion(10, 10, 0, 0), 500.0),
    ],
    ids=str,
)
def test_versions(version: ControllerVersion, rate: float) -> None:
    with EmulatorProcess(SimpleUr(OTHER, version=version)):
        result = session_result(connect, OTHER, rate)
    assert result["alive"]
    assert result["steady"]
    assert result["states"] <= 0.5 * rate * 1.1
    # a busy machine loses some
    assert result["states"] > 0.5 * rate * 0.3


@pytest.mark.slow
def test_time_runs_at_the_given_rate() -> None:
    with EmulatorProcess(SimpleUr(OTHER, scale=4.0)) as process:
        result = session_result(connect, OTHER, 500.0)
        state = process.control.state()
    assert result["steady"]
    # what could not be kept up with is reported
    time_, wall, given_up = (state[name] for name in ("time", "wall", "given_up"))
    assert isinstance(time_, float)
    assert isinstance(wall, float)
    assert isinstance(given_up, float)
    assert time_ == pytest.approx(4.0 * (wall - given_up), rel=0.05, abs=0.3)


@pytest.mark.slow
def test_second_control_client_is_refused_and_the_first_goes_on(robot: EmulatorProcess) -> None:
    first = ClientProcess(hold, ADDRESS)
    try:
        assert first.hear() == "connected"
        with pytest.raises(RuntimeError, match=r"(?i)in use|setup|fail|input"):
            session_result(connect, ADDRESS, 500.0)
        first.go_on()
        assert first.hear() == "works"
    finally:
        first.end()


@pytest.mark.slow
def test_watchdog_stops_the_arm_of_a_killed_client(robot: EmulatorProcess) -> None:
    client = ClientProcess(stream_speed, ADDRESS, 2.0, 0.02)
    try:
        assert client.hear() == "moving"
        client.process.kill()
        client.process.join(5.0)
        killed = robot.control.state()["time"]
        assert isinstance(killed, float)
        until(lambda: device(robot)["runtime"] == "STOPPED" and rests(robot))
        rest, stopped = height(robot), robot.control.state()["steps"]
        until(lambda: robot.control.state()["steps"] > stopped + 100)
    finally:
        client.end()
    # by the clock of the controller, which a stalled machine stops, too; braking takes some cycles more
    (*_, ended) = (line for line in robot.control.log("ur") if "ended why=watchdog" in line)
    assert float(ended.split()[0]) < killed + 0.5 + 0.01
    assert height(robot) == pytest.approx(rest, abs=1e-6)


@pytest.mark.slow
def test_without_watchdog_the_arm_goes_on(robot: EmulatorProcess) -> None:
    client = ClientProcess(stream_speed, ADDRESS, 0.0, 0.02)
    try:
        assert client.hear() == "moving"
        client.process.kill()
        client.process.join(5.0)
        before = height(robot)
        time.sleep(0.5)
        # this is what makes the watchdog a duty
        assert before - height(robot) == pytest.approx(0.02 * 0.5, rel=0.3)
    finally:
        client.end()


@pytest.mark.slow
def test_protective_stop_freezes_the_arm_until_it_is_recovered(robot: EmulatorProcess) -> None:
    client = ClientProcess(protective_stop, ADDRESS)
    try:
        assert client.hear() == "moving"
        time.sleep(0.3)
        robot.control.fault("ur", ControllerFault.PROTECTIVE_STOP)
        result = client.hear()
    finally:
        client.end()
    assert not result["moved"]
    assert result["stopped"] == (True, 4, False)
    # the lag of the plant at 50 mm/s
    assert same_pose(result["still"], result["at"], 0.05 * 0.012)
    assert result["uploaded"]
    assert result["again"]
    assert same_pose(result["back"], result["pose"], 2e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    "fault",
    [
        ControllerFault.REJECT_START,
        ControllerFault.LOCAL_CONTROL,
        ControllerFault.WITHHOLD_GREETING,
        ControllerFault.STRAY_TEXT,
    ],
)
def test_faults_of_the_start_reach_the_client(robot: EmulatorProcess, fault: ControllerFault) -> None:
    robot.control.fault("ur", fault)
    with pytest.raises(RuntimeError):
        session_result(hold, ADDRESS)


@pytest.mark.slow
@pytest.mark.parametrize(("late", "starts"), [(1.0, True), (7.0, False)])
def test_script_that_starts_late(robot: EmulatorProcess, late: float, starts: bool) -> None:
    robot.control.fault("ur", ControllerFault.LATE_START, late)
    client = ClientProcess(hold, ADDRESS)
    try:
        if starts:
            assert client.hear() == "connected"
        else:
            with pytest.raises(RuntimeError):
                client.hear()
    finally:
        client.process.kill()
        client.end()


def test_everything_listens_on_loopback_only(robot: EmulatorProcess) -> None:
    children = psutil.Process(os.getpid()).children(recursive=True)
    listening = [
        connection.laddr
        for child in children
        for connection in child.net_connections("inet")
        if connection.status == psutil.CONN_LISTEN
    ]
    assert {address.port for address in listening} >= {29999, 30003, 30004}
    assert all(address.ip.startswith("127.") for address in listening)


@pytest.mark.slow
def test_an_address_in_use_is_reported(robot: EmulatorProcess) -> None:
    with pytest.raises(DeviceError, match="cannot listen on port 30004"), EmulatorProcess(SimpleUr(ADDRESS)):
        pass


@pytest.mark.slow
def test_a_killed_emulator_is_reported() -> None:
    with EmulatorProcess(SimpleUr(OTHER)) as process:
        process.kill()
        with pytest.raises(ConnectionError):
            process.control.state()
