"""The real ur_rtde against the emulated controller, over real sockets, in processes of their own."""

import os
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
    own_address,
    protective_stop,
    session_result,
    stream_speed,
    tour,
)
from support.waiting import until

pytestmark = needs_ur

ADDRESS, OTHER = own_address(1), own_address(2)
FLOOR = ElasticPlane(height=0.43)
"""58 mm below the start of the tip."""


@pytest.fixture(scope="module")
def shared() -> Iterator[EmulatorProcess]:
    with EmulatorProcess(SimpleUr(ADDRESS, plane=FLOOR, unlock_delay=0.0)) as process:
        yield process


@pytest.fixture
def robot(shared: EmulatorProcess) -> Iterator[EmulatorProcess]:
    yield shared
    for fault in ControllerFault:
        shared.control.fault("ur", fault, 0.0)


def same_pose(got: Sequence[float], expected: Sequence[float], within: float) -> bool:
    """Return whether two poses of UR are one: near half a turn, the sign of a rotation vector is free."""
    a, b = pose_of(tuple(got)), pose_of(tuple(expected))
    return np.allclose(a.position, b.position, atol=within) and np.allclose(a.rotation, b.rotation, atol=within)


def device(process: EmulatorProcess) -> dict[str, Any]:
    return process.control.state()["devices"]["ur"]  # type: ignore[index,call-overload,no-any-return]


def plant(process: EmulatorProcess, name: str) -> Any:
    return process.control.state()[name]


@pytest.mark.slow
def test_every_emulated_command_works_with_the_real_clients(robot: EmulatorProcess) -> None:
    result = session_result(tour, ADDRESS)
    assert all(result["ok"])
    assert result["moveJ"] == pytest.approx(result["turned"], abs=2e-4)
    for move, goal in (("moveL", "there"), ("moveL_FK", "pose"), ("moveJ_IK", "there"), ("path", "there")):
        assert same_pose(result[move], result[goal], 2e-4), move
    assert (result["running"], result["after stop"]) == (True, False)
    # stopped between its start and its goal, 36 mm away
    assert 1e-4 < np.linalg.norm(np.subtract(result["stopped"], result["there"])[:3]) < 0.03
    assert result["contact"] == (False, False)
    # equilibrium: the plane pushes back what is asked for, at the depth of its stiffness
    assert result["pressed"][2] == pytest.approx(FLOOR.height - 8.0 / FLOOR.stiffness, abs=5e-5)
    assert result["touched"][2] > 5.0
    # the tool's z axis points down
    lower = [*result["pose"][:2], result["pose"][2] - 0.1, *result["pose"][3:]]
    assert same_pose(result["moved tcp"], lower, 2e-4)
    assert result["tcp"] == pytest.approx([0, 0, 0.1, 0, 0, 0])
    # nothing hangs on the sensor: the weight is taken off although it is not there, until zeroed
    assert result["payload"] == pytest.approx(1.2)
    assert result["weight"][:3] == pytest.approx([0.0, 0.0, 1.2 * 9.82], abs=1e-9)
    assert result["force"] == pytest.approx([0.0] * 6, abs=1e-9)
    now, before = result["history"]
    assert before == pytest.approx(now, abs=1e-9)
    assert result["digital"] == 1 << 3 | 1 << 10 | 1 << 17
    assert result["analog"] == pytest.approx(5.0)
    assert result["fraction"] == pytest.approx(0.5)
    assert result["custom"]
    assert result["again"]
    modes = ["Robotmode: RUNNING", "Safetymode: NORMAL", True, True, True]
    assert result["dashboard"] == ["5.14.0.1", *modes, "20235500001"]
    assert device(robot)["runtime"] == "STOPPED"
    assert device(robot)["dropped"] == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("version", "rate", "scale"),
    [
        (ControllerVersion(3, 15, 8, 0), 125.0, 1.0),
        (ControllerVersion(5, 23, 0, 0), 500.0, 4.0),
        (ControllerVersion(10, 10, 0, 0), 500.0, 1.0),
    ],
    ids=str,
)
def test_versions_have_their_cycle_at_any_speed_of_time(
    version: ControllerVersion, rate: float, scale: float
) -> None:
    with EmulatorProcess(SimpleUr(OTHER, version=version, scale=scale)) as process:
        stamps = session_result(connect, OTHER, rate)
        wall, given_up, time = (plant(process, name) for name in ("wall", "given_up", "time"))
    # every time stamp is a whole number of cycles after the first, however many a busy machine misses
    cycles = (np.array(stamps) - stamps[0]) * rate
    assert cycles == pytest.approx(np.round(cycles), abs=1e-6)
    assert np.diff(cycles).min() >= 1.0 - 1e-6
    # a stall that could not be caught up with is reported
    assert time == pytest.approx(scale * (wall - given_up), rel=0.05, abs=0.3)


@pytest.mark.slow
def test_a_second_control_client_is_refused_and_the_first_goes_on(robot: EmulatorProcess) -> None:
    first = ClientProcess(hold, ADDRESS)
    try:
        assert first.result() == "connected"
        with pytest.raises(RuntimeError, match=r"(?i)in use|setup|fail|input"):
            session_result(connect, ADDRESS, 500.0)
        first.go_on()
        assert first.result() == "works"
    finally:
        first.end()


@pytest.mark.slow
@pytest.mark.parametrize("frequency", [2.0, 0.0])
def test_only_the_watchdog_stops_the_arm_of_a_killed_client(robot: EmulatorProcess, frequency: float) -> None:
    """By the clock of the controller, which a stalled machine stops, too."""
    client = ClientProcess(stream_speed, ADDRESS, frequency, 0.01)
    try:
        assert client.result() == "moving"
        client.process.kill()
        client.process.join(5.0)
        killed = plant(robot, "time")
        if frequency:
            until(lambda: device(robot)["runtime"] == "STOPPED" and max(map(abs, plant(robot, "velocity"))) < 1e-6)
            (*_, ended) = (line for line in robot.control.log("ur") if "ended why=watchdog" in line)
            assert float(ended.split()[0]) < killed + 1.0 / frequency + 0.01
        rest, since = plant(robot, "position")[2], plant(robot, "time")
        until(lambda: plant(robot, "time") > since + 0.5)
        passed, moved = plant(robot, "time") - since, rest - plant(robot, "position")[2]
    finally:
        client.end()
        robot.control.fault("ur", ControllerFault.KILL_PROGRAM)
    # without it, the arm goes on: this is what makes the watchdog a duty
    assert moved == pytest.approx(0.0 if frequency else 0.01 * passed, rel=0.1, abs=1e-6)


@pytest.mark.slow
def test_a_protective_stop_freezes_the_arm_until_it_is_recovered(robot: EmulatorProcess) -> None:
    client = ClientProcess(protective_stop, ADDRESS)
    try:
        assert client.result() == "moving"
        until(lambda: max(map(abs, plant(robot, "velocity"))) > 0.04)
        robot.control.fault("ur", ControllerFault.PROTECTIVE_STOP)
        result = client.result()
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
    ("fault", "value", "starts"),
    [
        (ControllerFault.REJECT_START, 1.0, False),
        (ControllerFault.LOCAL_CONTROL, 1.0, False),
        (ControllerFault.WITHHOLD_GREETING, 1.0, False),
        (ControllerFault.STRAY_TEXT, 1.0, False),
        (ControllerFault.LATE_START, 1.0, True),
        (ControllerFault.LATE_START, 7.0, False),
    ],
)
def test_faults_of_the_start_reach_the_client(
    robot: EmulatorProcess, fault: ControllerFault, value: float, starts: bool
) -> None:
    robot.control.fault("ur", fault, value)
    client = ClientProcess(hold, ADDRESS)
    try:
        if starts:
            assert client.result() == "connected"
        else:
            with pytest.raises(RuntimeError):
                client.result()
    finally:
        client.process.kill()
        client.end()


def test_an_emulator_listens_on_loopback_only_and_reports_a_taken_address_and_its_end() -> None:
    with EmulatorProcess(SimpleUr(OTHER)) as process:
        children = psutil.Process(os.getpid()).children(recursive=True)
        listening = [
            connection.laddr
            for child in children
            for connection in child.net_connections("inet")
            if connection.status == psutil.CONN_LISTEN
        ]
        assert {address.port for address in listening} >= {29999, 30003, 30004}
        assert all(address.ip.startswith("127.") for address in listening)
        with pytest.raises(DeviceError, match="cannot listen on port 30004"), EmulatorProcess(SimpleUr(OTHER)):
            pass
        process.kill()
        with pytest.raises(ConnectionError):
            process.control.state()
