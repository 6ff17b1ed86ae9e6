"""An arm that is stopped: what a run reports of rest is true, and `palpate recover` brings it back.

Over real sockets and terminals; devices without a fault stay as they are.
"""

import json
import math

import pytest

from palpate.cli import main
from palpate.commands.devices.recover import recover_devices
from palpate.hw.emulators.process import EmulatorProcess
from palpate.robots.rig import assembled, parts_of
from palpate.robots.robot import load_robot
from palpate.runtime import Cause, Command, Ending, Finger, RestState, Supervisor, Touch, run
from palpate.runtime.data import Phase
from palpate.runtime.standstill_check import REST_SPEED
from palpate.sensing.compensation import SensorPayload
from palpate.surfaces import Sphere
from support.rig_cell import HAND, Cell, HandCell, robot_file
from support.ur_library import needs_ur
from support.ur_wire_sessions import own_address
from support.waiting import until

pytestmark = needs_ur

BEFORE = 50
"""Periods before the fault."""

RESTS = 1e-4
"""[m/s]"""


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """An emulated arm and box, and the path of the robot file for them."""
    address = own_address(41)
    with EmulatorProcess(Cell(address, unlock_delay=0.1)) as emulator:
        yield emulator, str(robot_file(tmp_path_factory.mktemp("cell"), address))


def recover(path, capsys, *options):
    """Run the command; return its exit code and its document."""
    code = main(["recover", path, "--json", *options])
    return code, json.loads(capsys.readouterr().out)


def safety(emulator):
    return emulator.control.state()["devices"]["ur"]["safety"]


def log(emulator):
    return emulator.control.log("ur")


@pytest.mark.slow
def test_what_is_well_is_reported_and_left_alone(cell, capsys):
    emulator, path = cell
    before = log(emulator)
    code, found = recover(path, capsys, "--yes")
    assert code == 0
    assert found["fit"]
    assert found["changed"] == []
    assert [each["fit"] for each in found["devices"]] == [True, True]
    assert "it stands still, powered, brakes released, no safety stop" in found["devices"][1]["state"]
    new = log(emulator)[len(before) :]
    assert not [line for line in new if "upload" in line or "unlock" in line or "power" in line], new


@pytest.mark.slow
def test_a_protective_stop_is_unlocked_if_somebody_agrees_and_only_then(cell, capsys):
    emulator, path = cell
    emulator.control.fault("ur", "protective_stop")
    asked = []

    def declined(action):
        asked.append(action)
        return False

    result = recover_devices(parts_of(load_robot(path)), declined)
    assert result.exit_code == 1
    assert len(asked) == 1
    assert "unlock its protective stop" in asked[0]
    assert safety(emulator) == "PROTECTIVE_STOP"
    assert "it is in protective stop" in capsys.readouterr().out
    assert recover(path, capsys)[0] == 1  # nobody to ask
    assert safety(emulator) == "PROTECTIVE_STOP"
    code, found = recover(path, capsys, "--yes")
    assert code == 0, found
    assert len(found["changed"]) == 1
    assert safety(emulator) == "NORMAL"


@pytest.mark.slow
def test_an_emergency_stop_wants_a_hand_first_then_power(cell, capsys):
    emulator, path = cell
    emulator.control.fault("ur", "e_stop")
    code, found = recover(path, capsys, "--yes")
    assert code == 1
    assert found["changed"] == []
    assert "release it" in found["devices"][1]["remedy"]
    emulator.control.fault("ur", "e_stop", 0.0)
    code, found = recover(path, capsys, "--yes")
    assert code == 0, found
    assert "powered, brakes released" in found["devices"][1]["state"]


def test_a_device_that_is_not_there_is_named_and_the_others_are_examined(tmp_path, capsys):
    code, found = recover(str(robot_file(tmp_path, own_address(42))), capsys)
    assert code == 1
    assert [each["fit"] for each in found["devices"]] == [False, False]
    assert all(each["remedy"] for each in found["devices"])
    assert recover("stage", capsys)[0] == 2


@pytest.mark.slow
def test_a_servo_that_has_shut_down_is_restarted_if_that_is_agreed_to(tmp_path, capsys):
    address = own_address(43)
    with EmulatorProcess(HandCell(address)) as emulator:
        terminal = next(its for its in emulator.addresses.values() if its.startswith("/dev"))
        bus = next(name for name, its in emulator.addresses.items() if its == terminal)
        path = str(robot_file(tmp_path, address, HAND.replace("TERMINAL", terminal)))
        emulator.control.fault(bus, "overload", 2.0)
        code, found = recover(path, capsys)
        assert code == 1, found
        assert "servo 2 shut down by overload" in found["devices"][-1]["state"]
        assert found["devices"][-1]["action"].startswith("restart servo 2,")
        code, found = recover(path, capsys, "--yes")
        assert code == 0, found
        assert "servo 2 no hardware error" in found["devices"][-1]["state"]


class Rising:
    """A controller that moves away from everything."""

    def start(self, first):
        pass

    def step(self, now):
        return Command((0.0, 0.0, 0.01), Phase.TRAVEL)


def speed(emulator):
    return math.hypot(*emulator.control.state()["velocity"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("device", "fault", "undo", "state", "cause"),
    [
        ("box", "silent", 0.0, RestState.AT_REST, Cause.WIRE),
        ("ur", "protective_stop", 0.0, RestState.AT_REST, Cause.DEVICE),
        ("ur", "kill_program", None, RestState.AT_REST, Cause.DEVICE),
        ("ur", "stall_stream", 0.0, RestState.NOT_KNOWN, Cause.WIRE),
        ("ur", "drop_rst", None, RestState.NOT_KNOWN, None),
    ],
)
def test_what_is_reported_of_rest_is_what_the_arm_does(cell, device, fault, undo, state, cause):
    emulator, path = cell
    name = "ur" if device == "ur" else next(its for its in emulator.addresses if its != "ur")
    robot = load_robot(path)
    seen = []

    def break_it(sample, now, command):
        seen.append(command)
        if len(seen) == BEFORE:
            emulator.control.fault(name, fault)

    try:
        result = run(
            assembled(robot, robot.file.period),
            Touch(Finger(Sphere(0.008), SensorPayload(), 0.2, 0.1)),
            Rising(),
            Supervisor(robot.file.limits),
            duration=6.0,
            observers=(break_it,),
        )
        measured = speed(emulator)
        assert result.ending is Ending.TRIPPED
        assert result.rest.state is state, str(result)
        assert cause is None or result.trip.cause is cause
        if state is RestState.AT_REST:
            assert measured < REST_SPEED
        else:
            assert "is stopped by its controller within" in result.rest.words
        until(lambda: speed(emulator) < RESTS)
    finally:
        if undo is not None:
            emulator.control.fault(name, fault, undo)
