"""`palpate recover` over real sockets and terminals: what is well stays as it is, what was stopped comes back."""

import json

import pytest

from palpate.cli import main
from palpate.commands.recover.command import recovered
from palpate.hw.emulators.process import EmulatorProcess
from palpate.robots.rig import parts_of
from palpate.robots.robot import load_robot
from support.rig_cell import HAND, Cell, HandCell, robot_file
from support.ur_library import needs_ur
from support.ur_wire_sessions import own_address

pytestmark = needs_ur


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

    result = recovered(parts_of(load_robot(path)), declined)
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
