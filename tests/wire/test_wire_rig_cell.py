"""A whole rig over real sockets, on loopback only: the real ur_rtde and a Net F/T client, emulated devices.

Rows of `test_wire_faults` stop such a rig by faults of each device.
"""

import contextlib
import json
from collections.abc import Iterator
from itertools import count

import numpy as np
import psutil
import pytest

from palpate.cli import main
from palpate.experiments.explore.config import ExploreConfig
from palpate.experiments.explore.experiment import Explore
from palpate.experiments.kit.metric import NOT_KNOWN
from palpate.experiments.kit.recording import write_result
from palpate.hw.devices import DeviceError
from palpate.hw.dynamixel.hand import DynamixelHand
from palpate.hw.emulators.process import EmulatorProcess
from palpate.hw.rig import FreshlyTared, PolledHand
from palpate.robots.rig import assembled
from palpate.robots.robot import load_robot
from palpate.runtime import Ending
from palpate.runtime.data import Command
from support.explore_runs import carried_out, plan_of, planned_again
from support.regulate_runs import REGULATE, regulated
from support.rig_cell import HAND, Cell, HandCell, robot_file
from support.ur_wire_sessions import own_address
from support.waiting import first_error, until

_hosts = count(50)
UP = (0.0, 0.0, 0.01)


@contextlib.contextmanager
def emulated(folder) -> Iterator[tuple[EmulatorProcess, str]]:
    """Emulators, and the path of the robot file for them; nothing is left of them at the end."""
    address, before = own_address(next(_hosts)), children()
    with EmulatorProcess(Cell(address)) as emulator:
        assert all(its.startswith("127.") for its in emulator.addresses.values())
        yield emulator, str(robot_file(folder, address))
    assert children() <= before


def children():
    """Process ids of this process's children, but for Python's own tracker of resources."""
    found = psutil.Process().children(recursive=True)
    return {child.pid for child in found if "resource_tracker" not in " ".join(child.cmdline())}


@pytest.fixture(scope="module")
def shared(tmp_path_factory) -> Iterator[tuple[EmulatorProcess, str]]:
    """For tests that leave it well."""
    with emulated(tmp_path_factory.mktemp("cell")) as running:
        yield running


@pytest.fixture
def cell(shared) -> Iterator[tuple[EmulatorProcess, str]]:
    """The shared one, with its tip where it was and its box well."""
    yield shared
    shared[0].control.fault(box_of(shared[0]), "silent", 0.0)


def box_of(emulator):
    """Name of the F/T box."""
    return next(name for name in emulator.addresses if "F/T" in name)


@contextlib.contextmanager
def started(path) -> Iterator[tuple[FreshlyTared, float]]:
    """A rig that runs, and the height of its tip at the start [m]."""
    robot = load_robot(path)
    with FreshlyTared(assembled(robot, robot.file.period)) as rig:
        first = rig.start()
        rig.pacer.start()
        try:
            yield rig, first.arm.position_base_tip[2]
        finally:
            rig.pacer.stop()


def until_it_stands(emulator):
    """Wait until the plant's tip stands, and return where [m]."""
    until(lambda: max(map(abs, emulator.control.state()["velocity"])) < 1e-4)
    return emulator.control.state()["position"]


@pytest.mark.slow
def test_it_goes_where_commanded_and_every_sample_has_its_own_time(cell):
    emulator, path = cell
    before = until_it_stands(emulator)[2]
    with started(path) as (rig, begin):
        samples = [rig.step(Command(UP)) for _ in range(100)]
        last = [rig.step(Command()) for _ in range(100)][-1]
    risen = last.arm.position_base_tip[2] - begin
    spent = samples[-1].time - samples[0].time
    assert risen == pytest.approx(0.01 * spent, abs=0.002)
    assert until_it_stands(emulator)[2] == pytest.approx(before + risen, abs=1e-4)
    for sample in samples:
        assert sample.arm.time <= sample.time
        assert sample.wrenches[0].time <= sample.time
    assert len({sample.wrenches[0].time for sample in samples}) > 50


@pytest.mark.slow
def test_an_exploration_runs_on_it_as_on_a_simulated_robot(cell, tmp_path):
    _, path = cell
    config = ExploreConfig(
        robot=path,
        object="box",
        size=(0.04, 0.04, 0.02),
        width=0.006,
        depth=0.002,
        spacing=0.002,
        stiffness=2000.0,
        force=1.0,
    )
    # this machine stands still for longer than a supervisor bears, now and then: that ends a run as it should
    for _ in range(4):
        planned = plan_of(config)
        found = carried_out(planned)
        if found.run.ending is Ending.DONE and found.run.at_rest:
            break
    assert found.run.ending is Ending.DONE, str(found.run)
    assert found.run.at_rest
    felt = found.record.normal_force[found.scanning]
    assert abs(float(felt.mean()) - 1.0) < 0.1
    # the plane is level, whatever its height
    heights = found.cloud.position[:, 2]
    assert float(heights.std()) < 1e-4
    assert not found.truth.known
    report = Explore().report(found)
    metrics = {metric.name: metric.text for metric in report.all_metrics}
    assert metrics["true normal force, RMS error"] == metrics["points to true surface, RMS"] == NOT_KNOWN
    assert write_result(Explore(), found, report, tmp_path / "out").files[0].stat().st_size > 10_000
    assert planned_again(planned).parameters == planned.parameters


@pytest.mark.slow
def test_a_regulation_runs_on_it_and_judges_what_was_sensed(tmp_path):
    with emulated(tmp_path) as (_, path):
        for _ in range(4):  # see above
            held = regulated(robot=path, duration=1.0, assumed_stiffness=2000.0)
            if held.run.ending is Ending.DONE:
                break
    assert held.run.ending is Ending.DONE, str(held.run)
    assert np.isnan(held.true_force).all()
    assert held.sensed_rms < 0.1
    metrics = {metric.name: metric.text for metric in REGULATE.report(held).all_metrics}
    assert metrics["true force, RMS error"] == NOT_KNOWN
    assert float(metrics["largest force of the run"]) >= 1.9


@pytest.mark.slow
def test_the_doctor_moves_nothing_and_tells_all_in_json(cell, capsys):
    emulator, path = cell
    before = emulator.control.state()["position"]
    code = main(["doctor", str(path), "--duration", "0.4", "--json"])
    assert emulator.control.state()["position"] == pytest.approx(before, abs=1e-12)
    findings_read = json.loads(capsys.readouterr().out)
    assert findings_read["fit"] == (code == 0)
    bad = {one["device"] for one in findings_read["findings"] if one["verdict"] == "BAD"}
    # a busy computer may be unfit, and let devices seem so; what does not depend on time is in order
    found = {(one["device"].split(" at ")[0], one["what"]): one for one in findings_read["findings"]}
    assert found["UR arm", "safety"]["verdict"] == "good"
    assert found["UR arm", "PolyScope"]["value"] == "5.14.0.1"
    assert found["F/T sensor", "noise Fx"]["verdict"] == "good"
    assert 100.0 < found["F/T sensor", "rate"]["value"] < 1100.0
    assert bool(bad) == (code == 1)
    for one in findings_read["findings"]:
        assert bool(one["fix"]) == (one["verdict"] != "good")


@pytest.mark.slow
def test_the_doctor_names_what_is_not_there_and_looks_at_the_rest(cell, capsys, tmp_path):
    emulator, path = cell
    address = emulator.addresses[box_of(emulator)]
    emulator.control.fault(box_of(emulator), "silent")
    assert main(["doctor", path, "--duration", "0.3"]) == 1
    message = " ".join(capsys.readouterr().out.split())
    assert "Fix: F/T sensor" in message
    assert "PolyScope" in message
    assert address in message
    assert "Not fit to run." in message


@pytest.fixture
def hand_cell(tmp_path) -> Iterator[tuple[EmulatorProcess, str]]:
    """Servos on a terminal and two F/T boxes, and the path of the robot file for them."""
    address = own_address(next(_hosts))
    with EmulatorProcess(HandCell(address)) as emulator:
        terminal = next(its for its in emulator.addresses.values() if its.startswith("/dev"))
        yield emulator, str(robot_file(tmp_path, address, HAND.replace("TERMINAL", terminal)))


@pytest.mark.slow
def test_no_fault_opens_a_hand(hand_cell):
    emulator, path = hand_cell
    robot = load_robot(path)
    box = next(name for name, its in emulator.addresses.items() if not its.startswith("/dev"))
    rig = FreshlyTared(assembled(robot, robot.file.period))
    with rig:
        rig.start()
        rig.pacer.start()
        first = rig.step(Command(grip_force=(2.0, 2.0)))
        for _ in range(200):
            last = rig.step(Command())
        assert all(
            now > before for now, before in zip(last.hand.joint_position, first.hand.joint_position, strict=True)
        )
        emulator.control.fault(box, "silent")
        error = first_error(lambda: rig.step(Command()))
        assert error.device.startswith("F/T sensor")
        for _ in range(20):  # as a loop that brakes
            with contextlib.suppress(DeviceError):
                rig.step(Command())
        rig.pacer.stop()
    polled = rig.backend.hand
    assert isinstance(polled, PolledHand)
    hand = polled.hand
    assert isinstance(hand, DynamixelHand)
    assert "left with its torque on, pressing with 2, 2 N" in hand.closing_note


@pytest.mark.slow
def test_the_doctor_looks_at_servos(hand_cell, capsys):
    _, path = hand_cell
    main(["doctor", str(path), "--duration", "0.3", "--json"])
    findings_read = json.loads(capsys.readouterr().out)
    servos = [one for one in findings_read["findings"] if "servo" in one["device"]]
    assert {one["what"] for one in servos} == {"model", "firmware", "temperature", "supply", "hardware error"}
    assert len(servos) == 10
    wrong = {one["device"][-7:] for one in servos if one["verdict"] == "BAD"}
    assert wrong == {"servo 2"}  # the file says another model
    exchange = next(one for one in findings_read["findings"] if one["what"] == "exchange, median")
    assert 0.1 < exchange["value"] < 50.0
