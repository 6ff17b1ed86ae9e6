"""What a run reports of rest, against what the emulated arm does when something goes wrong in motion."""

import math

import pytest

from palpate.hw.emulators.process import EmulatorProcess
from palpate.robots.rig import assembled
from palpate.robots.robot import load_robot
from palpate.runtime import Cause, Command, Ending, Finger, RestState, Supervisor, Touch, run
from palpate.runtime.data import Phase
from palpate.runtime.standstill_check import REST_SPEED
from palpate.sensing.compensation import SensorPayload
from palpate.surfaces import Sphere
from support.rig_cell import Cell, robot_file
from support.ur_wire_sessions import own_address
from support.waiting import until

BEFORE = 50
"""Periods before the fault."""

RESTS = 1e-4
"""[m/s]"""


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    """An emulated arm and box, and the path of the robot file for them."""
    address = own_address(44)
    with EmulatorProcess(Cell(address, unlock_delay=0.1)) as emulator:
        yield emulator, str(robot_file(tmp_path_factory.mktemp("cell"), address))


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
