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
from palpate.hw.emulators.ur import ControllerFault, SimpleUr
from palpate.hw.emulators.ur.arm import pose_of
from support.ur_library import needs_ur
from support.ur_wire_sessions import (
    connect,
    own_address,
    session_result,
    tour,
)

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
def test_a_controller_that_starts_too_late_for_the_library_is_refused(robot: EmulatorProcess) -> None:
    robot.control.fault("ur", ControllerFault.LATE_START, 7.0)
    with pytest.raises(RuntimeError):
        session_result(connect, ADDRESS)


@pytest.mark.slow
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
