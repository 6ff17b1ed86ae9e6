"""Grasps on robots: which robots have a hand, what can be asked of a real one, and what is planned with it."""

from dataclasses import replace
from operator import attrgetter
from types import SimpleNamespace

import msgspec
import numpy as np
import pytest

from palpate.controllers.grip.grasp import GraspStage
from palpate.errors import InvalidValueError
from palpate.experiments.grasp.experiment import GraspObject
from palpate.experiments.grasp.result import GraspResult
from palpate.experiments.grasp.truth import GraspFeltRecorder
from palpate.experiments.kit.recorded_run import RecordedRun
from palpate.hw.devices import move_fingers
from palpate.hw.rig import FreshlyTared
from palpate.hw.rig.placed_arm import ArmFromHere
from palpate.reporting.page import report_page
from palpate.robots.emulated.hand import HandOnTheWire
from palpate.robots.emulated.hand_kind import EmulatedHandEntry
from palpate.robots.hand_description import robots_with_hand
from palpate.robots.robot import load_robot, shipped_robots
from palpate.runtime.data import Command, Sample
from palpate.runtime.supervision.limits import Limits
from palpate.runtime.touch import Finger
from palpate.runtime.watchdog import STEPPED
from palpate.runtime.wrapped_backend import WrappedBackend
from palpate.spatial import IDENTITY
from support.emulated_file import changed_file
from support.grasp_runs import plan_of, planned_again
from support.refusals import check_refusals
from support.run_bounds import check_bounds

BELIEVED = {"believed_friction": 0.4, "believed_spin_length": 0.003}


@pytest.mark.slow
def has_hand(name):
    robot = load_robot(name)
    return robot.file.backend.has_hand(robot)


@pytest.mark.parametrize("name", [name for name in shipped_robots() if not has_hand(name)])
def test_a_robot_without_a_hand_is_refused_and_those_with_one_are_named(name):
    with pytest.raises(InvalidValueError, match=f"robot = {name}: it has no hand") as refused:
        plan_of(robot=name, **BELIEVED)
    assert robots_with_hand() == "emulated-hand, panda-hand, ur5e-hand"
    assert robots_with_hand() in str(refused.value)


def test_an_emulated_hand_grasps_as_the_simulated_one_is_planned_to():
    emulated, simulated = plan_of(robot="emulated-hand"), plan_of()
    same = attrgetter("times", "lift", "believed", "true")
    assert same(emulated) == same(simulated)
    assert isinstance(emulated.backend(), HandOnTheWire)
    assert planned_again(emulated) == emulated


def test_the_emulated_hands_file_is_in_order_and_says_what_is_simulated(tmp_path):
    robot = load_robot("emulated-hand")

    check_refusals(
        (
            r"fingers\[0\]: an emulated hand has spheres of 0.008 m",
            lambda: plan_of(robot=changed_file(tmp_path, "emulated-hand", ("radius_m: 0.008", "radius_m: 0.009"))),
        ),
        (
            "period_s",
            lambda: plan_of(robot=changed_file(tmp_path, "emulated-hand", ("period_s: 0.001", "period_s: 0.002"))),
        ),
    )
    backend = robot.file.backend
    assert isinstance(backend, EmulatedHandEntry)
    for wrong in ({"address": "10.0.0.1"}, {"sensors": ("127.0.0.3", "127.0.0.3")}, {"time_scale": 0.0}):
        with pytest.raises(InvalidValueError):
            msgspec.structs.replace(backend, **wrong).__post_init__()
    assert EmulatedHandEntry().wires().bus != EmulatedHandEntry().wires().bus


def test_a_grip_that_the_robot_does_not_allow_is_refused_before_anything_moves(tmp_path):
    file = changed_file(tmp_path, "ur5e-hand", ("grip_force_N: 16", "grip_force_N: 8"))
    check_refusals(
        (r"limits\.grip_force_N = 8 .* at least 15\.5 N", lambda: plan_of(robot=file, **BELIEVED)),
        ("give --fingers 2", lambda: plan_of(robot="emulated-hand", fingers=3, object="cylinder")),
    )


def test_a_rig_is_planned_with_its_own_hand_noise_and_limits(tmp_path):
    file = changed_file(
        tmp_path,
        "ur5e-hand",
        ("opening_m: 0.04 ", "opening_m: 0.05 "),
        ("noise: {force_N: 0.01,", "noise: {force_N: 0.05,"),
    )
    planned = plan_of(robot=file, **BELIEVED)
    usual = plan_of(robot="ur5e-hand", **BELIEVED)
    check_bounds(planned, {}, hand__real=True, period=0.002, config__force_noise=0.05, config__load="none")
    finger = planned.fingers[0]
    assert isinstance(finger, Finger)
    assert finger.touch_force == pytest.approx(0.25)  # five times the noise
    assert planned.limits == load_robot(file).file.limits.allowing(planned.lift.speed) != Limits()
    # 10 mm farther to close, with 5 mm/s
    assert planned.times.begin - usual.times.begin == pytest.approx(2.0)
    # as far as anybody knows, contacts bear what they are believed to
    assert planned.true == planned.believed
    assert (planned.believed.friction, planned.believed.spin_length) == (0.4, 0.003)
    backend = planned.backend()
    assert isinstance(backend, FreshlyTared)
    assert isinstance(backend.backend.arm, ArmFromHere)
    assert backend.period == 0.002
    assert planned_again(planned) == planned


def test_devices_that_only_close_refuse_to_move_fingers_sideways():
    rig = plan_of(robot="ur5e-hand", **BELIEVED).backend()
    assert isinstance(rig, FreshlyTared)
    with pytest.raises(InvalidValueError, match=r"finger_velocity .*these fingers only close"):
        move_fingers(rig.backend.hand, ((0.0, 0.0, 0.0),) * 2)


def felt_grasp(planned, loads):
    """A grasp of which these normal forces were felt, half of it held: no simulation, no device."""
    control = planned.controller()
    hand = planned.hand.geometry
    recorder = GraspFeltRecorder(control, hand)
    for i, load in enumerate(loads):
        control.stage = GraspStage.HOLD
        contact = SimpleNamespace(
            centroid=np.array([4e-3, 0.0, 6.9e-3]),
            normal_force=load,
            tangential_force=np.array([0.3, 0.0, 0.4]),
            spin_torque=1e-3,
        )
        felt = load > 0.2
        finger = SimpleNamespace(touching=felt, believed=felt, contact=contact, force=(-load, 0.3, 0.4))
        arm = SimpleNamespace(position_base_tip=(0.0, 0.0, 0.1 + 0.001 * i), rotation_base_tip=IDENTITY)
        time, joints = planned.times.begin + 0.002 * i, SimpleNamespace(joint_position=hand.start)
        now = SimpleNamespace(time=time, fingers=(finger, finger), arm=arm, hand=joints)
        recorder(None, now, Command(grip_force=(2.0, 3.0)))
    return recorder.truth()


def test_what_fingers_feel_stands_in_the_place_of_a_truth_that_nobody_knows():
    planned = plan_of(robot="ur5e-hand", **BELIEVED)
    truth = felt_grasp(planned, [2.0, 2.5, 0.0])
    assert truth.loads[:, 0, 0].tolist() == [2.0, 2.5, 0.0]
    assert truth.loads[0, 1].tolist() == pytest.approx([2.0, 0.5, 1e-3])
    assert truth.command[0].tolist() == [2.0, 3.0]
    assert np.diff(truth.height) == pytest.approx([0.001, 0.001])
    # each at its fingertip, and out of the object
    assert np.linalg.norm(truth.contact[:2] - truth.tip[:2], axis=2) == pytest.approx(8e-3, abs=4e-3)
    assert truth.contact[2].tolist() == truth.tip[2].tolist()
    assert np.linalg.norm(truth.force[:, 0], axis=1) == pytest.approx(
        [np.hypot(2.0, 0.5), np.hypot(2.5, 0.5), 0.0]
    )
    assert truth.force[0].sum(axis=0)[0] == pytest.approx(0.0, abs=1e-9)
    for unknown in (truth.slip, truth.spin, truth.slid, truth.turned, truth.pull, truth.clearance, truth.normal):
        assert np.isnan(unknown).all()


@pytest.mark.slow
@pytest.mark.parametrize(("loads", "word"), [([2.0] * 5, "held"), ([2.0, 2.0, 0.0], "lost")])
def test_a_report_of_a_robot_says_what_was_felt_and_nothing_of_a_simulation(loads, word, tmp_path):
    planned = plan_of(robot="ur5e-hand", **BELIEVED)
    run = RecordedRun(plan_of(), _Ended(plan_of().backend())).run()
    grasp = GraspResult(planned, replace(run), felt_grasp(planned, loads), (), 0)
    report = GraspObject().report(grasp)
    assert f"The object was {word}, as the fingers feel it." in report.outcome
    names = [metric.name for metric in report.metrics]
    assert names[:2] == ["dropped", "largest grip"]
    assert not any("slip" in name or "spin" in name or "least" in name for name in names)
    assert report.metrics[1].value == 2.0
    said = report_page(report)
    for stand_in in ("simulated: none was late", str(STEPPED)):  # of the run that stands in for one
        said = said.replace(stand_in, "")
    assert "simulat" not in said.lower()
    assert "not known on a robot" in said


class _Ended(WrappedBackend):
    """A hand that fails at once: a run is soon over."""

    def step(self, command: Command) -> Sample:
        raise OSError("over")
